#pragma once

#include <cmath>
#include <vector>

#include "youbot_base_sim/drive/motor_sensors.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/record/run_audit.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// What a run is asked for besides its state at the end: looked up at each row.
class Observer {
 public:
  explicit Observer(const Simulation& simulation);

  void add_row();

  const Simulation& simulation() const { return simulation_; }
  const PathLength& path() const { return path_; }
  double largest_slip() const { return std::sqrt(square_of_slip_); }  ///< of contact points over the floor, m/s
  /// The pose that the driver's odometry has, laid over the true one at the start: x, y (m), psi (rad).
  Eigen::Vector3d odometry() const;

 private:
  const Simulation& simulation_;
  PathLength path_;
  double square_of_slip_ = 0;
  MotorSensors sensors_;
  WheelOdometry odometry_;
};

/// A number that a table may have for each run.
struct Quantity {
  const char* name;
  const char* text;  ///< what it is, with its unit
  double (*value)(const Observer& run, const EnergyAudit& energy);
};

/// All of them, in the order of a table that names none.
const std::vector<Quantity>& quantities();

}  // namespace youbot_base_sim
