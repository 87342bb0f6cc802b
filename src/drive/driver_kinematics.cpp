#include "youbot_base_sim/drive/driver_kinematics.h"

namespace youbot_base_sim {

Rolling DriverKinematics::rolling() const {
  const RobotParameters youbot;
  const Wheels arm{-half_lengths, half_lengths, -half_lengths, half_lengths};
  const Wheels front{half_wheelbase, half_wheelbase, -half_wheelbase, -half_wheelbase};
  return {wheel_radius, tan_delta, arm + front * (tan_delta - youbot.tan_delta())};
}

DriverKinematics::Jacobian DriverKinematics::jacobian() const {
  const Rolling rolling = this->rolling();
  Jacobian jacobian;
  for (int i = 0; i < kWheels; ++i) jacobian.col(i) = rolling.velocity(Eigen::Vector4d::Unit(i).array());
  return jacobian;
}

}  // namespace youbot_base_sim
