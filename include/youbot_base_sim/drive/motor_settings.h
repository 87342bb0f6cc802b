#pragma once

#include <optional>

#include "youbot_base_sim/drive/faults.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/drive/wheel_drive.h"
#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// Settings of the motors: a scene's section `motors`, and the parameters of base_node with the same names.
struct MotorSettings {
  VelocityGains gains;
  std::optional<double> max_wheel_torque;  ///< N m; empty: what the motor's current limit allows
  std::optional<double> max_wheel_rate;    ///< rad/s, of set points; empty: the motor's speed limit
  double command_delay = 0;                ///< from a command's arrival to its effect, s
  /// Whether set points and readings are whole rpm, mA and encoder ticks, as EtherCAT carries them; otherwise they are
  /// exact. Empty: so by BaseDriver, exact offline.
  std::optional<bool> quantized;

  /// The motor with these limits.
  Motor limit(Motor motor) const {
    if (max_wheel_torque) motor.max_current = *max_wheel_torque / motor.torque(1);
    if (max_wheel_rate) motor.max_speed = *max_wheel_rate / motor.rpm();
    return motor;
  }
};

/// Names, ranges and units of the settings: calls `read(name, setting, range)` for each number and `read(name,
/// setting)` for what is on or off.
template <class Read>
void visit_settings(MotorSettings& motors, Read&& read) {
  read("velocity_proportional_gain", motors.gains.proportional, Range{0, 1e3, "N m s/rad"});
  read("velocity_integral_gain", motors.gains.integral, Range{0, 1e6, "N m/rad"});
  read("max_wheel_torque", motors.max_wheel_torque, Range{0, 1e6, "N m"});
  read("max_wheel_rate", motors.max_wheel_rate, Range{0, 1e6, "rad/s"});
  read("command_delay", motors.command_delay, Range{0, kMaxCommandDelay, "s"});
  read("quantized", motors.quantized);
}

}  // namespace youbot_base_sim
