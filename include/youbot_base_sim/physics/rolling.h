#pragma once

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/inertia.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Wheels that roll without slip and touch the floor below their centres (paper, section 5.1):
/// R dphi = V_X + tan(delta) V_Y + arm Omega for each of them, with v = (V_X, V_Y, Omega), m/s and rad/s.
class Rolling {
 public:
  Rolling(double R, const Wheels& tan_delta, const Wheels& arm);
  explicit Rolling(const RobotParameters& robot);

  /// Wheel rates, rad/s, at the velocity v.
  Wheels dphi(const Eigen::Vector3d& v) const { return (v[0] + tan_delta_ * v[1] + arm_ * v[2]) / R_; }

  /// Velocity by the wheel rates; the component of the four rates that no velocity explains is lost (least squares).
  Eigen::Vector3d velocity(const Wheels& dphi) const;

  /// Wheel torques, N m, that exert `force` (N, N m) on v and do not work against each other.
  Wheels torque(const Eigen::Vector3d& force) const;

  /// |l + h tan(roller_angle)|, m, where all rollers have one angle; in general a length that is 0, or NaN, if wheel
  /// rates do not determine v.
  double lever() const { return lever_; }

 private:
  double R_;
  Wheels tan_delta_, arm_;
  PlatformMatrix shares_;  // of wheels in V_X, V_Y and Omega: +-1 where rollers have one angle
  Eigen::Vector3d scale_;
  double lever_;
};

}  // namespace youbot_base_sim
