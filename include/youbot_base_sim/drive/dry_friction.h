#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Dry friction of motors and gears, which the paper's model leaves out: up to `limit` against the turning of a wheel,
/// and what it takes to hold one that stands. Records of real bases suggest 0.3 to 1.7 N m.
///
/// Sampled once a control period like the motors, as a brake to standstill: the torque that would stop a wheel of
/// `wheel_inertia` (kg m^2) within the period is added to what has held it so far, and limited. Of a wheel that carries
/// more, or meets a load, what is left of its rate then dies out in a few periods and no creep remains.
class DryFriction {
 public:
  DryFriction(double limit, double wheel_inertia, double control_period)
      : limit_(limit), gain_(wheel_inertia / control_period) {}

  /// Torque on the wheels for the control period that begins with rates `dphi` (rad/s) and for which the motors exert
  /// `motor` (N m): N m, at most `limit`.
  Wheels sample(const Wheels& dphi, const Wheels& motor) {
    if (limit_ == 0) return Wheels::Zero();
    // Sum of motor and friction that the last period had, corrected by what the wheel's rate tells about it.
    const Wheels held = total_ - gain_ * (2 * dphi - dphi_);
    const Wheels torque = (held - motor).min(limit_).max(-limit_);
    dphi_ = dphi;
    total_ = motor + torque;
    return torque;
  }

 private:
  double limit_;
  double gain_;  // N m s/rad
  Wheels dphi_ = Wheels::Zero();
  Wheels total_ = Wheels::Zero();
};

}  // namespace youbot_base_sim
