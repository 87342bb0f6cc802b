#pragma once

#include <array>
#include <cmath>
#include <optional>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"
#include "youbot_base_sim/text/number.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Control mode of a motor.
enum class DriveMode {
  kOff,      ///< no current: the wheel rotates freely
  kTorque,   ///< the motor exerts a torque
  kVelocity  ///< a velocity loop tracks a rate
};

/// A mode in words, and the unit of its set points: "torque", "N m".
struct DriveModeText {
  const char *name, *unit;
};
DriveModeText text_of(DriveMode mode);

/// Set point of one wheel: `value` is a torque at the wheel, N m, or a rate of the wheel, rad/s.
struct SetPoint {
  DriveMode mode = DriveMode::kOff;
  double value = 0;
};

/// Motor and gear of one wheel of the youBot base. The first three numbers come from the driver's configuration file,
/// youbot-base.cfg, the limits from the motor controllers' (firmware 2.00: base.cfg, base-protected.cfg).
struct Motor {
  double gear_ratio = 364.0 / 9405;  ///< rotations of the wheel per rotation of the motor
  double encoder_ticks = 4000;       ///< per rotation of the motor
  double torque_constant = 0.0335;   ///< N m/A
  double max_current = 3.564;        ///< limit of the current, A
  double max_speed = 4000;           ///< limit of the motor's speed, rpm

  /// At the wheel, N m, for a current in A.
  double torque(double current) const { return current * torque_constant / gear_ratio; }
  double max_torque() const { return torque(max_current); }              ///< 3.085 N m
  double max_rate() const { return rpm() * max_speed; }                  ///< 16.21 rad/s
  double tick() const { return 2 * M_PI * gear_ratio / encoder_ticks; }  ///< 6.08e-5 rad of the wheel
  double rpm() const { return 2 * M_PI * gear_ratio / 60; }              ///< 4.05e-3 rad/s of the wheel
  double milliampere() const { return torque(1e-3); }                    ///< 8.66e-4 N m at the wheel

  /// True if the set point is within the motor's limits.
  bool can(const SetPoint& set_point) const;

  /// The set point, clamped to the motor's limits.
  SetPoint limited(SetPoint set_point) const;

  /// The set point as EtherCAT carries it: whole mA, truncated, or rpm of the motor, rounded (YouBotJoint.cpp).
  SetPoint transmitted(SetPoint set_point) const;
};

/// PI gains of the wheels' velocity loop. The motor controllers' own gains (P 600, I 200) have undocumented units;
/// those here were fitted to records of two real bases (docs/drop_in.md).
struct VelocityGains {
  double proportional = 0.4;  ///< N m s/rad
  double integral = 1.2;      ///< N m/rad

  /// The control period (s) from which on the loop of a free wheel without friction, of this inertia (kg m^2), is
  /// unstable: its fastest pole is -1 where 2 P T + I T^2 = 4 J_1.
  double unstable_period(double wheel_inertia) const;
};

constexpr double kMaxCommandDelay = 60;  ///< s

/// Settings of the motors: a scene's section `motors`, and the parameters of base_node with the same names.
struct MotorSettings {
  VelocityGains gains;
  std::optional<double> max_wheel_torque;  ///< N m; empty: what the motor's current limit allows
  std::optional<double> max_wheel_rate;    ///< rad/s, of set points; empty: the motor's speed limit
  double command_delay = 0;                ///< from a command's arrival to its effect, s
  /// True if set points and readings are whole rpm, mA and encoder ticks. Empty: with BaseDriver, but not offline.
  std::optional<bool> quantized;
  std::optional<bool> scene_kinematics;  ///< true if the driver computes with the scene's robot; empty: the youBot's

  /// The motor with these limits.
  Motor limit(Motor motor) const {
    if (max_wheel_torque) motor.max_current = *max_wheel_torque / motor.torque(1);
    if (max_wheel_rate) motor.max_speed = *max_wheel_rate / motor.rpm();
    return motor;
  }
};

/// Calls `read(name, setting, range)` for each setting that is a number, and `read(name, setting)` for a switch.
template <class Read>
void visit_settings(MotorSettings& motors, Read&& read) {
  read("velocity_proportional_gain", motors.gains.proportional, Range{0, 1e3, "N m s/rad"});
  read("velocity_integral_gain", motors.gains.integral, Range{0, 1e6, "N m/rad"});
  read("max_wheel_torque", motors.max_wheel_torque, Range{0, 1e6, "N m"});
  read("max_wheel_rate", motors.max_wheel_rate, Range{0, 1e6, "rad/s"});
  read("command_delay", motors.command_delay, Range{0, kMaxCommandDelay, "s"});
  read("quantized", motors.quantized);
  read("scene_kinematics", motors.scene_kinematics);
}

/// The controllers of the four wheels, sampled once a control period: off (at first), a torque, or a PI velocity loop.
///
/// The loop's integral holds a wheel against its friction. It stays when the commanded rate changes, even to zero: real
/// bases that stand hold 0.11 to 0.27 N m. It starts from zero where a motor begins to track rates. While the torque is
/// at its limit, it only moves away from that (conditional integration).
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
  double tracking_torque(int i, double error);

  double control_period_;
  Motor motor_;
  VelocityGains gains_;
  bool quantized_;
  std::array<SetPoint, kWheels> set_points_;
  Wheels integral_ = Wheels::Zero();  // N m
};

}  // namespace youbot_base_sim
