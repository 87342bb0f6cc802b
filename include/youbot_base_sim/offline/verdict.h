#pragma once

#include <atomic>
#include <string>

#include "youbot_base_sim/offline/rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

constexpr double kPromised = 20;

/// Error of the position of a reliable run, at most, m, with heading counted at the wheels' centres: kPromised times
/// tolerance times path, or model 1's drift if longer, what it creeps and, by spin friction, rotates by a
/// regularization speed that the tolerance sets, and 1e-16 m a step and of the distance from the origin for rounding.
double promised_error(const Simulation& simulation, const PathLength& path);

/// A second run of a scene at half the tolerance; where rows end steps, these are of half a row at most. At the start
/// its wheels and twist are off by 1e-9 rad, m/s and rad/s. How far it parts from the first run is an error bar, also
/// where a motion is sensitive or the error estimate fails.
class Twin {
 public:
  explicit Twin(const Scene& scene);

  /// Has `follow` throw Stopped once `stop`, which must outlive this, is set.
  void stop_on(const std::atomic<bool>& stop) { simulation_.stop_on(stop); }

  /// Advances to its next row, to which `run` has come, and compares both. Throws Stopped.
  void follow(const Simulation& run);

  // The largest differences over the rows.
  double position_difference() const { return position_; }  ///< m
  double heading_difference() const { return heading_; }    ///< rad

  /// The reason why the run is unreliable, in one line; empty if both agree as `promised_error` says.
  std::string doubt(const Simulation& run, const PathLength& path) const;

 private:
  Simulation simulation_;
  RowLoop rows_;
  double position_ = 0, heading_ = 0;
  double distance_ = 0;  // of both together, m
  std::string ending_;   // what ended it early
};

/// The reason why a result may be unreliable, in one line; empty if it is reliable: the integration kept to its own
/// method, wheels held early cannot matter, the run agrees with its twin (null: none), and the energy balance closes to
/// a share of the energy that the motion had or exchanged. That share is a thousand times the tolerance, from 1e-9 to a
/// thousandth (or ten times a looser tolerance); with prescribed wheels at least 2e-14 m/s over the regularization
/// speed.
std::string unreliability_reason(const Simulation& simulation, const RowLoop& rows, const Twin* twin);

}  // namespace youbot_base_sim
