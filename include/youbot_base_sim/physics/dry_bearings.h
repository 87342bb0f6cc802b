#pragma once

#include <algorithm>
#include <limits>

#include "youbot_base_sim/physics/damping_matrix.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Dry friction of the drives and of the rollers' bearings, which the paper's model leaves out and which records of
/// real bases show: a torque against the rate w of -T w / sqrt(rate^2 + w^2), N m. It has a convex potential, as the
/// friction of the contacts has, so that Newton's methods and their safeguards are the same with it.
class DryBearings {
 public:
  explicit DryBearings(const RobotParameters& robot)
      : wheels_{robot.dry_friction, robot.dry_friction_rate},
        rollers_{robot.roller_dry_friction, robot.roller_dry_friction_rate},
        any_((robot.dry_friction != 0 || robot.roller_dry_friction != 0).any()) {}

  /// Whether there is any. The functions below need not be called without.
  bool any() const { return any_; }

  /// Torques against the wheels' rates dphi and the rollers' dgamma (rad/s), N m.
  Wheels wheel_torque(const Wheels& dphi) const { return wheels_.torque(dphi); }
  Wheels roller_torque(const Wheels& dgamma) const { return rollers_.torque(dgamma); }

  /// Their derivatives by the rates, N m s.
  Wheels wheel_damping(const Wheels& dphi) const { return wheels_.damping(dphi); }
  Wheels roller_damping(const Wheels& dgamma) const { return rollers_.damping(dgamma); }

  /// The share of the step from the first to the second rates in which a method of integration sees the friction turn:
  /// of rates that have friction, none may change by more than kStride times its distance from zero and the rate of
  /// smoothing. At least 1: the whole step.
  double resolved_share(const Wheels& dphi_a, const Wheels& dgamma_a, const Wheels& dphi_b,
                        const Wheels& dgamma_b) const {
    return std::min(wheels_.resolved_share(dphi_a, dphi_b), rollers_.resolved_share(dgamma_a, dgamma_b));
  }

  /// Adds the friction at the velocities u to the forces Q; its derivative to the damping matrix G.
  [[gnu::noinline, gnu::cold]] void add_to(const Velocities& u, Velocities& Q) const {
    Q.dphi -= wheel_torque(u.dphi);
    Q.dgamma -= roller_torque(u.dgamma);
  }
  [[gnu::noinline, gnu::cold]] void add_to(const Velocities& u, DampingMatrix& G) const {
    G.dphi_dphi += wheel_damping(u.dphi);
    G.dgamma_dgamma += roller_damping(u.dgamma);
  }

 private:
  static constexpr double kStride = 2;

  struct Bearings {
    Wheels limit;  // T, N m
    double rate;   // rad/s

    Wheels torque(const Wheels& w) const { return limit * w / (rate * rate + w.square()).sqrt(); }
    Wheels damping(const Wheels& w) const {
      const Wheels s = rate * rate + w.square();
      return rate * rate * limit / (s * s.sqrt());
    }
    double resolved_share(const Wheels& a, const Wheels& b) const {
      const Wheels start = a.abs() + rate;
      const Wheels leaving = kStride * start;
      const Wheels approaching = (leaving / (1 + kStride)).max(kStride * rate);  // it may pass zero
      const Wheels allowed = (a * (b - a) > 0).select(leaving, approaching);
      return (limit > 0).select(allowed / (b - a).abs(), std::numeric_limits<double>::infinity()).minCoeff();
    }
  };

  Bearings wheels_, rollers_;
  bool any_;
};

}  // namespace youbot_base_sim
