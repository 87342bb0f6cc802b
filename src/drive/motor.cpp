#include "youbot_base_sim/drive/motor.h"

#include <algorithm>

namespace youbot_base_sim {

DriveModeText text_of(DriveMode mode) {
  switch (mode) {
    case DriveMode::kOff:
      return {"off", ""};
    case DriveMode::kTorque:
      return {"torque", "N m"};
    case DriveMode::kVelocity:
      return {"velocity", "rad/s"};
  }
  return {"", ""};
}

SetPoint Motor::limited(SetPoint set_point) const {
  double max = 0;
  switch (set_point.mode) {
    case DriveMode::kOff:
      break;
    case DriveMode::kTorque:
      max = max_torque();
      break;
    case DriveMode::kVelocity:
      max = max_rate();
      break;
  }
  set_point.value = std::clamp(set_point.value, -max, max);
  return set_point;
}

bool Motor::can(const SetPoint& set_point) const { return limited(set_point).value == set_point.value; }

SetPoint Motor::transmitted(SetPoint set_point) const {
  // A torque that is a whole number of mA but for rounding must not lose one by truncation.
  constexpr double kRounding = 1e-9;
  const double milliamperes = set_point.value / milliampere();
  switch (set_point.mode) {
    case DriveMode::kOff:
      break;
    case DriveMode::kTorque:
      set_point.value = std::trunc(milliamperes + std::copysign(kRounding, milliamperes)) * milliampere();
      break;
    case DriveMode::kVelocity:
      set_point.value = std::round(set_point.value / rpm()) * rpm();
      break;
  }
  return set_point;
}

double VelocityGains::unstable_period(double wheel_inertia) const {
  return 4 * wheel_inertia / (proportional + std::sqrt(proportional * proportional + 4 * wheel_inertia * integral));
}

WheelDrive::WheelDrive(double control_period, const Motor& motor, const VelocityGains& gains, bool quantized)
    : control_period_(control_period), motor_(motor), gains_(gains), quantized_(quantized) {}

void WheelDrive::command(int i, const SetPoint& set_point) {
  if (set_point.mode != DriveMode::kVelocity || set_points_[i].mode != DriveMode::kVelocity) integral_[i] = 0;
  const SetPoint limited = motor_.limited(set_point);
  set_points_[i] = quantized_ ? motor_.transmitted(limited) : limited;
}

Wheels WheelDrive::sample(const Wheels& dphi) {
  Wheels torque = Wheels::Zero();
  for (int i = 0; i < kWheels; ++i) {
    const auto [mode, value] = set_points_[i];
    switch (mode) {
      case DriveMode::kOff:
        break;
      case DriveMode::kTorque:
        torque[i] = value;
        break;
      case DriveMode::kVelocity:
        torque[i] = tracking_torque(i, value - dphi[i]);
        break;
    }
  }
  return torque;
}

// The velocity loop of wheel i, which is too slow by `error`, rad/s.
double WheelDrive::tracking_torque(int i, double error) {
  const double max = motor_.max_torque();
  const double integral = integral_[i] + gains_.integral * control_period_ * error;
  const double unlimited = gains_.proportional * error + integral;
  const double torque = std::clamp(unlimited, -max, max);
  if (torque == unlimited || error * unlimited < 0) integral_[i] = integral;
  return torque;
}

}  // namespace youbot_base_sim
