#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "youbot_base_sim/offline/rows.h"
#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Processor time of a run, by output interval. Reads the thread's clock twice an interval, 0.2 us each.
class RunCost {
 public:
  void start(double t);  ///< begins an interval at simulated time t, s
  void stop(double t);   ///< ends it

  double cpu_time() const { return cpu_time_; }  ///< s

  /// Adds the keys cpu_time, slowest_period and periods.
  void write_to(nlohmann::json& summary) const;

 private:
  double t_ = 0, clock_ = 0;                     // of the interval's beginning, s
  double cpu_time_ = 0;                          // of all intervals, s
  double start_ = 0, length_ = 0, slowest_ = 0;  // the slowest interval's, and its processor time, s
  std::size_t late_ = 0;                         // intervals that took longer than they last
  std::vector<float> cpu_times_;
};

/// The summary of a run and its twin (null: none) as JSON. `completed`: to the scene's duration; `wall_time` in s.
std::string summary_json(const Simulation& simulation, bool completed, double wall_time, const RunCost& cost,
                         const RowLoop& rows, const Twin* twin);

/// The summary in a few lines for a person: pose, path, energy; with the counters of the integration if `verbose`.
std::string summary_text(const Simulation& simulation, double wall_time, const RowLoop& rows, const Twin* twin,
                         bool verbose);

}  // namespace youbot_base_sim
