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
  const double max = set_point.mode == DriveMode::kTorque ? max_torque() : max_rate();
  set_point.value = std::clamp(set_point.value, -max, max);
  return set_point;
}

bool Motor::can(const SetPoint& set_point) const { return limited(set_point).value == set_point.value; }

SetPoint Motor::transmitted(SetPoint set_point) const {
  // A torque that is a whole number of mA but for rounding must not lose one by truncation.
  constexpr double kRounding = 1e-9;
  if (set_point.mode == DriveMode::kTorque) {
    const double milliamperes = set_point.value / milliampere();
    set_point.value = std::trunc(milliamperes + std::copysign(kRounding, milliamperes)) * milliampere();
  } else if (set_point.mode == DriveMode::kVelocity) {
    set_point.value = std::round(set_point.value / rpm()) * rpm();
  }
  return set_point;
}

}  // namespace youbot_base_sim
