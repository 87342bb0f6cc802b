#include "youbot_base_sim/drive/wheel_drive.h"

#include <algorithm>

namespace youbot_base_sim {

WheelDrive::WheelDrive(double control_period, const Motor& motor, const VelocityGains& gains)
    : control_period_(control_period), motor_(motor), gains_(gains) {}

void WheelDrive::command(int i, const SetPoint& set_point) {
  if (set_point.mode != DriveMode::kVelocity || set_points_[i].mode != DriveMode::kVelocity) integral_[i] = 0;
  set_points_[i] = motor_.limited(set_point);
}

Wheels WheelDrive::sample(const Wheels& dphi) {
  const double most = motor_.most_torque();
  Wheels torque = Wheels::Zero();
  for (int i = 0; i < kWheels; ++i) {
    const auto [mode, value] = set_points_[i];
    if (mode == DriveMode::kTorque) torque[i] = value;
    if (mode != DriveMode::kVelocity) continue;
    const double error = value - dphi[i];
    const double integral = integral_[i] + gains_.integral * control_period_ * error;
    const double wanted = gains_.proportional * error + integral;
    torque[i] = std::max(-most, std::min(wanted, most));
    // No wind-up: at the limit the integral moves only back from it.
    if (torque[i] == wanted || error * wanted < 0) integral_[i] = integral;
  }
  return torque;
}

}  // namespace youbot_base_sim
