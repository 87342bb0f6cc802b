#include "youbot_base_sim/drive/driver_kinematics.h"

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

DriverKinematics::Jacobian DriverKinematics::jacobian() const {
  Jacobian jacobian;
  for (int i = 0; i < kWheels; ++i) jacobian.col(i) = velocity(Eigen::Vector4d::Unit(i).array());
  return jacobian;
}

}  // namespace youbot_base_sim
