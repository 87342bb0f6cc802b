#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/physics/contact_friction.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/damping_matrix.h"
#include "youbot_base_sim/physics/dry_bearings.h"
#include "youbot_base_sim/physics/extended_features.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/paper_features.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// The velocities that each bring about the model's regularization speed, m/s and rad/s.
template <class Model>
Velocities regularization_velocities(const Model& model) {
  const double speed = model.regularization_speed(), R = model.robot().R, R_d = model.robot().R_d;
  return {Wheels::Constant(speed), Wheels::Constant(speed / R), Wheels::Constant(speed / (R - R_d))};
}

/// Models 2a and 2b: the equations of motion (4.9) for one choice of the rollers in contact, for which they are smooth.
/// The wheel angle enters as `phi_tilde` (rad): 0 where the roller points straight down.
///
/// A contact is evaluated in two steps: `evaluate_kinematics` computes slip and coefficient of friction, and
/// `apply_normal_force` the friction under given normal reactions. `Law` is the friction law, `Features` the physics
/// beyond the paper: PaperFeatures or ExtendedFeatures. The inner loops branch on neither.
template <class Law, class Policy>
class SlipModel {
  static constexpr int D = Policy::kSlipComponents;

 public:
  using Features = Policy;
  using Contacts = typename Features::Contacts;
  using Friction = typename Features::Friction;  ///< at the contacts, an unknown of Newton's iterations
  using Force = ContactVector<D>;
  using Stiffness = ContactStiffness<D>;

  /// True if the normal reaction limits friction.
  static constexpr bool kLimited = Law::kLimited;

  /// True if normal reactions may follow the motion.
  static constexpr bool kReactionsFollow = Features::kReactionsFollow;

  /// Entries of the contacts that become weighted means where two rollers share a wheel.
  static constexpr const auto& kMeans = Features::kMeans;

  /// `robot` is the bare one, whose mass decides mu_0. `wheels_prescribed`: see TorqueProfile.
  SlipModel(const RobotParameters& robot, const FloorParameters& floor, const AppliedLoads& applied = {},
            bool wheels_prescribed = false)
      : bare_robot_(robot),
        floor_(floor),
        robot_(loaded(robot, applied.loads)),
        geometry_(robot),
        friction_(Law(robot, floor), floor.nu),
        inertia_(robot_),
        dry_(robot),
        friction_arm_(wheels_prescribed ? 0 : robot.R),
        features_(robot_, floor, inertia_, applied, friction_arm_),
        rho_X_(robot.rho_X()),
        rho_Y_(robot.rho_Y()) {}

  /// Replaces the loads and wrenches. Friction is regularized as at first.
  void set_loads(const AppliedLoads& applied) { *this = SlipModel(bare_robot_, floor_, applied, wheels_prescribed()); }

  /// Slip and position of the contact points at the velocities u and this pose; no friction yet.
  void evaluate_kinematics(const Velocities& u, const ContactGeometry& g, const Pose& pose, Contacts& c) const {
    c.Delta_Y = g.Delta_Y;
    c.r_X = g.r_X;
    c.r_Y = g.r_Y;
    // (3.3) in its compact form
    c.V_PX = u.v[0] - (rho_Y_ + c.Delta_Y) * u.v[2] - robot_.R * u.dphi - c.r_X * u.dgamma;
    c.V_PY = u.v[1] + rho_X_ * u.v[2] + c.r_Y * u.dgamma;
    features_.evaluate_kinematics(u, g, pose, c);
  }

  /// Friction under the normal reactions N (N), which the paper's features take to be those at rest.
  void apply_normal_force(const Wheels& N, Contacts& c) const {
    features_.set_reactions(N, c);
    set_friction(friction_.force(features_.slip(c), features_.limit(c)), c);
  }
  /// Friction under the normal reactions of the base at rest.
  void apply_static_normal_force(Contacts& c) const { apply_normal_force(features_.static_reactions(), c); }
  /// Friction under those reactions; sets K to the `stiffness` for the friction F.
  void apply_static_normal_force(const Friction& F, Contacts& c, Stiffness& K) const {
    features_.set_reactions(features_.static_reactions(), c);
    const Force V = features_.slip(c);
    const SlipResistance resistance = friction_.resistance(V, features_.limit(c));
    set_friction(friction_.force(V, resistance), c);
    K = friction_.stiffness(V, Features::force(F), resistance);
  }
  void apply_normal_force_of(const Contacts& other, Contacts& c) const {
    apply_normal_force(features_.reactions(other), c);
    features_.keep_tipping(other, c);
  }

  /// Right-hand sides of (4.9) with dry friction: forces under the wheel torques `M` (N m), N and N m.
  Velocities forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    Velocities Q = viscous_forces(u, c, M);
    if (dry_.any()) dry_.add_to(u, Q);
    return Q;
  }
  /// Forces at three stages at once. Rare cases stay out of the loop.
  void forces(const std::array<Velocities, 3>& u, const std::array<Contacts, 3>& c, const std::array<Wheels, 3>& M,
              std::array<Velocities, 3>& Q) const {
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) Q[j] = viscous_forces(u[j], c[j], M[j]);
    if (!dry_.any()) return;
    for (int j = 0; j < 3; ++j) dry_.add_to(u[j], Q[j]);
  }

  /// Time derivative of `state`, whose contacts are `c`, under the wheel torques `M` (N m).
  void derivative(const State& state, const Contacts& c, const Wheels& M, State& derivative) const {
    const Velocities u = state.velocities(), Q = forces(u, c, M);
    const auto [sin_psi, cos_psi] = sine_and_cosine(state.psi());
    derivative.x() = u.v[0] * cos_psi - u.v[1] * sin_psi;
    derivative.y() = u.v[0] * sin_psi + u.v[1] * cos_psi;
    derivative.psi() = u.v[2];
    derivative.work() = dot(u, Q);
    const Eigen::Vector3d dv = product(inertia_.M_v_inverse, Eigen::Vector3d{Q.v[0], Q.v[1], Q.v[2]});
    derivative.values.col(1) << dv[0], dv[1], dv[2], 0;
    derivative.phi() = u.dphi;
    derivative.dphi() = Q.dphi * (1 / inertia_.J_1);
    derivative.dgamma() = Q.dgamma * (1 / inertia_.J_2);
    derivative.gamma() = u.dgamma;
  }

  /// Sets G to minus the derivative of `forces` by the velocities u, Coriolis forces excluded, where the contacts are
  /// `c` and normal reactions stay.
  void damping(const Velocities& u, const Contacts& c, DampingMatrix& G) const {
    damping(u, c, friction_.stiffness(features_.slip(c), features_.limit(c)), G);
  }

  /// Stiffness of the contacts `c` where their friction is taken to be F, which need not be that of c's slip: see
  /// ContactFriction.
  Stiffness stiffness(const Contacts& c, const Friction& F) const {
    const Force V = features_.slip(c);
    return friction_.stiffness(V, Features::force(F), friction_.resistance(V, features_.limit(F, c)));
  }

  /// Sets G where the contacts have the stiffness K: J' K J, where the rows of J are the derivatives of the
  /// slip by V_X, V_Y, Omega, dphi, dgamma (3.3).
  void damping(const Velocities& u, const Contacts& c, const Stiffness& K, DampingMatrix& G) const {
    const double R = robot_.R, arm = friction_arm_;
    // Columns of K J; those by V_X and V_Y are the first two of K.
    const Force X = K.row(0), Y = K.row(1);
    Force by_Omega, by_dgamma;
    for (int k = 0; k < D; ++k) {
      by_Omega[k] = moment(K.row(k), c);
      by_dgamma[k] = torque(K.row(k), c);
    }
    const auto set_platform = [&](std::size_t k, const Force& column) {
      G.platform_platform[0][k] = column[0];
      G.platform_platform[1][k] = column[1];
      G.platform_platform[2][k] = moment(column, c);
      G.platform_dphi[k] = -R * column[0];
      G.dphi_platform[k] = -arm * column[0];
      G.dgamma_platform[k] = G.platform_dgamma[k] = torque(column, c);
    };
    set_platform(0, X);
    set_platform(1, Y);
    set_platform(2, by_Omega);
    G.dphi_dphi = robot_.mu_1 + R * arm * K(0, 0);
    G.dphi_dgamma = -arm * by_dgamma[0];
    G.dgamma_dphi = -R * by_dgamma[0];
    G.dgamma_dgamma = robot_.mu_2 + c.r_Y * by_dgamma[1] - c.r_X * by_dgamma[0];
    if constexpr (kSpins) G.dgamma_dgamma += features_.spin_radius() * c.spin * by_dgamma[2];
    if (dry_.any()) dry_.add_to(u, G);
  }

  Friction friction(const Contacts& c) const { return features_.friction(c); }

  /// The inverse of the slip speed over which friction reverses, see SlipResistance, s/m.
  Wheels slip_scale(const Contacts& c) const {
    return friction_.resistance(features_.slip(c), features_.limit(c)).scale;
  }

  /// `force` (N) less K dV, where dV is how the slip of the contacts `c` changes with the velocities by du.
  Force changed(Force force, const Contacts& c, const Stiffness& K, const Velocities& du) const {
    Force dV;
    dV[0] = du.v[0] - (rho_Y_ + c.Delta_Y) * du.v[2] - robot_.R * du.dphi - c.r_X * du.dgamma;
    dV[1] = du.v[1] + rho_X_ * du.v[2] + c.r_Y * du.dgamma;
    if constexpr (kSpins) dV[2] = features_.spin_radius() * (du.v[2] + c.spin * du.dgamma);
    for (int k = 0; k < D; ++k) {
      for (int l = 0; l < D; ++l) force[k] -= K(k, l) * dV[l];
    }
    return force;
  }

  /// Contact quantities for output.
  ContactDetails details(const Contacts& c) const {
    ContactDetails details{c};
    features_.add_details(c, details);
    return details;
  }

  /// The torque of a contact on its roller, N m.
  Wheels roller_torque(const Contacts& c) const {
    Wheels torque = c.r_Y * c.F_Y - c.r_X * c.F_X;
    features_.add_spin_torque(c, torque);
    return torque;
  }

  // Normal reactions that follow the motion: with ExtendedFeatures only.

  /// True if the normal reactions follow the motion.
  bool dynamic() const { return Law::kLimited && features_.dynamic(); }

  /// Forces of the contacts `c`, which are those under 1 N, for each newton of normal reaction.
  ForcePerNormalLoad force_per_normal_load(const Contacts& c) const {
    ForcePerNormalLoad per_load;
    per_load.slope = {c.F_X, c.F_Y, c.M_Z, c.T_S, c.Delta_Y};
    return per_load;
  }

  /// The normal reactions in this motion under the wheel torques M, N m.
  Reactions::Solution reactions(const Velocities& u, const Wheels& M, const Contacts& placed,
                                const ForcePerNormalLoad& contact) const {
    Wheels tau = M - robot_.mu_1 * u.dphi;
    if (dry_.any()) tau -= dry_.wheels.torque(u.dphi);
    return features_.reactions().solve(
        contact, {u.v, u.dphi, sum(tau), inertia_.coriolis(u.v) + placed.external.v, placed.external});
  }

  /// Scales the friction of contacts that are pressed by 1 N to these reactions: friction is proportional to them.
  void scale_by_reactions(const Reactions::Solution& reactions, Contacts& c) const {
    for (Wheels* entry : {&c.F_X, &c.F_Y, &c.M_Z, &c.F_Z, &c.M_S, &c.T_S}) *entry *= reactions.N;
    c.N = reactions.N;
    c.N_by_moment = reactions.by_moment;
    c.tipping = reactions.tipping;
  }

  /// Sets the coupling of all velocities by dynamic reactions, where the damping matrix is G.
  void couple(const Contacts& c, const ForcePerNormalLoad& contact, const DampingMatrix& G,
              ReactionCoupling& coupling) const {
    features_.reactions().couple(G, c.N_by_moment, coupling);
    const ForcePerNormalLoad::Terms& k = contact.slope;
    const Wheels roller_torque = c.r_Y * k.F_Y - c.r_X * k.F_X + k.T_S;
    for (int m = 0; m < 3; ++m) {
      const Wheels& N = coupling.N[m];
      coupling.forces[m] = {sums(k.F_X * N, k.F_Y * N, k.M_Z * N), -friction_arm_ * k.F_X * N, roller_torque * N};
    }
  }

  /// See ContactFriction.
  double regularization_speed() const { return friction_.regularization_speed(); }
  void set_regularization_speed(double nu) { friction_.set_regularization_speed(nu); }

  /// Smooths the dry friction of the drives over this rate from now on, rad/s.
  void set_dry_friction_rate(double rate) { dry_.wheels.rate = rate; }

  double holding_speed() const { return floor_.holding_speed; }  ///< of the floor, m/s
  bool wheels_prescribed() const { return friction_arm_ == 0; }  ///< see TorqueProfile::prescribes_wheels

  const Features& features() const { return features_; }
  const ContactFriction<Law, D>& contact_friction() const { return friction_; }
  const Inertia& inertia() const { return inertia_; }
  const RollerGeometry& geometry() const { return geometry_; }
  const RobotParameters& robot() const { return robot_; }  ///< with its loads
  const DryBearings& dry_bearings() const { return dry_; }
  const Wheels& rho_X() const { return rho_X_; }  ///< wheel centres from O, m
  const Wheels& rho_Y() const { return rho_Y_; }

 private:
  // Sets the friction at the contacts to F, N.
  void set_friction(const Force& F, Contacts& c) const {
    c.F_X = F[0];
    c.F_Y = F[1];
    c.M_Z = c.F_Y * rho_X_ - c.F_X * (rho_Y_ + c.Delta_Y);
    features_.add_spin(F, c);
  }

  static constexpr bool kSpins = D == 3;

  Velocities viscous_forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    Velocities Q = {sums(c.F_X, c.F_Y, c.M_Z) + inertia_.coriolis(u.v),
                    M - robot_.mu_1 * u.dphi - friction_arm_ * c.F_X, roller_torque(c) - robot_.mu_2 * u.dgamma};
    features_.add_external(c, Q.v);
    return Q;
  }

  // The moment of a friction F about O, and its torque on the roller; for rows of K, columns of K J.
  Wheels moment(const Force& F, const Contacts& c) const {
    Wheels moment = rho_X_ * F[1] - (rho_Y_ + c.Delta_Y) * F[0];
    if constexpr (kSpins) moment += features_.spin_radius() * F[2];
    return moment;
  }
  Wheels torque(const Force& F, const Contacts& c) const {
    Wheels torque = c.r_Y * F[1] - c.r_X * F[0];
    if constexpr (kSpins) torque += features_.spin_radius() * c.spin * F[2];
    return torque;
  }

  RobotParameters bare_robot_;
  FloorParameters floor_;
  RobotParameters robot_;
  RollerGeometry geometry_;
  ContactFriction<Law, D> friction_;
  Inertia inertia_;
  DryBearings dry_;
  double friction_arm_;  // of friction on a wheel, m
  Features features_;
  alignas(kAlignment) Wheels rho_X_, rho_Y_;
};

/// The paper's model, and the one with all extensions.
template <class Law>
using PaperModel = SlipModel<Law, PaperFeatures>;
template <class Law>
using ExtendedModel = SlipModel<Law, ExtendedFeatures>;

}  // namespace youbot_base_sim
