#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "youbot_base_sim/integration/contact_system.h"
#include "youbot_base_sim/integration/massless_rollers.h"
#include "youbot_base_sim/physics/shared_contact.h"
#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// The equations of motion of models 2a and 2b under given wheel torques, for the rollers that are in contact now.
/// Steppers and events know it as a ContactSystem, Radau and FallbackStepper as what it is.
template <class Model>
class SlipSystem final : public ContactSystem {
 public:
  using Contacts = typename Model::Contacts;

  /// `torque` must outlive the system. The rollers in contact are those on which `state` stands.
  SlipSystem(const Model& model, const TorqueProfile& torque, const State& state)
      : ContactSystem(ContactModes(model.robot(), state.phi()),
                      RestFriction(model.robot(), model.regularization_speed(), model.holding_speed())),
        model_(model),
        torque_(&torque) {}

  void operator()(const State& x, State& dxdt, double t) const override {
    const Wheels M = torque_->value(t);
    model_.derivative(x, contacts(x.velocities(), x.phi(), pose(x), M), M, dxdt);
    ++evaluations_;
  }

  /// Small against the scales on which friction changes; 0 for entries without effect.
  State increments() const override {
    constexpr double kLargest = 1e-6, kShare = 1e-3;  // m, rad, m/s or rad/s; of where friction reverses
    const Velocities scale = regularization_velocities(model_);
    const auto increment = [&](const Wheels& velocity) -> Wheels { return (kShare * velocity).min(kLargest); };
    const double place = model_.features().by_pose() ? kLargest : 0;
    State steps;
    steps.values.col(0) << place, place, kLargest, 0;
    steps.values.col(1) = increment(scale.v);
    steps.values(3, 1) = 0;  // unused
    steps.phi().setConstant(kLargest);
    steps.dphi() = increment(scale.dphi);
    steps.dgamma() = increment(scale.dgamma);
    return steps;
  }

  /// Slip, friction and position of the contact points, N, m and m/s, at velocities u, wheel angles phi (rad) and this
  /// pose under the torques M (N m), which decide how a shared contact is shared.
  Contacts contacts(const Velocities& u, const Wheels& phi, const Pose& pose, const Wheels& M) const {
    Contacts c;
    if (modes_.mixed() || reacts()) {
      any_contacts(u, phi, pose, M, modes_.shared(), c);
    } else {
      model_.evaluate_kinematics(u, model_.geometry().at(phi - modes_.center()), pose, c);
      model_.apply_static_normal_force(c);
    }
    return c;
  }
  Contacts contacts(const State& x, double t) const {
    return contacts(x.velocities(), x.phi(), pose(x), torque_->value(t));
  }
  /// Contacts at the three stages of a step, and their stiffness for given friction.
  struct StageEvaluation {
    std::array<Contacts, 3> contacts;
    std::array<typename Model::Stiffness, 3> stiffness;
  };
  /// Sets `at` to those at the velocities u, with the stiffness for the friction F. Rare cases stay out of the loop.
  void contacts(const std::array<Velocities, 3>& u, const std::array<Wheels, 3>& phi, const std::array<Pose, 3>& pose,
                const std::array<Wheels, 3>& M, const std::array<typename Model::Friction, 3>& F,
                StageEvaluation& at) const {
    auto& [c, K] = at;
    if (modes_.mixed() || reacts()) {
      for (int j = 0; j < 3; ++j) {
        any_contacts(u[j], phi[j], pose[j], M[j], modes_.shared(), c[j]);
        K[j] = model_.stiffness(c[j], F[j]);
      }
    } else {
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) {
        model_.evaluate_kinematics(u[j], model_.geometry().at(phi[j] - modes_.center()), pose[j], c[j]);
        model_.apply_static_normal_force(F[j], c[j], K[j]);
      }
    }
    evaluations_ += 3;
  }
  /// Rates (rad/s) of rollers without inertia at the other velocities of u, where the wheels in `shared` are shared.
  [[gnu::noinline]] Wheels massless_roller_rates(Velocities u, const Wheels& phi, const Pose& pose, const Wheels& M,
                                                 const WheelMask& shared) const {
    return rates_without_torque(u.dgamma, [&](const Wheels& dgamma) -> Wheels {
      Contacts c;
      u.dgamma = dgamma;
      any_contacts(u, phi, pose, M, shared, c);
      ++evaluations_;
      return model_.forces(u, c, M).dgamma;
    });
  }
  /// Pose of x, if it matters.
  Pose pose(const State& x) const { return model_.features().by_pose() ? x.pose() : Pose(); }

  /// Sets `c` to the contacts at the velocities u with wheel angles, pose and normal reactions of x, where they are
  /// `at_x`. No contact may be shared.
  void contacts_near(const State& x, const Contacts& at_x, const Velocities& u, Contacts& c) const {
    model_.evaluate_kinematics(u, modes_.geometry(x.phi()), pose(x), c);
    model_.apply_normal_force_of(at_x, c);
  }

  /// Damping matrix at these contacts, for their stiffness K.
  void damping(const Velocities& u, const Contacts& c, const typename Model::Stiffness& K, const Wheels& M,
               DampingMatrix& G) const {
    model_.damping(u, c, K, G);
    if (modes_.shares()) write_shared_contacts(u, c, M, G);
  }

  /// True if normal reactions follow the motion: its derivatives then have a ReactionCoupling besides the damping.
  bool reacts() const override {
    if constexpr (Model::kReactionsFollow) return model_.dynamic();
    return false;
  }

  /// Sets this coupling where the damping matrix is G.
  void couple(const Velocities& u, const Contacts& c, const Wheels& M, const DampingMatrix& G,
              ReactionCoupling& coupling) const {
    Contacts unit = c;
    model_.apply_normal_force(Wheels::Ones(), unit);
    ForcePerNormalLoad per_load = model_.force_per_normal_load(unit);
    if (modes_.shares()) share_reactions(u, M, modes_.shared(), unit, per_load);
    model_.couple(c, per_load, G, coupling);
  }

  /// Replaces the loads and wrenches from now on.
  void set_loads(const AppliedLoads& applied) {
    model_.set_loads(applied);
    regularize_friction();
  }

  /// Normal reactions where they follow the motion.
  FloorReactions reactions(const State& x, double t) const override {
    if constexpr (Model::kReactionsFollow) {
      const Contacts c = contacts(x, t);
      return {c.N, c.tipping};
    } else {
      return {};
    }
  }

  double max_step(const State& x, double t) const override {
    return std::min({torque_->max_step(t), kMaxTurn / std::abs(x.Omega()), model_.features().max_step(x, modes_)});
  }
  bool jumps(const State& x, const State& end) const override { return model_.features().jumps(x, end, modes_); }

  Sharing sharing(int i, const State& x, double t) const override {
    const SharedContact<Model> contact = held_contact(i, x, t);
    // A prescribed wheel keeps to its angles and never rests between rollers.
    return {contact.alpha(), contact.attractive() && !model_.wheels_prescribed(), contact.hold_error(x.dphi()[i]),
            contact.kick()};
  }

  void enter_sliding(int i, std::int64_t k, State& x, double t) override {
    const RobotParameters& robot = model_.robot();
    const double energy = kinetic_energy(robot, x);
    const Eigen::Vector4d P = held_contact(i, x, t).impulse(x.dphi()[i]);
    const Eigen::Vector3d dv = product(model_.inertia().M_v_inverse, Eigen::Vector3d(P.head<3>()));
    x.values.col(1) += Wheels{dv[0], dv[1], dv[2], 0};
    if (robot.J_2 > 0) x.dgamma()[i] += P[3] / robot.J_2;
    x.dphi()[i] = 0;
    x.phi()[i] = model_.geometry().upper_edge(k);
    x.work() += kinetic_energy(robot, x) - energy;
    modes_.share(i, k);
    modes_.renew();
  }

  const Model& model() const { return model_; }
  const TorqueProfile& torque() const { return *torque_; }

 private:
  void regularize_friction() override {
    model_.set_regularization_speed(rest_.nu());
    model_.set_dry_friction_rate(rest_.dry_friction_rate());
  }

  // Contacts of any mode; those in `shared` are shared.
  [[gnu::flatten, gnu::noinline]] void any_contacts(const Velocities& u, const Wheels& phi, const Pose& pose,
                                                    const Wheels& M, const WheelMask& shared, Contacts& c) const {
    model_.evaluate_kinematics(
        u, modes_.averages() ? modes_.geometry(phi) : model_.geometry().at(modes_.phi_tilde(phi)), pose, c);
    if (reacts()) {
      apply_dynamic_normal_force(u, M, shared, c);
    } else {
      model_.apply_static_normal_force(c);
      if (shared.any()) share_contacts(u, M, shared, c);
    }
  }
  // Applies the reactions of this motion.
  void apply_dynamic_normal_force(const Velocities& u, const Wheels& M, const WheelMask& shared, Contacts& c) const {
    if constexpr (Model::kReactionsFollow) {
      model_.apply_normal_force(Wheels::Ones(), c);
      ForcePerNormalLoad per_load = model_.force_per_normal_load(c);
      if (shared.any()) share_reactions(u, M, shared, c, per_load);
      model_.scale_by_reactions(model_.reactions(u, M, c, per_load), c);
      if (shared.any()) share_contacts(u, M, shared, c);
    }
  }
  [[gnu::noinline]] void share_reactions(const Velocities& u, const Wheels& M, const WheelMask& shared,
                                         const Contacts& unit, ForcePerNormalLoad& per_load) const {
    const Wheels zero = Wheels::Zero();
    per_load.intercept = {zero, zero, zero, zero, zero};
    per_load.shares = true;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, unit, M).write_to(per_load);
    }
  }
  [[gnu::noinline]] void share_contacts(const Velocities& u, const Wheels& M, const WheelMask& shared,
                                        Contacts& c) const {
    const Contacts pressed = c;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, pressed, M).write_to(c);
    }
  }

  // The shared contact of wheel i at the pose and normal reactions of `c`.
  SharedContact<Model> shared_contact(int i, const Velocities& u, const Contacts& c, const Wheels& M) const {
    const double half = 0.5 * model_.geometry().pitch();
    Contacts lower, upper;
    place_rollers(half, u, c, M, lower);
    place_rollers(-half, u, c, M, upper);
    return {model_, i, u, M[i], lower, upper};
  }
  // Contacts of rollers at the angle phi_tilde (rad), at the pose and normal reactions of `c`. Without inertia each has
  // the rate that friction would give it under the reactions at rest; u.dgamma is their mean.
  void place_rollers(double phi_tilde, Velocities u, const Contacts& c, const Wheels& M, Contacts& rollers) const {
    const ContactGeometry g = model_.geometry().at(Wheels::Constant(phi_tilde));
    const Pose pose = model_.features().pose(c);
    if (model_.inertia().J_2 == 0) {
      u.dgamma = rates_without_torque(u.dgamma, [&](const Wheels& dgamma) -> Wheels {
        u.dgamma = dgamma;
        model_.evaluate_kinematics(u, g, pose, rollers);
        model_.apply_static_normal_force(rollers);
        return model_.forces(u, rollers, M).dgamma;
      });
    }
    model_.evaluate_kinematics(u, g, pose, rollers);
    model_.apply_normal_force_of(c, rollers);
  }
  // The shared contact of wheel i if it rests in state x at time t.
  SharedContact<Model> held_contact(int i, const State& x, double t) const {
    Velocities u = x.velocities();
    WheelMask shared = modes_.shared();
    if (!shared[i]) {
      u.dphi[i] = 0;
      shared[i] = true;
    }
    const Wheels M = torque_->value(t);
    Contacts c;
    any_contacts(u, x.phi(), pose(x), M, shared, c);
    return shared_contact(i, u, c, M);
  }

  [[gnu::noinline]] void write_shared_contacts(const Velocities& u, const Contacts& c, const Wheels& M,
                                               DampingMatrix& G) const {
    for (int i = 0; i < kWheels; ++i) {
      if (modes_.shared(i)) shared_contact(i, u, c, M).write_to(G);
    }
  }

  Model model_;
  const TorqueProfile* torque_;
};

}  // namespace youbot_base_sim
