#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "youbot_base_sim/simulation.h"

/// One input; whoever drives the target, libFuzzer or replay.cpp, calls it with many. Returns 0; ends the process by
/// abort() where a promise is broken.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace youbot_base_sim {

/// Aborts with `what` unless `holds`.
inline void require(bool holds, const std::string& what) {
  if (holds) return;
  fmt::print(stderr, "broken promise: {}\n", what);
  std::abort();
}

template <class Values>
void require_finite(const Values& values, const std::string& what) {
  for (const double value : values) require(std::isfinite(value), fmt::format("{} is finite, but is {}", what, value));
}

/// A message for people is one line, and not a long one.
inline void require_one_line(const std::string& message) {
  require(!message.empty(), "a refusal says why");
  for (const unsigned char c : message) {
    require(c >= 0x20 && c != 0x7f, fmt::format("no control character in \"{}\"", message));
  }
  require(message.size() < 1000, fmt::format("no long line: \"{}\"", message));
}

/// Advances `simulation` by up to 3 ms, and three of its control periods where they are shorter, with bounded work and
/// a finite state. The equations may have no finite solution: that is told, by std::domain_error.
inline void require_bounded_motion(Simulation& simulation) {
  constexpr double kStretch = 1e-3;             // s, the window of the guard
  constexpr std::uint64_t kEvaluations = 8000;  // in a stretch: the guard's 3000, 80 % more, and what fallback takes
  for (int k = 1; k <= 3; ++k) {
    const std::uint64_t before = simulation.statistics().evaluations;
    const double period = simulation.scene().solver.control_period;
    try {
      simulation.advance_to(k * (period > 0 ? std::min(period, kStretch) : kStretch));
    } catch (const std::domain_error& error) {
      return require_one_line(error.what());
    }
    const std::uint64_t evaluations = simulation.statistics().evaluations - before;
    require(evaluations <= kEvaluations, fmt::format("work is bounded, but a millisecond takes {}", evaluations));
    require_finite(simulation.state(), "the state");
    require_finite(simulation.torque(), "the torque");
  }
}

}  // namespace youbot_base_sim
