#pragma once

#include <cmath>
#include <vector>

#include "youbot_base_sim/loop/base_sensors.h"
#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A run that advances from row to row, and what is gathered on the way.
class ObservedRun {
 public:
  /// `simulation` stands at t = 0, and must outlive this.
  explicit ObservedRun(Simulation& simulation);

  /// Advances to the next row, see RowLoop::next.
  bool next();

  const Simulation& simulation() const { return simulation_; }
  const State& state() const { return simulation_.state(); }
  const RowLoop& rows() const { return rows_; }
  double largest_slip() const { return std::sqrt(square_of_slip_); }  ///< of contact points over the floor, m/s
  /// The pose of the driver's odometry, which starts at the true one: x, y (m), psi (rad).
  Eigen::Vector3d odometry() const;

 private:
  Simulation& simulation_;
  RowLoop rows_;
  double square_of_slip_ = 0;
  BaseSensors sensors_;
};

/// A number that a table may have for each run.
struct Quantity {
  const char* name;
  const char* text;  ///< its meaning and unit, for --help
  double (*value)(const ObservedRun& run);
};

/// All quantities, in the table's order if the family names none.
const std::vector<Quantity>& quantities();

}  // namespace youbot_base_sim
