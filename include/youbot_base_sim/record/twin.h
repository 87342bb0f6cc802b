#pragma once

#include <atomic>
#include <string>

#include "youbot_base_sim/record/run_audit.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

constexpr double kPromised = 20;

/// What the position of a reliable run may be off by, m, with heading counted at the wheels' centres: kPromised times
/// tolerance times path, with what it creeps and, by spin friction, turns by a regularization speed that the tolerance
/// sets, and 1e-16 m a step and of the position, as rounding may sum up. Random scenes measure it (docs/reliability.md). A fixed step is
/// judged by the looser tolerance of the energy balance.
double promised_error(const Simulation& simulation, const PathLength& path);

/// A second run of a scene at half the tolerance, or half the fixed step; where rows end steps, these are of half a row
/// at most. At the start its wheels and twist are off by 1e-9 rad, m/s and rad/s. How far it parts from the first run
/// is an error bar, also where a motion is sensitive or the error estimate fails.
class Twin {
 public:
  explicit Twin(const Scene& scene);

  /// As Simulation::stop_on.
  void stop_on(const std::atomic<bool>& stop) { simulation_.stop_on(stop); }

  /// Advances to its next row, to which `run` has come, and compares both. Throws Stopped.
  void follow(const Simulation& run);

  // The largest differences over the rows.
  double position_difference() const { return position_; }  ///< m
  double heading_difference() const { return heading_; }    ///< rad

  /// Why the run is unreliable, in one line; empty if both agree as `promised_error` says.
  std::string doubt(const Simulation& run, const PathLength& path) const;

 private:
  Simulation simulation_;
  RowLoop rows_;
  double position_ = 0, heading_ = 0;
  double distance_ = 0;  // of both together, m
  std::string ending_;   // what ended it early
};

}  // namespace youbot_base_sim
