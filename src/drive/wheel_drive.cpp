#include "youbot_base_sim/drive/wheel_drive.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

WheelDrive::WheelDrive(double control_period, const MotorLimits& limits, const VelocityGains& gains)
    : control_period_(control_period), limits_(limits), gains_(gains) {
  reset();
}

bool WheelDrive::command_torque(int i, double torque) {
  mode_[i] = Mode::kTorque;
  setpoint_[i] = std::max(-limits_.torque, std::min(torque, limits_.torque));
  integral_[i] = 0;
  return setpoint_[i] == torque;
}

bool WheelDrive::command_velocity(int i, double rate) {
  if (mode_[i] != Mode::kVelocity) integral_[i] = 0;
  mode_[i] = Mode::kVelocity;
  setpoint_[i] = std::max(-limits_.rate, std::min(rate, limits_.rate));
  return setpoint_[i] == rate;
}

void WheelDrive::release(int i) {
  mode_[i] = Mode::kReleased;
  setpoint_[i] = integral_[i] = 0;
}

Wheels WheelDrive::sample(const Wheels& dphi) {
  Wheels torque = setpoint_;
  for (int i = 0; i < kWheels; ++i) {
    if (mode_[i] != Mode::kVelocity) continue;
    const double error = setpoint_[i] - dphi[i];
    const double integral = integral_[i] + gains_.integral * control_period_ * error;
    const double wanted = gains_.proportional * error + integral;
    torque[i] = std::max(-limits_.torque, std::min(wanted, limits_.torque));
    // No wind-up: at the limit the integral moves only back from it.
    if (torque[i] == wanted || error * wanted < 0) integral_[i] = integral;
  }
  return torque;
}

void WheelDrive::reset() {
  for (int i = 0; i < kWheels; ++i) release(i);
}

}  // namespace youbot_base_sim
