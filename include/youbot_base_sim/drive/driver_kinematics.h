#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/rolling.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Base kinematics as the youBot driver computes them: a Mecanum base that does not slip and whose wheels touch the
/// floor below their centres. Wheel rates are positive forward on all four wheels, as in the URDF and the paper.
///
/// Lengths as in the driver's youbot-base.cfg, whose wheel radius is 5 % too small: odometry falls short by that much.
struct DriverKinematics {
  double wheel_radius = 0.0475;  ///< m
  double half_lengths = 0.385;   ///< half the wheelbase plus half the track, (0.47 + 0.3) / 2, m
  /// Rollers at other angles than 45 degrees: tan(delta) of each wheel, and the half wheelbase, m.
  Wheels tan_delta = RobotParameters().tan_delta();
  double half_wheelbase = 0.235;

  /// The kinematics of a robot's wheels.
  static DriverKinematics of(const RobotParameters& robot) {
    return {robot.R, robot.h + robot.l, robot.tan_delta(), robot.h};
  }

  /// Wheel rates, rad/s, for a velocity (V_X, V_Y, Omega) of the base in its own frame, m/s and rad/s.
  Wheels wheel_rates(const Eigen::Vector3d& velocity) const { return rolling().dphi(velocity); }

  /// Velocity of the base by the wheel rates; the component of the four rates that no such motion explains is lost.
  /// Linear: it also converts differences of wheel angles (rad) to displacements (m, m, rad).
  Eigen::Vector3d velocity(const Wheels& dphi) const { return rolling().velocity(dphi); }

  using Jacobian = Eigen::Matrix<double, 3, kWheels, Eigen::DontAlign>;

  /// The matrix of `velocity`: its rows are V_X, V_Y and Omega, its columns the wheels.
  Jacobian jacobian() const;
  /// The same for many velocities.
  Rolling rolling() const;
};

}  // namespace youbot_base_sim
