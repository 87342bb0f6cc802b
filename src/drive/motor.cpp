#include "youbot_base_sim/drive/motor.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

constexpr double kTurn = 2 * M_PI;  // rad

}  // namespace

double Motor::tick() const { return kTurn * gear_ratio / encoder_ticks; }

double Motor::rpm() const { return kTurn * gear_ratio / 60; }

SetPoint Motor::limited(SetPoint set_point) const {
  const double most = set_point.mode == DriveMode::kTorque ? most_torque() : most_rate();
  set_point.value = std::max(-most, std::min(set_point.value, most));
  return set_point;
}

bool Motor::can(const SetPoint& set_point) const { return limited(set_point).value == set_point.value; }

SetPoint Motor::transmitted(SetPoint set_point) const {
  // A torque that is a whole number of mA must not lose one to rounding.
  constexpr double kWhole = 1e-9;
  if (set_point.mode == DriveMode::kTorque) {
    const double milliamperes = set_point.value / milliampere();
    set_point.value = std::trunc(milliamperes + std::copysign(kWhole, milliamperes)) * milliampere();
  } else if (set_point.mode == DriveMode::kVelocity) {
    set_point.value = std::round(set_point.value / rpm()) * rpm();
  }
  return set_point;
}

}  // namespace youbot_base_sim
