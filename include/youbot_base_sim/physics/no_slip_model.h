#pragma once

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/dry_bearings.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/rolling.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Model 1 of the paper (section 5.1): contact at the middle of each roller and no slip, so that v = (V_X, V_Y, Omega),
/// m/s and rad/s, determines all other velocities.
class NoSlipModel {
 public:
  /// The floor may slope; `bare` is the robot without loads.
  explicit NoSlipModel(const RobotParameters& bare, const FloorParameters& floor = {},
                       const AppliedLoads& applied = {});

  /// Rates of the wheels, and of the rollers in contact, that roll without slip at `v`, rad/s.
  Wheels dphi(const Eigen::Vector3d& v) const { return product(rolling_, v).array(); }
  Wheels dgamma(const Eigen::Vector3d& v) const { return product(roller_rolling_, v).array(); }

  /// dv/dt under the wheel torques `M`, N m, and the force `external` on v, N and N m.
  Eigen::Vector3d acceleration(const Eigen::Vector3d& v, const Wheels& M,
                               const Eigen::Vector3d& external = Eigen::Vector3d::Zero()) const;

  /// Torque profile of section 5.2: the wheel torques, N m, under which the velocity is `v` and changes by `dv`, with
  /// no internal preload, (+1, +1, -1, -1) where all rollers have one angle.
  Wheels torque(const Eigen::Vector3d& v, const Eigen::Vector3d& dv) const;

  /// True if bearings have dry friction; without, the torques are quadratic in v and linear in dv.
  bool dry() const { return dry_.any(); }

  /// The longest step from the velocity v, which changes by dv, that sees the bearings' dry friction reverse, s.
  double max_step(const Eigen::Vector3d& v, const Eigen::Vector3d& dv) const {
    return std::min(dry_.wheels.max_step(dphi(v), dphi(dv)), dry_.rollers.max_step(dgamma(v), dgamma(dv)));
  }

  /// Time derivative of `state` under the wheel torques `M`, N m; zero for dphi and dgamma, which `constrain` sets.
  void derivative(const State& state, const Wheels& M, State& derivative) const;

  /// An upper bound of the rate at which velocities decay, 1/s.
  double max_decay_rate() const;

  /// Sets dphi and dgamma of `state` to what rolls without slip.
  void constrain(State& state) const;

  /// Gravity along the floor and wrenches at heading psi (rad), on v, N and N m.
  Eigen::Vector3d external_force(double psi) const {
    const auto [sine, cosine] = sine_and_cosine(psi);
    return external_.at(cosine, sine).v.head<3>().matrix();
  }

  const RobotParameters& robot() const { return robot_; }  ///< with its loads

  /// Mass and inertia that the platform's velocities feel, wheels included.
  const Eigen::Matrix3d& inertia() const { return inertia_; }

  /// Kinetic energy, J; without that of the rollers, which model 1 holds to be weightless.
  double kinetic_energy(const Eigen::Vector3d& v) const {
    return 0.5 * product(v.transpose(), product(inertia_, v)).value();
  }

 private:
  using WheelsByVelocity = Eigen::Matrix<double, kWheels, 3, Eigen::DontAlign>;

  /// Forces on v of the dry friction in wheels and rollers, and their derivative by v.
  Eigen::Vector3d dry_friction(const Eigen::Vector3d& v) const;
  Eigen::Matrix3d dry_damping(const Eigen::Vector3d& v) const;
  /// Forces on v besides the wheels' torques, to the left-hand side.
  Eigen::Vector3d bias(const Eigen::Vector3d& v) const;

  RobotParameters robot_;
  Inertia platform_;
  DryBearings dry_;
  Rolling kinematics_;
  ExternalForces external_;
  WheelsByVelocity rolling_;         // dphi = rolling_ v
  WheelsByVelocity roller_rolling_;  // dgamma = roller_rolling_ v
  Eigen::Matrix3d inertia_, inertia_inverse_;
  Eigen::Matrix3d damping_;  // diagonal (zeta_X, zeta_Y, mu_Omega) where all wheels' bearings are alike
};

}  // namespace youbot_base_sim
