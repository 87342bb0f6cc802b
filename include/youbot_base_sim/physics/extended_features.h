#pragma once

#include <array>
#include <cmath>

#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/contact_friction.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/reactions.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Contacts, and what they depend on besides the velocities.
struct alignas(kAlignment) ExtendedContacts : Contacts {
  Wheels V_Z;   ///< a_m omega, where omega is the rate at which the roller rotates on the spot, m/s
  Wheels spin;  ///< what a unit dgamma adds to omega
  Wheels F_Z;   ///< M_S / a_m, N
  Wheels M_S;   ///< torque of the spin friction, N m; part of M_Z
  Wheels T_S;   ///< its torque on the roller, N m
  Wheels f;     ///< coefficient of friction
  Wheels N;     ///< normal reaction, N
  std::array<Wheels, 3> N_by_moment;  ///< see Reactions::Solution; set for dynamic reactions only
  Pose pose;                          ///< of the base
  ExternalForce external;
  Side tipping = Side::kNone;
};

/// Friction with the normal reactions that belong to it.
struct alignas(kAlignment) FrictionUnderReactions {
  ContactVector<3> F;
  Wheels N;
};
inline FrictionUnderReactions operator+(const FrictionUnderReactions& a, const FrictionUnderReactions& b) {
  return {a.F + b.F, a.N + b.N};
}
inline FrictionUnderReactions operator*(double factor, const FrictionUnderReactions& a) {
  return {factor * a.F, factor * a.N};
}

/// The physics beyond the paper, as a policy of SlipModel: slope, patches, dynamic normal reactions, spin friction,
/// loads and wrenches.
class ExtendedFeatures {
 public:
  static constexpr int kSlipComponents = 3;
  static constexpr bool kReactionsFollow = true;

  using Contacts = ExtendedContacts;
  using Force = ContactVector<kSlipComponents>;
  using Friction = FrictionUnderReactions;
  static constexpr std::array<Wheels Contacts::*, 11> kMeans = {
      &Contacts::V_PX, &Contacts::V_PY, &Contacts::F_X, &Contacts::F_Y, &Contacts::Delta_Y, &Contacts::M_Z,
      &Contacts::V_Z,  &Contacts::F_Z,  &Contacts::M_S, &Contacts::T_S, &Contacts::f};

  /// `robot` and `inertia` are those with the loads; `friction_arm` is that of friction on a wheel, m.
  ExtendedFeatures(const RobotParameters& robot, const FloorParameters& floor, const Inertia& inertia,
                   const AppliedLoads& applied, double friction_arm)
      : rho_X_(robot.rho_X()),
        rho_Y_(robot.rho_Y()),
        R_d_tan_delta_(robot.R_d * robot.tan_delta().abs()),
        reach_(distance(robot.h, robot.l + R_d_tan_delta_.maxCoeff())),
        per_R_(1 / robot.R),
        a_m_(floor.spin_radius),
        floor_(floor),
        external_(robot, floor, applied.wrenches),
        dynamic_(robot.normal_reactions == NormalReactions::kDynamic),
        static_N_(normal_reactions(robot, floor)),
        reactions_(robot, inertia, external_.normal_gravity(), friction_arm) {}

  /// Spin, coefficient of friction and what acts on the base at this pose, for contacts whose slip is known.
  void evaluate_kinematics(const Velocities& u, const ContactGeometry& g, const Pose& pose, Contacts& c) const {
    c.spin = g.dr_Y * per_R_;  // -cos(delta) sin(phi~)
    c.V_Z = a_m_ * (u.v[2] + c.spin * u.dgamma);
    c.pose = pose;
    c.external = external_.at(pose.cosine, pose.sine);
    c.f = floor_.f;
    if (has_patches()) {
      const auto [X, Y] = contact_points(pose, c.Delta_Y);
      c.f = floor_.friction_at(X, Y);
    }
    c.tipping = Side::kNone;
  }

  static Pose pose(const Contacts& c) { return c.pose; }

  /// Normal reactions of the base at rest, N.
  const Wheels& static_reactions() const { return static_N_; }
  const Wheels& reactions(const Contacts& c) const { return c.N; }
  void set_reactions(const Wheels& N, Contacts& c) const { c.N = N; }
  void keep_tipping(const Contacts& from, Contacts& c) const { c.tipping = from.tipping; }
  Wheels limit(const Contacts& c) const { return c.f * c.N; }

  Force slip(const Contacts& c) const { return {{c.V_PX, c.V_PY, c.V_Z}}; }
  Force force(const Contacts& c) const { return {{c.F_X, c.F_Y, c.F_Z}}; }
  void add_spin(const Force& F, Contacts& c) const {
    c.F_Z = F[2];
    c.M_S = a_m_ * F[2];
    c.T_S = c.M_S * c.spin;
    c.M_Z += c.M_S;
  }
  void add_spin_torque(const Contacts& c, Wheels& torque) const { torque += c.T_S; }
  void add_external(const Contacts& c, Wheels& v) const { v += c.external.v; }

  Friction friction(const Contacts& c) const { return {force(c), c.N}; }
  static const Force& force(const Friction& F) { return F.F; }
  static Friction with_force(const Friction& known, const Force& F) { return {F, known.N}; }
  static Friction pressed(const Friction& F) { return {F.F, F.N.max(0)}; }
  Wheels limit(const Friction& F, const Contacts& c) const { return c.f * F.N; }

  /// True if forces on the base depend on its pose.
  bool by_pose() const { return has_patches() || external_.by_heading(); }

  /// The longest step (s) in which no contact point jumps over the soft edge of a patch at the present speeds: the base
  /// carries it along, and a wheel that rotates sweeps it along the axle, as (3.4) says.
  double max_step(const State& x, const ContactModes& modes) const {
    if (!has_patches()) return kInfinity;
    const Wheels Delta_Y = modes.geometry(x.phi()).Delta_Y;
    const auto [X, Y] = contact_points(x.pose(), Delta_Y);
    const double sweep = ((R_d_tan_delta_ + Delta_Y.square() / R_d_tan_delta_) * x.dphi().abs()).maxCoeff();
    return floor_.max_distance(X, Y) / (distance(x.V_X(), x.V_Y()) + std::abs(x.Omega()) * reach_ + sweep);
  }
  /// True if one did in a step from `start` to `end`, in which it became faster.
  bool jumps(const State& start, const State& end, const ContactModes& modes) const {
    if (!has_patches()) return false;
    const auto [X, Y] = contact_points(start.pose(), modes.geometry(start.phi()).Delta_Y);
    const auto [X_end, Y_end] = contact_points(end.pose(), modes.geometry(end.phi()).Delta_Y);
    return ((X_end - X).square() + (Y_end - Y).square()).sqrt().maxCoeff() > floor_.max_distance(X, Y);
  }

  void add_details(const Contacts& c, ContactDetails& details) const {
    details.N = c.N;
    details.f = c.f;
    details.M_S = c.M_S;
    details.F_Z = c.F_Z;
    details.T_S = c.T_S;
    details.external = c.external.v;
    if (a_m_ > 0) details.omega = c.V_Z / a_m_;
  }

  double spin_radius() const { return a_m_; }  ///< a_m, m

  /// The normal reactions follow the motion if `dynamic`; `reactions` then computes them.
  bool dynamic() const { return dynamic_; }
  const Reactions& reactions() const { return reactions_; }

 private:
  static double distance(double X, double Y) { return std::sqrt(X * X + Y * Y); }

  bool has_patches() const { return !floor_.patches.empty(); }
  // X and Y in the fixed frame, m
  std::array<Wheels, 2> contact_points(const Pose& pose, const Wheels& Delta_Y) const {
    const Wheels arm = rho_Y_ + Delta_Y;
    return {pose.x + pose.cosine * rho_X_ - pose.sine * arm, pose.y + pose.sine * rho_X_ + pose.cosine * arm};
  }

  Wheels rho_X_, rho_Y_, R_d_tan_delta_;
  double reach_, per_R_, a_m_;
  FloorParameters floor_;
  ExternalForces external_;
  bool dynamic_;
  Wheels static_N_;
  Reactions reactions_;
};

}  // namespace youbot_base_sim
