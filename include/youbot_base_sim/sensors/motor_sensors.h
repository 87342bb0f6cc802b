#pragma once

#include <random>

#include "youbot_base_sim/drive/faults.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Readings of the four motors, converted to the wheels; positive drives forward on all four.
struct MotorReadings {
  Wheels phi = Wheels::Zero();     ///< rad
  Wheels dphi = Wheels::Zero();    ///< rad/s
  Wheels torque = Wheels::Zero();  ///< measured by the motors' current, N m
};

/// The encoders and current sensors of the four motors.
class MotorSensors {
 public:
  /// The wheels stand at angles phi, rad. `quantized` readings are whole encoder ticks, rpm of the motor and mA.
  MotorSensors(const Motor& motor, bool quantized, const Wheels& phi)
      : tick_(motor.tick()), rpm_(motor.rpm()), milliampere_(motor.milliampere()), quantized_(quantized), phi_(phi) {
    readings_.phi = phi;
  }

  /// Reads wheels at angles phi (rad) and rates dphi (rad/s) whose motors exert `torque`, N m; once a driver's cycle.
  /// Motors that are silent or disconnected keep their readings.
  const MotorReadings& read(const Wheels& phi, const Wheels& dphi, const Wheels& torque, const Faults& faults = {});

  /// The wheels were set from `before` to `after` (rad), which no encoder misses. Returns the readings' change, rad.
  Wheels carry(const Wheels& before, const Wheels& after) {
    const Wheels change = transmitted({after - missed_}).phi - transmitted({before - missed_}).phi;
    phi_ += after - before;
    readings_.phi += change;
    return change;
  }

  /// The last readings.
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
  Wheels phi_;                      // exact angles at the last reading, rad
  Wheels missed_ = Wheels::Zero();  // angle that the encoders have missed so far, rad
  std::mt19937_64 random_;          // has a fixed seed, so that every run draws the same noise
};

}  // namespace youbot_base_sim
