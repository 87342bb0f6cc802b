#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Limits of the youBot base's motors, at the wheel; the driver's configuration, base.cfg and base-protected.cfg.
struct MotorLimits {
  double torque = 3.085;  ///< 3.564 A at 0.0335 N m/A and a gear of 25.84, N m
  double rate = 16.2118;  ///< 4000 motor rpm, rad/s
};

/// PI gains of the wheels' velocity loop. The driver's own (P 600, I 200) are in units of the firmware that are not
/// documented; these place the poles of a wheel that carries its quarter of the robot (J_1 + m_s R^2 / 4 =
/// 0.028 kg m^2) at 27 rad/s with a damping of 0.74.
struct VelocityGains {
  double proportional = 1.0;  ///< N m s/rad
  double integral = 20.0;     ///< N m/rad
};

/// The drives of the four wheels, each driven by torque, by velocity or not at all, sampled once a control period.
class WheelDrive {
 public:
  explicit WheelDrive(double control_period, const MotorLimits& limits = {}, const VelocityGains& gains = {});

  /// Exerts `torque` (N m) on wheel i, within the motor's limit. True if it was within.
  bool command_torque(int i, double torque);

  /// Has wheel i keep `rate` (rad/s), within the motor's limit. True if it was within.
  bool command_velocity(int i, double rate);

  /// Lets wheel i roll freely: no torque, as the driver's switchOffMotors.
  void release(int i);

  /// Torque of the wheels for the control period that begins with rates `dphi` (rad/s), N m.
  Wheels sample(const Wheels& dphi);

  /// Back to four released wheels.
  void reset();

 private:
  enum class Mode { kReleased, kTorque, kVelocity };

  double control_period_;
  MotorLimits limits_;
  VelocityGains gains_;
  std::array<Mode, kWheels> mode_;
  Wheels setpoint_ = Wheels::Zero();
  Wheels integral_ = Wheels::Zero();  // N m
};

}  // namespace youbot_base_sim
