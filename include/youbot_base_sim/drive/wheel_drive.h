#pragma once

#include <array>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// PI gains of the wheels' velocity loop. The controllers' own (P 600, I 200) are in units of the firmware that are not
/// documented; these place the poles of a wheel that carries its quarter of the robot (J_1 + m_s R^2 / 4 =
/// 0.028 kg m^2) at 27 rad/s with a damping of 0.74.
struct VelocityGains {
  double proportional = 1.0;  ///< N m s/rad
  double integral = 20.0;     ///< N m/rad
};

/// The motor controllers of the four wheels: each exerts a torque, keeps a rate, or is off; sampled once a control
/// period.
class WheelDrive {
 public:
  explicit WheelDrive(double control_period, const Motor& motor = {}, const VelocityGains& gains = {});

  /// Has wheel i do this, or the nearest that its motor can do.
  void command(int i, const SetPoint& set_point);

  /// Torque of the motors at the wheels for the control period that begins with rates `dphi` (rad/s), N m.
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
