#pragma once

#include <array>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The motor controllers of the four wheels, sampled once a control period. Each exerts a torque, tracks a rate with a
/// PI velocity loop, or is off, as all are at first.
///
/// The loop's integral is what holds a wheel against its friction, so it stays when the commanded rate changes,
/// even to zero: real bases that stand hold 0.11 to 0.27 N m. It starts from zero where a motor begins to track rates,
/// after torques or after it was off. It cannot wind up: while the torque is at its limit, the integral only moves away
/// from that (conditional integration).
class WheelDrive {
 public:
  /// `control_period` in s. With `quantized` set points are those that EtherCAT can carry, otherwise exact.
  explicit WheelDrive(double control_period, const Motor& motor = {}, const VelocityGains& gains = {},
                      bool quantized = false);

  /// Gives wheel i a new set point, clamped to its motor's limits.
  void command(int i, const SetPoint& set_point);

  /// Motor torque at each wheel, N m, for the control period that begins with wheel rates `dphi` (rad/s).
  Wheels sample(const Wheels& dphi);

  const std::array<SetPoint, kWheels>& set_points() const { return set_points_; }

 private:
  double control_period_;
  Motor motor_;
  VelocityGains gains_;
  bool quantized_;
  std::array<SetPoint, kWheels> set_points_;
  Wheels integral_ = Wheels::Zero();  // N m
};

}  // namespace youbot_base_sim
