#pragma once

#include "youbot_base_sim/export.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Control mode of a motor.
enum class DriveMode {
  kOff,      ///< no current: the wheel turns freely
  kTorque,   ///< the motor exerts a torque
  kVelocity  ///< a velocity loop tracks a rate
};

/// Set point of one wheel: `value` is a torque at the wheel, N m, or a rate of the wheel, rad/s.
struct SetPoint {
  DriveMode mode = DriveMode::kOff;
  double value = 0;
};

/// Motor and gear of one wheel of the youBot base. The first three numbers come from the driver's configuration file,
/// youbot-base.cfg, the limits from the motor controllers' (firmware 2.00: base.cfg, base-protected.cfg).
struct Motor {
  double gear_ratio = 364.0 / 9405;  ///< turns of the wheel per turn of the motor
  double encoder_ticks = 4000;       ///< per turn of the motor
  double torque_constant = 0.0335;   ///< N m/A
  double max_current = 3.564;        ///< limit of the current, A
  double max_speed = 4000;           ///< limit of the motor's speed, rpm

  double torque(double current) const {
    return current * torque_constant / gear_ratio;
  }                                                          ///< at the wheel, N m, for a current in A
  double max_torque() const { return torque(max_current); }  ///< 3.085 N m
  double max_rate() const { return rpm() * max_speed; }      ///< 16.21 rad/s
  double tick() const;                                       ///< 6.08e-5 rad of the wheel
  double rpm() const;                                        ///< 4.05e-3 rad/s of the wheel
  double milliampere() const { return torque(1e-3); }        ///< 8.66e-4 N m at the wheel

  /// Whether the set point is within the motor's limits.
  bool can(const SetPoint& set_point) const;

  /// The set point, clamped to the motor's limits.
  SetPoint limited(SetPoint set_point) const;

  /// The set point as EtherCAT carries it: current truncated to whole mA, speed rounded to whole rpm of the motor (as
  /// in the driver's YouBotJoint.cpp).
  SetPoint transmitted(SetPoint set_point) const;
};

}  // namespace youbot_base_sim
