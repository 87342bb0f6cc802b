#pragma once

#include <array>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// PI gains of the wheels' velocity loop. The motor controllers' own gains (P 600, I 200) have undocumented units.
/// Those here place the poles of a wheel that carries a quarter of the robot (J_1 + m_s R^2 / 4 = 0.028 kg m^2) at 27
/// rad/s with a damping ratio of 0.74.
struct VelocityGains {
  double proportional = 1.0;  ///< N m s/rad
  double integral = 20.0;     ///< N m/rad
};

/// The motor controllers of the four wheels, sampled once a control period. Each exerts a torque, tracks a rate with a
/// PI velocity loop, or is off, as all are at first.
class WheelDrive {
 public:
  /// `control_period` in s.
  explicit WheelDrive(double control_period, const Motor& motor = {}, const VelocityGains& gains = {});

  /// Gives wheel i a new set point, clamped to its motor's limits.
  void command(int i, const SetPoint& set_point);

  /// Motor torque at each wheel, N m, for the control period that begins with wheel rates `dphi` (rad/s).
  Wheels sample(const Wheels& dphi);

  const std::array<SetPoint, kWheels>& set_points() const { return set_points_; }

 private:
  double control_period_;
  Motor motor_;
  VelocityGains gains_;
  std::array<SetPoint, kWheels> set_points_;
  Wheels integral_ = Wheels::Zero();  // N m
};

}  // namespace youbot_base_sim
