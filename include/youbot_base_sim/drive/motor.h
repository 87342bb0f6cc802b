#pragma once

namespace youbot_base_sim {

/// What a motor is told to do.
enum class DriveMode {
  kOff,      ///< no current: the wheel turns freely
  kTorque,   ///< exerts a torque
  kVelocity  ///< keeps a rate
};

/// Of one wheel: `value` is a torque at the wheel, N m, or a rate of the wheel, rad/s.
struct SetPoint {
  DriveMode mode = DriveMode::kOff;
  double value = 0;
};

/// Motor and gear of a wheel of the youBot base. The first three numbers are those of the driver's configuration,
/// youbot-base.cfg; the limits are those of the motor controllers' (firmware 2.00: base.cfg, base-protected.cfg).
struct Motor {
  double gear_ratio = 364.0 / 9405;  ///< turns of the wheel in a turn of the motor
  double encoder_ticks = 4000;       ///< in a turn of the motor
  double torque_constant = 0.0335;   ///< N m/A
  double most_current = 3.564;       ///< A
  double most_speed = 4000;          ///< of the motor, rpm

  double torque(double current) const { return current * torque_constant / gear_ratio; }  ///< at the wheel, N m, of A
  double most_torque() const { return torque(most_current); }                             ///< 3.085 N m
  double most_rate() const { return rpm() * most_speed; }                                 ///< 16.21 rad/s
  double tick() const;                                                                    ///< 6.08e-5 rad of the wheel
  double rpm() const;                                  ///< 4.05e-3 rad/s of the wheel
  double milliampere() const { return torque(1e-3); }  ///< 8.66e-4 N m at the wheel

  /// Whether the motor can do this.
  bool can(const SetPoint& set_point) const;

  /// The nearest that the motor can do.
  SetPoint limited(SetPoint set_point) const;

  /// As it arrives over EtherCAT, where current counts in mA, cut, and speed in motor rpm, rounded (the driver's
  /// YouBotJoint.cpp).
  SetPoint transmitted(SetPoint set_point) const;
};

}  // namespace youbot_base_sim
