#pragma once

#include <Eigen/Dense>
#include <array>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/damping_matrix.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/reaction_record.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Forces of each contact for a normal reaction N: `intercept` + `slope` N. A wheel on one roller has no intercept;
/// one that rests on two shares N between them so that the wheel stands still.
struct ForcePerNormalLoad {
  struct Terms {
    Wheels F_X, F_Y;  ///< friction, N
    Wheels M_Z;       ///< its moment about O, spin friction included, N m
    Wheels T_S;       ///< torque of the spin friction on the roller, N m
    Wheels D;         ///< moment of the normal forces about the wheel's centre line, N Delta_Y, N m
  };
  Terms slope;
  Terms intercept;      ///< set if `shares`
  bool shares = false;  ///< true if some wheel rests on two rollers
};

/// The change that normal reactions make which follow the motion, in the derivative of the forces by the velocities:
/// they add
///   sum_m forces[m] balance[m]'
/// to minus the damping matrix, which holds for reactions that stay. Each term belongs to a condition on the reactions:
/// the balances of moments about OY, about OX and of the rocking axle, which is zero where none rocks.
struct ReactionCoupling {
  std::array<Velocities, 3> balance;  ///< what unit velocities add to the moment, N m
  std::array<Wheels, 3> N;            ///< what a unit of that adds to the reactions, 1/m
  std::array<Velocities, 3> forces;   ///< what it adds to the forces, through friction
};

/// Normal reactions of the floor while the base moves: vertical forces and moments about both horizontal axes balance
/// at every instant, without heave, pitch or roll, and a fourth condition says how four wheels share what three would
/// carry. A rocking axle carries no moment about OX but that of its own friction: the base stands on its pivot and two
/// wheels, and tips where one of these lifts. The reactions depend on friction, which depends on them: both are linear,
/// and solved for together.
class Reactions {
 public:
  /// `robot` is the loaded one; `friction_arm` is that of friction on a wheel, m: 0 where wheels are prescribed.
  Reactions(const RobotParameters& robot, const Inertia& inertia, double normal_gravity, double friction_arm);

  /// The other quantities of the motion, all given.
  struct Motion {
    Wheels v;                ///< (V_X, V_Y, Omega, 0), m/s and rad/s
    Wheels dphi;             ///< rates of the wheels, rad/s
    double sum_tau;          ///< of the wheels' torques less their bearings', N m
    Wheels platform_forces;  ///< on (V_X, V_Y, Omega) besides friction: Coriolis and external, N and N m
    ExternalForce external;
  };

  struct Solution {
    Wheels N;                         ///< N, never negative
    std::array<Wheels, 3> by_moment;  ///< what a moment more in each of the conditions adds to N, 1/m
    Side tipping = Side::kNone;       ///< the side that bears all, at the tipping limit
  };
  /// A wheel that would be pulled down leaves the floor: its N is 0 in place of the fourth condition; where an axle
  /// rocks, in place of the balance about OX, at the tipping limit.
  Solution solve(const ForcePerNormalLoad& contact, const Motion& motion) const {
    const double weight = m_s_ * g_n_ + motion.external.down;
    const Conditions all = conditions(contact, motion);
    const Solution solution = share(all, weight);
    return weight > 0 && (solution.N >= 0).all() ? solution : lift(all, weight, solution.N);
  }

  /// Sets `balance` and `N`, where the damping matrix is G and the reactions answer by `by_moment`. Coriolis forces
  /// and gyroscopic moments, which are not stiff, stay out.
  void couple(const DampingMatrix& G, const std::array<Wheels, 3>& by_moment, ReactionCoupling& coupling) const;

 private:
  /// Conditions on N besides its sum, the weight: rows[k] N = right[k]. Moments about OY balance, those about OX, and
  /// the third says how four wheels share.
  struct Conditions {
    std::array<Wheels, 3> rows;
    Wheels right;
  };
  // Accelerations are dv = M_v^-1 (platform_forces + friction), with friction = constant + slope N.
  Conditions conditions(const ForcePerNormalLoad& contact, const Motion& motion) const {
    const ForcePerNormalLoad::Terms& slope = contact.slope;
    const ExternalForce& e = motion.external;
    const double V_X = motion.v[0], V_Y = motion.v[1], Omega = motion.v[2], m_a_Z = m_ * a_Z_;
    Wheels forces = motion.platform_forces;
    // Moments about OX of what each wheel has for no normal reaction, and for a newton
    Wheels held = J_1_ * Omega * motion.dphi;
    const Wheels arm = rho_Y_ + slope.D + R_ * slope.F_Y;
    if (contact.shares) {
      forces += sums(contact.intercept.F_X, contact.intercept.F_Y, contact.intercept.M_Z);
      held += contact.intercept.D + R_ * contact.intercept.F_Y;
    }
    const double pitch = m_ * g_n_ * a_X_ - motion.sum_tau + e.pitch + m_a_Z * (e.g_X + Omega * (V_Y + a_X_ * Omega)) -
                         by_force_X_[0] * forces[0] - by_force_X_[1] * forces[1] - by_force_X_[2] * forces[2];
    const double roll = m_ * g_n_ * a_Y_ - sum(held) + e.roll + m_a_Z * (e.g_Y - Omega * (V_X - a_Y_ * Omega)) -
                        by_force_Y_[0] * forces[0] - by_force_Y_[1] * forces[1] - by_force_Y_[2] * forces[2];
    return {{rho_X_ + pitch_by_F_X_ * slope.F_X + by_force_X_[1] * slope.F_Y + by_force_X_[2] * slope.M_Z,
             arm + by_force_Y_[0] * slope.F_X + by_force_Y_[1] * slope.F_Y + by_force_Y_[2] * slope.M_Z,
             // Moments about OX balance on a rocking axle by themselves.
             rocks_ ? Wheels(rocking_ * arm) : Wheels{1, -1, -1, 1}},
            {pitch, roll, rocks_ ? -sum(rocking_ * held) : 4 * q_, 0}};
  }

  // N = weight / 4 and three transfers of load: from rear to front, and on each axle from right to left.
  static Solution share(const Conditions& conditions, double weight) {
    const auto& rows = conditions.rows;
    const auto by_transfer = [&](const Wheels& N) { return sums(rows[0] * N, rows[1] * N, rows[2] * N); };
    const PlatformMatrix transfers =
        inverse({by_transfer({1, 1, -1, -1}), by_transfer({1, -1, 0, 0}), by_transfer({0, 0, 1, -1})});
    const Wheels right = conditions.right - 0.25 * weight * sums(rows[0], rows[1], rows[2]);
    Solution solution;
    solution.N = Wheels::Constant(0.25 * weight);
    for (int k = 0; k < 3; ++k) {
      const Wheels& t = transfers[k];
      solution.by_moment[k] = {t[0] + t[1], t[0] - t[1], t[2] - t[0], -t[0] - t[2]};
      solution.N += right[k] * solution.by_moment[k];
    }
    return solution;
  }

  // `solve` for the rare case that some wheel would be pulled down, or all of them.
  [[gnu::noinline]] Solution lift(const Conditions& conditions, double weight, const Wheels& N) const;
  // Wheel i is off the floor: its N is 0 in place of a condition, the one that is `replaced`.
  static Solution share_without(int i, std::size_t replaced, Conditions conditions, double weight);
  Solution tip_on_three_points(const Conditions& conditions, double weight, const Wheels& N) const;
  static Solution tip(const Conditions& conditions, double weight);

  double m_, m_s_, a_X_, a_Y_, a_Z_, J_1_, R_, friction_arm_, q_, g_n_;
  bool rocks_;
  Wheels rocking_;  // 1 for the wheels of the rocking axle
  // m a_Z times the acceleration of the body's centre of mass along X and Y by forces on (V_X, V_Y, Omega)
  std::array<double, 3> by_force_X_, by_force_Y_;
  double pitch_by_F_X_;  // what friction along X adds to the balance about OY, m
  alignas(kAlignment) Wheels rho_X_;
  Wheels rho_Y_;
};

}  // namespace youbot_base_sim
