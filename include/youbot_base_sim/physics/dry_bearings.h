#pragma once

#include "youbot_base_sim/physics/damping_matrix.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Dry friction of bearings: a torque against the rate w of -T w / sqrt(rate^2 + w^2).
struct DryFriction {
  Wheels limit;  ///< T, N m
  double rate;   ///< rad/s

  /// Torque against the rate w (rad/s), N m.
  Wheels torque(const Wheels& w) const { return limit * w / (rate * rate + w.square()).sqrt(); }
  /// Its derivative by w, N m s.
  Wheels damping(const Wheels& w) const {
    const Wheels s = rate * rate + w.square();
    return rate * rate * limit / (s * s.sqrt());
  }

  /// The longest step from rates w that change by dw (rad/s^2) in which a method sees the friction reverse, s: none
  /// that has friction may approach zero by more than half its distance from there and `rate`, or by `rate` if that is
  /// more.
  double max_step(const Wheels& w, const Wheels& dw) const {
    const Wheels distance = w.abs() + rate, allowed = (w * dw > 0).select(distance, (0.5 * distance).max(rate));
    return (limit > 0).select(allowed / dw.abs(), kInfinity).minCoeff();
  }
};

/// Dry friction of the drives and of the rollers' bearings, which the paper's model leaves out and records of real
/// bases show. Like the friction of the contacts it has a convex potential, so Newton's methods work as without it.
class DryBearings {
 public:
  explicit DryBearings(const RobotParameters& robot)
      : wheels{robot.dry_friction, robot.dry_friction_rate},
        rollers{robot.roller_dry_friction, robot.roller_dry_friction_rate},
        any_((robot.dry_friction != 0 || robot.roller_dry_friction != 0).any()) {}

  /// True if there is any.
  bool any() const { return any_; }

  /// Adds the friction at the velocities u to the forces Q; its derivative to the damping matrix G.
  [[gnu::noinline, gnu::cold]] void add_to(const Velocities& u, Velocities& Q) const {
    Q.dphi -= wheels.torque(u.dphi);
    Q.dgamma -= rollers.torque(u.dgamma);
  }
  [[gnu::noinline, gnu::cold]] void add_to(const Velocities& u, DampingMatrix& G) const {
    G.dphi_dphi += wheels.damping(u.dphi);
    G.dgamma_dgamma += rollers.damping(u.dgamma);
  }

  DryFriction wheels, rollers;

 private:
  bool any_;
};

}  // namespace youbot_base_sim
