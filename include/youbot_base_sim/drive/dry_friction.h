#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Dry friction of motors and gears, which the paper's model leaves out. It brakes a turning wheel by up to `limit`,
/// N m, and holds a standing one against as much. Records of two real bases suggest 0.14 and 0.24 N m.
///
/// Sampled once a control period (s), like the motors. Each sample adds the torque that would stop a wheel of inertia
/// `wheel_inertia` (kg m^2) within the period to the torque that held the wheel so far, and limits the sum. A wheel
/// that carries more inertia or meets a load loses the rest of its rate within a few periods, and no creep remains.
class DryFriction {
 public:
  DryFriction(double limit, double wheel_inertia, double control_period)
      : limit_(limit), gain_(wheel_inertia / control_period) {}

  /// Friction torque on each wheel, N m, for the control period that begins with wheel rates `dphi` (rad/s) and during
  /// which the motors exert `motor` (N m).
  Wheels sample(const Wheels& dphi, const Wheels& motor) {
    if (limit_ == 0) return Wheels::Zero();
    // The motor and friction torque of the last period, corrected by what the wheel's rate has shown to be missing.
    const Wheels held = total_ - gain_ * (2 * dphi - dphi_);
    const Wheels torque = (held - motor).min(limit_).max(-limit_);
    dphi_ = dphi;
    total_ = motor + torque;
    return torque;
  }

 private:
  double limit_;
  double gain_;                    // N m s/rad
  Wheels dphi_ = Wheels::Zero();   // at the last sample, rad/s
  Wheels total_ = Wheels::Zero();  // motor and friction since then, N m
};

}  // namespace youbot_base_sim
