#include "youbot_base_sim/physics/rolling.h"

namespace youbot_base_sim {

Rolling::Rolling(double R, const Wheels& tan_delta, const Wheels& arm) : R_(R), tan_delta_(tan_delta), arm_(arm) {
  // Normalized, these columns are orthogonal and made of +-1 where rollers have one angle, whatever rounding does.
  PlatformMatrix columns{Wheels::Ones(), tan_delta, arm};
  for (int k = 0; k < 3; ++k) {
    const double largest = columns[k].abs().maxCoeff();
    columns[k] /= largest;
    scale_[k] = R / 4 / largest;
  }
  Eigen::Matrix3d squares;
  for (int k = 0; k < 3; ++k) {
    for (int l = 0; l < 3; ++l) squares(k, l) = sum(columns[k] * columns[l]) / 4;
  }
  const Eigen::Matrix3d m = inverse(squares);
  for (int k = 0; k < 3; ++k) shares_[k] = m(k, 0) * columns[0] + m(k, 1) * columns[1] + m(k, 2) * columns[2];
  lever_ = arm.abs().maxCoeff() * std::sqrt(squares.determinant());
}

Rolling::Rolling(const RobotParameters& robot)
    : Rolling(robot.R, robot.tan_delta(), robot.rho_X() * robot.tan_delta() - robot.rho_Y()) {}

Eigen::Vector3d Rolling::velocity(const Wheels& dphi) const {
  Eigen::Vector3d v;
  for (int k = 0; k < 3; ++k) {
    const Wheels part = shares_[k] * dphi;
    v[k] = scale_[k] * (part[0] + part[1] + part[2] + part[3]);
  }
  return v;
}

Wheels Rolling::torque(const Eigen::Vector3d& force) const {
  return scale_[0] * force[0] * shares_[0] + scale_[1] * force[1] * shares_[1] + scale_[2] * force[2] * shares_[2];
}

}  // namespace youbot_base_sim
