#pragma once

#include <array>
#include <stdexcept>

#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/physics/contact_friction.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// The paper's assumptions, as a policy of SlipModel: one coefficient of friction for each wheel, the normal reactions
/// of the base at rest, no spin friction, a level floor, no loads. ExtendedFeatures is the other policy.
class PaperFeatures {
 public:
  static constexpr int kSlipComponents = 2;        ///< of ContactVector: without spin
  static constexpr bool kReactionsFollow = false;  ///< true if normal reactions may follow the motion

  using Contacts = youbot_base_sim::Contacts;
  using Force = ContactVector<kSlipComponents>;
  using Friction = Force;  ///< an unknown of Newton's iterations
  /// Entries that become weighted means where two rollers share a wheel.
  static constexpr std::array<Wheels Contacts::*, 6> kMeans = {&Contacts::V_PX, &Contacts::V_PY,    &Contacts::F_X,
                                                               &Contacts::F_Y,  &Contacts::Delta_Y, &Contacts::M_Z};

  /// Throws std::logic_error for loads or wrenches, which belong to ExtendedFeatures.
  PaperFeatures(const RobotParameters& robot, const FloorParameters& floor, const Inertia&, const AppliedLoads& applied,
                double)
      : N_(normal_reactions(robot, floor)), f_(floor.f), limit_(floor.f * N_) {
    if (!applied.loads.empty() || !applied.wrenches.empty()) throw std::logic_error("the paper's model knows no loads");
  }

  void evaluate_kinematics(const Velocities&, const ContactGeometry&, const Pose&, Contacts&) const {}
  static Pose pose(const Contacts&) { return {}; }
  const Wheels& static_reactions() const { return N_; }
  const Wheels& reactions(const Contacts&) const { return N_; }
  void set_reactions(const Wheels&, Contacts&) const {}
  void keep_tipping(const Contacts&, Contacts&) const {}
  const Wheels& limit(const Contacts&) const { return limit_; }

  Force slip(const Contacts& c) const { return {{c.V_PX, c.V_PY}}; }
  Force force(const Contacts& c) const { return {{c.F_X, c.F_Y}}; }
  void add_spin(const Force&, Contacts&) const {}
  void add_spin_torque(const Contacts&, Wheels&) const {}
  void add_external(const Contacts&, Wheels&) const {}

  Friction friction(const Contacts& c) const { return force(c); }
  static const Force& force(const Friction& F) { return F; }
  static Friction with_force(const Friction&, const Force& F) { return F; }
  static const Friction& pressed(const Friction& F) { return F; }
  const Wheels& limit(const Friction&, const Contacts&) const { return limit_; }

  bool by_pose() const { return false; }
  double max_step(const State&, const ContactModes&) const { return kInfinity; }
  bool jumps(const State&, const State&, const ContactModes&) const { return false; }
  void add_details(const Contacts&, ContactDetails& details) const {
    details.N = N_;
    details.f = f_;
  }

 private:
  Wheels N_, f_;
  alignas(kAlignment) Wheels limit_;  // f N, N
};

}  // namespace youbot_base_sim
