#pragma once

#include <array>
#include <cstdint>

namespace youbot_base_sim {

/// Counters of an integration so far.
struct IntegrationStatistics {
  std::uint64_t steps = 0;
  std::uint64_t rejected_steps = 0;
  std::uint64_t location_steps = 0;
  std::uint64_t newton_iterations = 0;
  std::uint64_t factorizations = 0;
  std::uint64_t switches = 0;
  std::uint64_t shared_contacts = 0;
  std::uint64_t averaged_contacts = 0;
  std::uint64_t exhausted = 0;
  std::uint64_t eased_periods = 0;
  std::uint64_t fallback_steps = 0;
  std::uint64_t evaluations = 0;
  double forced_hold_speed = 0;       ///< m/s, that wheels which were held gave the platform, or kicks would have
  double drift_speed = 0, drift = 0;  ///< model 1's, m/s and m: see NoSlipIntegrator
};

/// A field of the statistics, for output.
struct StatisticsField {
  const char* name;  ///< as in the summary
  const char* text;  ///< for people
  std::uint64_t IntegrationStatistics::*value;
};

/// All of them, in the order in which they are shown.
constexpr std::array<StatisticsField, 12> kStatisticsFields = {{
    {"steps", "steps accepted", &IntegrationStatistics::steps},
    {"rejected_steps", "steps rejected", &IntegrationStatistics::rejected_steps},
    {"location_steps", "steps repeated to end at an event", &IntegrationStatistics::location_steps},
    {"newton_iterations", "Newton iterations", &IntegrationStatistics::newton_iterations},
    {"factorizations", "factorizations of the Newton matrix", &IntegrationStatistics::factorizations},
    {"evaluations", "evaluations of the right-hand side", &IntegrationStatistics::evaluations},
    {"switches", "roller switches", &IntegrationStatistics::switches},
    {"shared_contacts", "times that a wheel came to rest on two rollers", &IntegrationStatistics::shared_contacts},
    {"averaged_contacts", "times that a wheel became too fast to locate its switches",
     &IntegrationStatistics::averaged_contacts},
    {"exhausted", "times that the bound of work was reached", &IntegrationStatistics::exhausted},
    {"eased_periods", "milliseconds in which wheels that chatter were held early to save work",
     &IntegrationStatistics::eased_periods},
    {"fallback_steps", "fallback steps, of first order", &IntegrationStatistics::fallback_steps},
}};

}  // namespace youbot_base_sim
