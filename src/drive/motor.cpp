#include "youbot_base_sim/drive/motor.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

double Motor::tick() const { return 2 * M_PI * gear_ratio / encoder_ticks; }

double Motor::rpm() const { return 2 * M_PI * gear_ratio / 60; }

double Motor::max_value(DriveMode mode) const {
  switch (mode) {
    case DriveMode::kOff:
      return 0;
    case DriveMode::kTorque:
      return max_torque();
    case DriveMode::kVelocity:
      return max_rate();
  }
  return 0;
}

SetPoint Motor::limited(SetPoint set_point) const {
  const double max = max_value(set_point.mode);
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
    switch (set_points_[i].mode) {
      case DriveMode::kOff:
        break;
      case DriveMode::kTorque:
        torque[i] = set_points_[i].value;
        break;
      case DriveMode::kVelocity:
        torque[i] = tracking_torque(i, set_points_[i].value - dphi[i]);
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
