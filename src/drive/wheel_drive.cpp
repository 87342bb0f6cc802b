#include "youbot_base_sim/drive/wheel_drive.h"

#include <algorithm>

namespace youbot_base_sim {

WheelDrive::WheelDrive(double control_period, const Motor& motor, const VelocityGains& gains, bool quantized)
    : control_period_(control_period), motor_(motor), gains_(gains), quantized_(quantized) {}

void WheelDrive::command(int i, const SetPoint& set_point) {
  if (set_point.mode != DriveMode::kVelocity || set_points_[i].mode != DriveMode::kVelocity) integral_[i] = 0;
  const SetPoint limited = motor_.limited(set_point);
  set_points_[i] = quantized_ ? motor_.transmitted(limited) : limited;
}

Wheels WheelDrive::sample(const Wheels& dphi) {
  const double max = motor_.max_torque();
  Wheels torque = Wheels::Zero();
  for (int i = 0; i < kWheels; ++i) {
    const auto [mode, value] = set_points_[i];
    if (mode == DriveMode::kTorque) torque[i] = value;
    if (mode != DriveMode::kVelocity) continue;
    const double error = value - dphi[i];
    const double integral = integral_[i] + gains_.integral * control_period_ * error;
    const double unlimited = gains_.proportional * error + integral;
    torque[i] = std::clamp(unlimited, -max, max);
    // While the torque is limited, the integral only moves away from the limit.
    if (torque[i] == unlimited || error * unlimited < 0) integral_[i] = integral;
  }
  return torque;
}

}  // namespace youbot_base_sim
