#pragma once

#include <random>

#include "youbot_base_sim/drive/faults.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// What the motors tell about themselves, at the wheels, positive forward on all four.
struct MotorReadings {
  Wheels phi = Wheels::Zero();     ///< rad
  Wheels dphi = Wheels::Zero();    ///< rad/s
  Wheels torque = Wheels::Zero();  ///< of the motors, from their current, N m
};

/// The encoders and current sensors of the four motors.
class MotorSensors {
 public:
  /// With `quantized` readings, angles count in encoder ticks, rates in motor rpm and torques in mA, as what the driver
  /// gets; else they are exact. The wheels are at rest at angles phi, rad.
  MotorSensors(const Motor& motor, bool quantized, const Wheels& phi)
      : tick_(motor.tick()), rpm_(motor.rpm()), milliampere_(motor.milliampere()), quantized_(quantized), phi_(phi) {
    readings_.phi = phi;
  }

  /// Reads wheels at angles phi (rad) and rates dphi (rad/s) whose motors exert `torque`, N m. To be called once a
  /// cycle of the driver. Inline, for that may be a thousand times a second.
  const MotorReadings& read(const Wheels& phi, const Wheels& dphi, const Wheels& torque) {
    phi_ = phi;
    return readings_ = transmitted({phi - missed_, dphi, torque});
  }

  /// The same under faults, of which those of encoders count; readings of silent motors are those of before.
  const MotorReadings& read(const Wheels& phi, const Wheels& dphi, const Wheels& torque, const Faults& faults);

  /// The readings of before.
  const MotorReadings& readings() const { return readings_; }

 private:
  MotorReadings transmitted(const MotorReadings& exact) const {
    if (!quantized_) return exact;
    return {(exact.phi / tick_).round() * tick_, (exact.dphi / rpm_).round() * rpm_,
            (exact.torque / milliampere_).round() * milliampere_};
  }

  double tick_, rpm_, milliampere_;  // rad, rad/s, N m
  bool quantized_;
  MotorReadings readings_;
  Wheels phi_;                      // of the last reading, exact
  Wheels missed_ = Wheels::Zero();  // turning that encoders have missed, rad
  std::mt19937_64 random_;          // the same numbers in every run
};

}  // namespace youbot_base_sim
