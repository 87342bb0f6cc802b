#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// A run of a scene.
struct Motion {
  std::vector<Eigen::Vector3d> rows;  ///< x, y (m), psi times the distance of the wheels' centres from O
  IntegrationStatistics counts;
  double promised = 0;  ///< error, m
  std::string doubt;    ///< why it is called unreliable
  std::string failure;  ///< what ended it, but for tipping over
};

/// Simulates the scene as it is.
Motion run(const Scene& scene);

/// Largest distance over the rows that both have, m.
double distance(const Motion& a, const Motion& b);

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
  double cpu_time = 0;  ///< of the run that is judged, s; the least of three that take up to twice the duration
  std::string reason;   ///< why it was called unreliable, or failed
};

/// Simulates the scene at its tolerance and judges it by the same motion at 1e-10. A `judge_method` other than "radau",
/// which shares no mistake with it, judges at 1e-8, or a tenth of the scene's tolerance if that is less.
Verdict judge(const Scene& scene, const std::string& judge_method = "radau");

}  // namespace youbot_base_sim
