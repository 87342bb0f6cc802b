#pragma once

#include <string>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// What came of a random scene.
enum class Outcome {
  kRight,      ///< called reliable, and accurate
  kDoubted,    ///< called unreliable, though it is accurate
  kWarned,     ///< called unreliable, and inaccurate
  kSensitive,  ///< inaccurate, but so are neighbours of the exact motion
  kUndecided,  ///< inaccurate by a reference that is not known as well itself
  kWrong,      ///< called reliable, and inaccurate
  kFailed,     ///< ended with an error other than tipping over
};

/// How well a scene is simulated.
struct Verdict {
  Outcome outcome = Outcome::kRight;
  double error = 0;     ///< largest distance from the exact motion over the rows, m; rotation at the wheels' centres
  double allowed = 0;   ///< what a reliable run promises, m
  double cpu_time = 0;  ///< of the run that is judged, s
  std::string reason;   ///< why it was called unreliable, or failed
};

/// Simulates the scene at its tolerance and judges it by the same motion at 1e-10.
Verdict judge(const Scene& scene);

}  // namespace youbot_base_sim
