#pragma once

#include <cmath>

#include "youbot_base_sim/physics/burden.h"
#include "youbot_base_sim/physics/floor_patches.h"
#include "youbot_base_sim/physics/reactions.h"
#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

/// Marks a friction law of the paper as used beyond the paper: SlipModel<Beyond<Law>> has slope, patches, dynamic
/// normal reactions, spin friction, loads and wrenches besides. Selected at construction, so that the paper's model
/// pays nothing for it.
template <class Law>
struct Beyond {};

/// Friction at the contact points with that of turning on the spot, M_S = a_m F_Z; N.
struct alignas(kAlignment) SpinningForce {
  Wheels F_X, F_Y, F_Z;
};
inline SpinningForce operator+(const SpinningForce& a, const SpinningForce& b) {
  return {a.F_X + b.F_X, a.F_Y + b.F_Y, a.F_Z + b.F_Z};
}
inline SpinningForce operator*(double factor, const SpinningForce& a) {
  return {factor * a.F_X, factor * a.F_Y, factor * a.F_Z};
}

/// Friction with the normal reactions that belong to it.
struct alignas(kAlignment) PressedFriction {
  SpinningForce F;
  Wheels N;
};
inline PressedFriction operator+(const PressedFriction& a, const PressedFriction& b) { return {a.F + b.F, a.N + b.N}; }
inline PressedFriction operator*(double factor, const PressedFriction& a) { return {factor * a.F, factor * a.N}; }

/// What happens at the four contacts, in the platform's frame, and what it depends on besides the velocities.
struct alignas(kAlignment) BeyondContacts : Contacts {
  Wheels V_Z;                         ///< a_m omega, where omega is the rate at which the roller turns on the spot, m/s
  Wheels spin;                        ///< what a unit dgamma adds to omega
  Wheels F_Z;                         ///< M_S / a_m, N
  Wheels M_S;                         ///< torque of the spin friction, N m; part of M_Z
  Wheels T_S;                         ///< its torque on the roller, N m
  Wheels f;                           ///< coefficient of friction
  Wheels N;                           ///< normal reaction, N
  std::array<Wheels, 3> N_by_moment;  ///< see Reactions::Solution; set for dynamic reactions only
  Pose pose;                          ///< of the base
  ExternalForce external;
  Side tipping = Side::kNone;
};

/// Friction as the slope of a limit surface that is an ellipsoid (Howe and Cutkosky, 1996): slip V_P and spin a_m omega
/// share one limit f N. Without spin it is Coulomb friction as in CoulombLaw. Linear for Beyond<ViscousLaw>.
template <class Law>
class LimitSurface;

/// -d(F_X, F_Y, F_Z)/d(V_PX, V_PY, V_Z), symmetric and positive semidefinite, N s/m.
struct SpinningStiffness {
  Wheels XX, XY, YY, XZ, YZ, ZZ;
};

template <>
class LimitSurface<CoulombLaw> {
 public:
  LimitSurface(const RobotParameters&, const FloorParameters& floor)
      : nu_(floor.nu), nu_squared_(floor.nu * floor.nu) {}

  /// Whether friction depends on the normal reaction.
  static constexpr bool kByReaction = true;

  /// Friction for the slip of `c` and the limit f N, N.
  SpinningForce force(const Contacts& c, const Wheels& V_Z, const Wheels& limit) const {
    const Wheels slope = limit * inverse_speed(c, V_Z);
    return {-slope * c.V_PX, -slope * c.V_PY, -slope * V_Z};
  }

  SpinningStiffness stiffness(const Contacts& c, const Wheels& V_Z, const Wheels& limit) const {
    const Wheels inverse = inverse_speed(c, V_Z), slope = limit * inverse;
    const Wheels X = c.V_PX * inverse, Y = c.V_PY * inverse, Z = V_Z * inverse;
    const Wheels regular = nu_squared_ * inverse.square();
    return {slope * (regular + Y.square() + Z.square()),
            -slope * X * Y,
            slope * (regular + X.square() + Z.square()),
            -slope * X * Z,
            -slope * Y * Z,
            slope * (regular + X.square() + Y.square())};
  }

  /// As CoulombLaw's for a force that is not yet that of the slip.
  SpinningStiffness stiffness(const Contacts& c, const Wheels& V_Z, const SpinningForce& F, const Wheels& limit) const {
    const Wheels inverse = inverse_speed(c, V_Z), slope = limit * inverse, squared = inverse.square();
    const Wheels X = c.V_PX * squared, Y = c.V_PY * squared, Z = V_Z * squared;
    return {slope + F.F_X * X,
            0.5 * (F.F_X * Y + F.F_Y * X),
            slope + F.F_Y * Y,
            0.5 * (F.F_X * Z + F.F_Z * X),
            0.5 * (F.F_Y * Z + F.F_Z * Y),
            slope + F.F_Z * Z};
  }

  SpinningForce bounded(const SpinningForce& F, const Wheels& limit) const {
    const Wheels squared = F.F_X.square() + F.F_Y.square() + F.F_Z.square();
    const Wheels scale = (limit * squared.max(1e-300).sqrt().inverse()).min(1);
    return {scale * F.F_X, scale * F.F_Y, scale * F.F_Z};
  }

  double transition_speed() const { return nu_; }
  void set_transition_speed(double nu) {
    nu_ = nu;
    nu_squared_ = nu * nu;
  }

 private:
  Wheels inverse_speed(const Contacts& c, const Wheels& V_Z) const {
    return (nu_squared_ + c.V_PX.square() + c.V_PY.square() + V_Z.square()).sqrt().inverse();
  }

  double nu_, nu_squared_;
};

template <>
class LimitSurface<ViscousLaw> {
 public:
  LimitSurface(const RobotParameters& robot, const FloorParameters& floor) : mu_0_(floor.mu_0(robot)) {}

  static constexpr bool kByReaction = false;

  SpinningForce force(const Contacts& c, const Wheels&, const Wheels&) const {
    return {-mu_0_ * c.V_PX, -mu_0_ * c.V_PY, Wheels::Zero()};
  }
  SpinningStiffness stiffness(const Contacts&, const Wheels&, const Wheels&) const {
    const Wheels zero = Wheels::Zero();
    return {mu_0_, zero, mu_0_, zero, zero, zero};
  }
  SpinningStiffness stiffness(const Contacts& c, const Wheels& V_Z, const SpinningForce&, const Wheels& limit) const {
    return stiffness(c, V_Z, limit);
  }
  SpinningForce bounded(const SpinningForce& F, const Wheels&) const { return F; }
  double transition_speed() const { return std::numeric_limits<double>::infinity(); }
  void set_transition_speed(double) {}

 private:
  Wheels mu_0_;
};

/// Models 2a and 2b beyond the paper: as SlipModel<Law>, with what depends on the pose and on other contacts. A contact
/// is evaluated in two steps: `place` finds slip and friction coefficient, `press` the friction under given normal
/// reactions, which `reactions` knows.
template <class Law>
class SlipModel<Beyond<Law>> {
 public:
  using Contacts = BeyondContacts;
  using Friction = PressedFriction;
  using Mask = Eigen::Array<bool, kWheels, 1>;

  /// `robot` is the bare one, whose mass decides mu_0.
  SlipModel(const RobotParameters& robot, const FloorParameters& floor, const Burden& burden = {})
      : bare_robot_(robot),
        floor_(floor),
        robot_(loaded(robot, burden.loads)),
        geometry_(robot),
        law_(robot, floor),
        a_m_(floor.spin_radius),
        per_R_(1 / robot.R),
        inertia_(robot_),
        dry_(robot),
        patches_(floor),
        external_(robot_, floor, burden.wrenches),
        static_N_(normal_reactions(robot_, floor)),
        reactions_(robot_, inertia_, external_.normal_gravity()),
        rho_X_(robot.rho_X()),
        rho_Y_(robot.rho_Y()) {}

  /// Takes over other loads and wrenches.
  void set_burden(const Burden& burden) {
    const double nu = transition_speed();
    *this = SlipModel(bare_robot_, floor_, burden);
    set_transition_speed(nu);
  }

  /// Whether the normal reactions follow the motion.
  bool dynamic() const {
    return LimitSurface<Law>::kByReaction && robot_.normal_reactions == NormalReactions::kDynamic;
  }
  /// Normal reactions of the base at rest, N.
  const Wheels& static_reactions() const { return static_N_; }

  /// Slip, position and coefficient of friction of the contact points, with what acts on the base at this pose; no
  /// friction yet.
  void place(const Velocities& u, const ContactGeometry& g, const Pose& pose, Contacts& c) const {
    c.Delta_Y = g.Delta_Y;
    c.r_X = g.r_X;
    c.r_Y = g.r_Y;
    c.V_PX = u.v[0] - (rho_Y_ + c.Delta_Y) * u.v[2] - robot_.R * u.dphi - c.r_X * u.dgamma;
    c.V_PY = u.v[1] + rho_X_ * u.v[2] + c.r_Y * u.dgamma;
    c.spin = g.dr_Y * per_R_;  // -cos(delta) sin(phi~)
    c.V_Z = a_m_ * (u.v[2] + c.spin * u.dgamma);
    c.pose = pose;
    c.external = external_.at(pose.cosine, pose.sine);
    c.f = patches_.any() ? friction_at(pose, c.Delta_Y) : floor_.f;
  }

  /// Friction under the normal reactions N.
  void press(const Wheels& N, Contacts& c) const {
    c.N = N;
    put(law_.force(c, c.V_Z, c.f * N), c);
  }

  /// Presses contacts by these reactions that are pressed by 1 N: friction is proportional.
  void press_more(const Reactions::Solution& reactions, Contacts& c) const {
    for (Wheels Contacts::*entry : {&Contacts::F_X, &Contacts::F_Y, &Contacts::M_Z}) c.*entry *= reactions.N;
    for (Wheels BeyondContacts::*entry : {&BeyondContacts::F_Z, &BeyondContacts::M_S, &BeyondContacts::T_S}) {
      c.*entry *= reactions.N;
    }
    c.N = reactions.N;
    c.N_by_moment = reactions.by_moment;
    c.tipping = reactions.tipping;
  }

  /// What contacts exert that are pressed by 1 N, for each newton of their normal reactions.
  ContactByReaction by_reaction(const Contacts& c) const {
    ContactByReaction by_reaction;
    by_reaction.slope = {c.F_X, c.F_Y, c.M_Z, c.T_S, c.Delta_Y};
    return by_reaction;
  }

  /// Whether what acts on the base depends on where it stands.
  bool by_pose() const { return patches_.any() || external_.turns(); }

  /// The normal reactions in this motion under the wheel torques M, N m.
  Reactions::Solution reactions(const Velocities& u, const Wheels& M, const Contacts& placed,
                                const ContactByReaction& contact) const {
    Wheels tau = M - robot_.mu_1 * u.dphi;
    if (dry_.any()) tau -= dry_.wheel_torque(u.dphi);
    return reactions_.solve(contact,
                            {u.v, u.dphi, tau.sum(), inertia_.coriolis(u.v) + placed.external.v, placed.external});
  }

  Friction friction(const Contacts& c) const { return {{c.F_X, c.F_Y, c.F_Z}, c.N}; }

  /// Replaces the friction of the wheels in `mask` by as large a share of the normal reaction as F is. A wheel that was
  /// off the floor keeps its own.
  void put_friction(const Mask& mask, const Friction& known, Contacts& c) const {
    const Contacts before = c;
    const Mask put_in = mask && known.N > 0;
    const auto share = [&](const Wheels& F, const Wheels& other) -> Wheels {
      return put_in.select(c.N / known.N * F, other);
    };
    put({share(known.F.F_X, c.F_X), share(known.F.F_Y, c.F_Y), share(known.F.F_Z, c.F_Z)}, c);
    // For a shared contact the mean of moments is no moment of means.
    c.M_Z = mask.select(c.M_Z, before.M_Z);
    c.M_S = mask.select(c.M_S, before.M_S);
    c.T_S = mask.select(c.T_S, before.T_S);
  }

  Velocities forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    Velocities Q = {sums(c.F_X, c.F_Y, c.M_Z) + inertia_.coriolis(u.v) + c.external.v,
                    M - robot_.mu_1 * u.dphi - robot_.R * c.F_X,
                    c.r_Y * c.F_Y - c.r_X * c.F_X + c.T_S - robot_.mu_2 * u.dgamma};
    if (dry_.any()) dry_.add_to(u, Q);
    return Q;
  }
  void forces(const std::array<Velocities, 3>& u, const std::array<Contacts, 3>& c, const std::array<Wheels, 3>& M,
              std::array<Velocities, 3>& Q) const {
    for (int j = 0; j < 3; ++j) Q[j] = forces(u[j], c[j], M[j]);
  }

  ContactDetails details(const Contacts& c) const {
    ContactDetails details{c};
    details.N = c.N;
    details.f = c.f;
    details.M_S = c.M_S;
    details.F_Z = c.F_Z;
    details.T_S = c.T_S;
    details.external = c.external.v;
    if (a_m_ > 0) details.omega = c.V_Z / a_m_;
    return details;
  }

  /// The torque that a roller gets from its contact, N m.
  Wheels roller_torque(const Contacts& c) const { return c.r_Y * c.F_Y - c.r_X * c.F_X + c.T_S; }

  void derivative(const State& state, const Contacts& c, const Wheels& M, State& derivative) const {
    set_derivative(inertia_, state, forces(state.velocities(), c, M), derivative);
  }

  /// As SlipModel's, for normal reactions that stay.
  void damping(const Velocities& u, const Contacts& c, DampingMatrix& G) const {
    damping(u, c, law_.stiffness(c, c.V_Z, c.f * c.N), G);
  }
  void damping(const Velocities& u, const Contacts& c, const Friction& F, DampingMatrix& G) const {
    damping(u, c, law_.stiffness(c, c.V_Z, F.F, c.f * F.N), G);
  }

  /// How dynamic reactions couple all velocities, where what the contacts `c` exert for each newton is `slope` and the
  /// damping matrix is G.
  void couple(const Contacts& c, const ContactByReaction& contact, const DampingMatrix& G,
              ReactionCoupling& coupling) const {
    reactions_.couple(G, c.N_by_moment, coupling);
    const ContactByReaction::Exerted& k = contact.slope;
    const Wheels roller_torque = c.r_Y * k.F_Y - c.r_X * k.F_X + k.T_S;
    for (int m = 0; m < 3; ++m) {
      const Wheels& N = coupling.N[m];
      coupling.forces[m] = {sums(k.F_X * N, k.F_Y * N, k.M_Z * N), -robot_.R * k.F_X * N, roller_torque * N};
    }
  }

  /// As SlipModel's, where the normal reactions have changed by dN too.
  Friction friction_after(const Contacts& c, const Friction& F, const Velocities& du, const Wheels& dN) const {
    const Wheels N = (c.N + dN).max(0);
    return {law_.bounded(law_.force(c, c.V_Z, c.f * N) + friction_change(c, F, du), c.f * N), N};
  }
  Friction friction_after(const Contacts& c, const Friction& F, const Velocities& du) const {
    return {law_.bounded(friction(c).F + friction_change(c, F, du), c.f * c.N), c.N};
  }

  /// F, shortened to the largest friction that its reactions allow at the contacts `c`.
  Friction bounded(const Friction& F, const Contacts& c) const {
    const Wheels N = F.N.max(0);
    return {law_.bounded(F.F, c.f * N), N};
  }

  double transition_speed() const { return law_.transition_speed(); }
  void set_transition_speed(double nu) { law_.set_transition_speed(nu); }

  /// The longest step (s) in which no contact point jumps over the soft edge of a patch; infinite without patches.
  double max_step(const State& x, const Wheels& Delta_Y) const {
    if (!patches_.any()) return std::numeric_limits<double>::infinity();
    Wheels X, Y;
    contact_points(x.pose(), Delta_Y, X, Y);
    const double reach = std::hypot(robot_.h, robot_.l + robot_.R_d);
    const double speed = std::hypot(x.V_X(), x.V_Y()) + std::abs(x.Omega()) * reach;
    const double way = patches_.max_way(X, Y);  // = speed t + kMaxAcceleration t^2 / 2
    return 2 * way / (speed + std::sqrt(speed * speed + 2 * kMaxAcceleration * way));
  }

  const Inertia& inertia() const { return inertia_; }
  const RollerGeometry& geometry() const { return geometry_; }
  const RobotParameters& robot() const { return robot_; }  ///< with its loads
  const DryBearings& dry_bearings() const { return dry_; }

 private:
  static constexpr double kMaxAcceleration = 20;  // m/s^2, more than friction gives a base

  void put(const SpinningForce& F, Contacts& c) const {
    c.F_X = F.F_X;
    c.F_Y = F.F_Y;
    c.F_Z = F.F_Z;
    c.M_S = a_m_ * F.F_Z;
    c.T_S = c.M_S * c.spin;
    c.M_Z = c.F_Y * rho_X_ - c.F_X * (rho_Y_ + c.Delta_Y) + c.M_S;
  }

  void contact_points(const Pose& pose, const Wheels& Delta_Y, Wheels& X, Wheels& Y) const {
    const Wheels arm = rho_Y_ + Delta_Y;
    X = pose.x + pose.cosine * rho_X_ - pose.sine * arm;
    Y = pose.y + pose.sine * rho_X_ + pose.cosine * arm;
  }
  Wheels friction_at(const Pose& pose, const Wheels& Delta_Y) const {
    Wheels X, Y;
    contact_points(pose, Delta_Y, X, Y);
    return patches_.friction(X, Y);
  }

  // What the friction F, which need not be that of c's slip, changes by with the velocities.
  SpinningForce friction_change(const Contacts& c, const Friction& F, const Velocities& du) const {
    const SpinningStiffness K = law_.stiffness(c, c.V_Z, F.F, c.f * F.N);
    const Wheels dX = du.v[0] - (rho_Y_ + c.Delta_Y) * du.v[2] - robot_.R * du.dphi - c.r_X * du.dgamma;
    const Wheels dY = du.v[1] + rho_X_ * du.v[2] + c.r_Y * du.dgamma;
    const Wheels dZ = a_m_ * (du.v[2] + c.spin * du.dgamma);
    return {-K.XX * dX - K.XY * dY - K.XZ * dZ, -K.XY * dX - K.YY * dY - K.YZ * dZ, -K.XZ * dX - K.YZ * dY - K.ZZ * dZ};
  }

  // J' K J, where the rows of J are the derivatives of V_PX, V_PY and V_Z by V_X, V_Y, Omega, dphi, dgamma.
  void damping(const Velocities& u, const Contacts& c, const SpinningStiffness& K, DampingMatrix& G) const {
    const double R = robot_.R;
    const Wheels arm = rho_Y_ + c.Delta_Y, spin = a_m_ * c.spin;
    const auto column = [&](const Wheels& X, const Wheels& Y, const Wheels& Z) {
      return std::array<Wheels, 3>{K.XX * X + K.XY * Y + K.XZ * Z, K.XY * X + K.YY * Y + K.YZ * Z,
                                   K.XZ * X + K.YZ * Y + K.ZZ * Z};
    };
    const Wheels one = Wheels::Ones(), zero = Wheels::Zero();
    const std::array<std::array<Wheels, 3>, 3> platform = {column(one, zero, zero), column(zero, one, zero),
                                                           column(-arm, rho_X_, a_m_ * one)};
    const std::array<Wheels, 3> by_dgamma = column(-c.r_X, c.r_Y, spin);
    for (int k = 0; k < 3; ++k) {
      const auto& [X, Y, Z] = platform[k];
      G.platform_platform[0][k] = X;
      G.platform_platform[1][k] = Y;
      G.platform_platform[2][k] = rho_X_ * Y - arm * X + a_m_ * Z;
      G.dphi_platform[k] = G.platform_dphi[k] = -R * X;
      G.dgamma_platform[k] = G.platform_dgamma[k] = c.r_Y * Y - c.r_X * X + spin * Z;
    }
    G.dphi_dphi = robot_.mu_1 + R * R * K.XX;
    G.dphi_dgamma = -R * by_dgamma[0];
    G.dgamma_dgamma = robot_.mu_2 + c.r_Y * by_dgamma[1] - c.r_X * by_dgamma[0] + spin * by_dgamma[2];
    if (dry_.any()) dry_.add_to(u, G);
  }

  RobotParameters bare_robot_;
  FloorParameters floor_;
  RobotParameters robot_;
  RollerGeometry geometry_;
  LimitSurface<Law> law_;
  double a_m_, per_R_;
  Inertia inertia_;
  DryBearings dry_;
  FloorPatches patches_;
  ExternalForces external_;
  Wheels static_N_;
  Reactions reactions_;
  Wheels rho_X_, rho_Y_;
};

/// Whether a friction law is used beyond the paper.
template <class Law>
inline constexpr bool kBeyond = false;
template <class Law>
inline constexpr bool kBeyond<Beyond<Law>> = true;

}  // namespace youbot_base_sim
