#include "youbot_base_sim/drive/wheel_odometry.h"

#include <cmath>

namespace youbot_base_sim {

Wheels DriverKinematics::wheel_rates(const Eigen::Vector3d& velocity) const {
  const double v_x = velocity[0], v_y = velocity[1], turn = half_lengths * velocity[2];
  return Wheels(v_x - v_y - turn, v_x + v_y + turn, v_x + v_y - turn, v_x - v_y + turn) / wheel_radius;
}

Eigen::Vector3d DriverKinematics::velocity(const Wheels& dphi) const {
  const double quarter = wheel_radius / 4;
  return {quarter * (dphi[0] + dphi[1] + dphi[2] + dphi[3]), quarter * (-dphi[0] + dphi[1] + dphi[2] - dphi[3]),
          quarter / half_lengths * (-dphi[0] + dphi[1] - dphi[2] + dphi[3])};
}

WheelOdometry::WheelOdometry(const DriverKinematics& kinematics, const Wheels& phi)
    : kinematics_(kinematics), phi_(phi) {}

void WheelOdometry::update(const Wheels& phi) {
  const Eigen::Vector3d moved = kinematics_.velocity(phi - phi_);
  phi_ = phi;
  pose_[2] += moved[2];
  const double c = std::cos(pose_[2]), s = std::sin(pose_[2]);
  pose_[0] += c * moved[0] - s * moved[1];
  pose_[1] += s * moved[0] + c * moved[1];
}

void WheelOdometry::reset(const Wheels& phi) {
  phi_ = phi;
  pose_.setZero();
}

}  // namespace youbot_base_sim
