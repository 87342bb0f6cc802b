#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/integration/reaction_monitor.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/shared_contact.h"
#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// The equations of motion of models 2a and 2b under given wheel torques, for the rollers that are in contact now: what
/// odeint calls a System, with the contacts that change at events. docs/architecture.md has the expressions by which
/// steppers and events know it.
template <class Model>
class SlipSystem {
 public:
  using Contacts = typename Model::Contacts;
  using Mask = WheelMask;

  /// `torque` must outlive the system. The rollers in contact are those on which `state` stands.
  SlipSystem(const Model& model, const TorqueProfile& torque, const State& state)
      : model_(model), torque_(&torque), modes_(model.robot(), state.phi()) {}

  /// dx/dt.
  void operator()(const State& x, State& dxdt, double t) const {
    const Wheels M = torque_->value(t);
    model_.derivative(x, contacts(x.velocities(), x.phi(), pose(x), M), M, dxdt);
    ++evaluations_;
  }

  /// Sets J(row, column) to the derivative of dx/dt by x, both in the order of State::Index, and dfdt to that by t.
  template <class Matrix>
  void jacobian(const State& x, Matrix& J, double t, State& dfdt) const;

  /// Slip, friction and position of the contact points, N, m and m/s, at velocities u, wheel angles phi (rad) and this
  /// pose under the torques M (N m), which decide how a shared contact is shared.
  void contacts(const Velocities& u, const Wheels& phi, const Pose& pose, const Wheels& M, Contacts& c) const {
    if (modes_.mixed() || reacts()) return any_contacts(u, phi, pose, M, modes_.shared(), c);
    own_contacts(u, phi, pose, c);
  }
  /// The same at three stages at once. Rare cases stay out of the loop.
  void contacts(const std::array<Velocities, 3>& u, const std::array<Wheels, 3>& phi, const std::array<Pose, 3>& pose,
                const std::array<Wheels, 3>& M, std::array<Contacts, 3>& c) const {
    if (modes_.mixed() || reacts()) {
      for (int j = 0; j < 3; ++j) any_contacts(u[j], phi[j], pose[j], M[j], modes_.shared(), c[j]);
    } else {
#pragma GCC unroll 3
      for (int j = 0; j < 3; ++j) own_contacts(u[j], phi[j], pose[j], c[j]);
    }
    evaluations_ += 3;
  }
  Contacts contacts(const Velocities& u, const Wheels& phi, const Pose& pose, const Wheels& M) const {
    Contacts c;
    contacts(u, phi, pose, M, c);
    return c;
  }
  /// Gives the wheels in `known`, none of them shared, the friction F of the step before at the contacts `c`. Dynamic
  /// reactions, and with them all friction, follow.
  void reuse_friction(const Mask& known, const typename Model::Friction& F, const Velocities& u, const Wheels& M,
                      Contacts& c) const {
    const auto reuse = [&](Contacts& pressed) { model_.put_friction(known, F, pressed); };
    if (!reacts()) return reuse(c);
    apply_dynamic_normal_force(u, M, modes_.shared(), c, reuse);
  }
  /// Pose of x, if it matters.
  Pose pose(const State& x) const { return model_.features().by_pose() ? x.pose() : Pose(); }
  Contacts contacts(const State& x, double t) const {
    return contacts(x.velocities(), x.phi(), pose(x), torque_->value(t));
  }

  /// Sets `c` to the contacts at the velocities u with wheel angles, pose and normal reactions of x, where they are
  /// `at_x`. No contact may be shared.
  void contacts_near(const State& x, const Contacts& at_x, const Velocities& u, Contacts& c) const {
    model_.evaluate_kinematics(u, modes_.geometry(x.phi()), pose(x), c);
    model_.apply_normal_force_of(at_x, c);
  }

  /// Damping matrix at these contacts, for the friction F.
  void damping(const Velocities& u, const Contacts& c, const typename Model::Friction& F, const Wheels& M,
               DampingMatrix& G) const {
    model_.damping(u, c, F, G);
    if (modes_.shares()) write_shared_contacts(u, c, M, G);
  }

  /// Whether normal reactions follow the motion: its derivatives then have a ReactionCoupling besides the damping.
  bool reacts() const {
    if constexpr (Model::kReactionsFollow) return model_.dynamic();
    return false;
  }

  /// That coupling where the damping matrix is G.
  void couple(const Velocities& u, const Contacts& c, const Wheels& M, const DampingMatrix& G,
              ReactionCoupling& coupling) const {
    Contacts unit = c;
    model_.apply_normal_force(Wheels::Ones(), unit);
    ForcePerNormalLoad per_load = model_.force_per_normal_load(unit);
    if (modes_.shares()) share_reactions(u, M, modes_.shared(), unit, per_load);
    model_.couple(c, per_load, G, coupling);
  }

  /// Replaces the loads and wrenches from now on.
  void set_loads(const AppliedLoads& applied) { model_.set_loads(applied); }

  /// Normal reactions where they follow the motion.
  FloorReactions reactions(const State& x, double t) const {
    if constexpr (Model::kReactionsFollow) {
      const Contacts c = contacts(x, t);
      return {c.N, c.tipping};
    } else {
      return {};
    }
  }

  /// The longest step from x (s) that friction, which changes from place to place, allows.
  double max_step(const State& x) const {
    if (!model_.features().by_patches()) return std::numeric_limits<double>::infinity();
    return model_.features().max_step(x, modes_.geometry(x.phi()).Delta_Y);
  }

  /// The contacts that the wheels have now.
  ContactModes& modes() { return modes_; }
  const ContactModes& modes() const { return modes_; }

  // Sliding mode.

  /// How wheel i is shared between two rollers at the edge at which it stands, or would be if it rested there.
  Sharing sharing(int i, const State& x, double t) const {
    Velocities u = x.velocities();
    Mask shared = modes_.shared();
    if (!shared[i]) {
      u.dphi[i] = 0;
      shared[i] = true;
    }
    const SharedContact<Model> contact = shared_contact(i, u, x, shared, torque_->value(t));
    return {contact.alpha(), contact.attractive()};
  }

  /// Stands wheel i, which is at the upper edge of roller k, on rollers k and k + 1. Its momentum goes to the platform,
  /// through the contact that took it.
  void enter_sliding(int i, std::int64_t k, State& x);

  /// Change of the platform's speed if wheel i gave up its momentum, m/s.
  double momentum(int i, const State& x) const {
    const RobotParameters& robot = model_.robot();
    return robot.J_1 * std::abs(x.dphi()[i]) / (robot.R * robot.m_s());
  }

  const Model& model() const { return model_; }
  const TorqueProfile& torque() const { return *torque_; }

  /// The regularization speed nu of the friction, m/s.
  double regularization_speed() const { return model_.regularization_speed(); }
  void set_regularization_speed(double nu) { model_.set_regularization_speed(nu); }

  /// Evaluations of the right-hand side so far.
  std::uint64_t evaluations() const { return evaluations_; }
  void count_evaluations(std::uint64_t more) const { evaluations_ += more; }

 private:
  // Where each wheel stands on a roller of its own, under the normal reactions of the base at rest.
  void own_contacts(const Velocities& u, const Wheels& phi, const Pose& pose, Contacts& c) const {
    model_.evaluate_kinematics(u, model_.geometry().at(phi - modes_.center()), pose, c);
    model_.apply_static_normal_force(c);
  }
  // Contacts of any mode; those in `shared` are shared.
  [[gnu::flatten, gnu::noinline]] void any_contacts(const Velocities& u, const Wheels& phi, const Pose& pose,
                                                    const Wheels& M, const Mask& shared, Contacts& c) const {
    model_.evaluate_kinematics(
        u, modes_.averages() ? modes_.geometry(phi) : model_.geometry().at(modes_.phi_tilde(phi)), pose, c);
    if (reacts()) {
      apply_dynamic_normal_force(u, M, shared, c, [](const Contacts&) {});
    } else {
      model_.apply_static_normal_force(c);
      if (shared.any()) share_contacts(u, M, shared, c);
    }
  }
  // Applies the normal reactions of this motion to contacts whose kinematics are known. The reactions follow from the
  // friction as `amend` has changed it.
  template <class Amend>
  void apply_dynamic_normal_force(const Velocities& u, const Wheels& M, const Mask& shared, Contacts& c,
                                  const Amend& amend) const {
    if constexpr (Model::kReactionsFollow) {
      model_.apply_normal_force(Wheels::Ones(), c);
      amend(c);
      ForcePerNormalLoad per_load = model_.force_per_normal_load(c);
      if (shared.any()) share_reactions(u, M, shared, c, per_load);
      model_.scale_by_reactions(model_.reactions(u, M, c, per_load), c);
      if (shared.any()) share_contacts(u, M, shared, c);
    }
  }
  [[gnu::noinline]] void share_reactions(const Velocities& u, const Wheels& M, const Mask& shared, const Contacts& unit,
                                         ForcePerNormalLoad& per_load) const {
    const Wheels zero = Wheels::Zero();
    per_load.intercept = {zero, zero, zero, zero, zero};
    per_load.shares = true;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, unit, M).write_to(per_load);
    }
  }
  [[gnu::noinline]] void share_contacts(const Velocities& u, const Wheels& M, const Mask& shared, Contacts& c) const {
    const Contacts pressed = c;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, pressed, M).write_to(c);
    }
  }

  // The shared contact of wheel i at the pose and normal reactions of `c`.
  SharedContact<Model> shared_contact(int i, const Velocities& u, const Contacts& c, const Wheels& M) const {
    const Wheels half = Wheels::Constant(0.5 * model_.geometry().pitch());
    Contacts lower, upper;
    model_.evaluate_kinematics_beside(c, u, model_.geometry().at(half), lower);
    model_.evaluate_kinematics_beside(c, u, model_.geometry().at(-half), upper);
    model_.apply_normal_force_of(c, lower);
    model_.apply_normal_force_of(c, upper);
    return {model_, i, u, M[i], lower, upper};
  }
  // The same at the wheel angles and pose of x, with the velocities u.
  SharedContact<Model> shared_contact(int i, const Velocities& u, const State& x, const Mask& shared,
                                      const Wheels& M) const {
    Contacts c;
    any_contacts(u, x.phi(), pose(x), M, shared, c);
    return shared_contact(i, u, c, M);
  }

  // The Jacobian of the paper's equations in closed form; that of the others by central differences.
  template <class Matrix>
  void closed_jacobian(const State& x, Matrix& J, double t, State& dfdt) const;
  template <class Matrix>
  void difference_jacobian(const State& x, Matrix& J, double t, State& dfdt) const;
  static constexpr double kDifference = 1e-6;  // of positions, velocities and time, at most

  // Derivatives of the forces on (V_X, V_Y, Omega), dphi and dgamma, one row each, by the 24 numbers of the state.
  using ForceJacobian = Eigen::Matrix<double, 11, State::kSize>;
  ForceJacobian force_jacobian(const State& x, const Contacts& c, const Wheels& M) const;
  // Derivative of dx/dt by t, where the torque M changes at `M_rate` (N m/s).
  void time_derivative(const Velocities& u, const Contacts& c, const Wheels& M, const Wheels& M_rate,
                       State& dfdt) const;

  [[gnu::noinline]] void write_shared_contacts(const Velocities& u, const Contacts& c, const Wheels& M,
                                               DampingMatrix& G) const {
    for (int i = 0; i < kWheels; ++i) {
      if (modes_.shared(i)) shared_contact(i, u, c, M).write_to(G);
    }
  }

  Model model_;
  const TorqueProfile* torque_;
  ContactModes modes_;
  mutable std::uint64_t evaluations_ = 0;
};

template <class Model>
void SlipSystem<Model>::enter_sliding(int i, std::int64_t k, State& x) {
  const RobotParameters& robot = model_.robot();
  const double energy = kinetic_energy(robot, x);
  // A free roller passes on only what is along its axis.
  const ContactGeometry g = model_.geometry().at(Wheels::Constant(0.5 * model_.geometry().pitch()));
  const double P_X = robot.J_1 * x.dphi()[i] / robot.R, P_Y = g.r_X[i] / g.r_Y[i] * P_X;
  const Eigen::Vector3d dv =
      model_.inertia().M_v_inverse * Eigen::Vector3d{P_X, P_Y, P_Y * robot.rho_X()[i] - P_X * robot.rho_Y()[i]};
  x.values.col(1) += Wheels{dv[0], dv[1], dv[2], 0};
  x.dphi()[i] = 0;
  x.phi()[i] = model_.geometry().upper_edge(k);
  x.work() += kinetic_energy(robot, x) - energy;
  modes_.share(i, k);
}

template <class Model>
typename SlipSystem<Model>::ForceJacobian SlipSystem<Model>::force_jacobian(const State& x, const Contacts& c,
                                                                            const Wheels& M) const {
  const Velocities u = x.velocities();
  AngleStiffness by_phi = model_.angle_stiffness(u, modes_.geometry(x.phi()), c);
  DampingMatrix G;
  model_.damping(u, c, G);
  if (modes_.shares()) {
    write_shared_contacts(u, c, M, G);
    for (Wheels* entry :
         {&by_phi.platform[0], &by_phi.platform[1], &by_phi.platform[2], &by_phi.dphi, &by_phi.dgamma}) {
      *entry = modes_.shared().select(Wheels::Zero(), *entry);  // phi stays on the edge
    }
  }
  ForceJacobian Q = ForceJacobian::Zero();
  for (int i = 0; i < kWheels; ++i) {
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k) Q(row, State::kV + k) -= G.platform_platform[row][k][i];
      Q(row, State::kPhi + i) = by_phi.platform[row][i];
      Q(row, State::kDphi + i) = -G.platform_dphi[row][i];
      Q(row, State::kDgamma + i) = -G.platform_dgamma[row][i];
      Q(3 + i, State::kV + row) = -G.dphi_platform[row][i];
      Q(7 + i, State::kV + row) = -G.dgamma_platform[row][i];
    }
    Q(3 + i, State::kPhi + i) = by_phi.dphi[i];
    Q(7 + i, State::kPhi + i) = by_phi.dgamma[i];
    Q(3 + i, State::kDphi + i) = -G.dphi_dphi[i];
    Q(3 + i, State::kDgamma + i) = Q(7 + i, State::kDphi + i) = -G.dphi_dgamma[i];
    Q(7 + i, State::kDgamma + i) = -G.dgamma_dgamma[i];
  }
  const PlatformMatrix C = model_.inertia().coriolis_derivative(u.v);
  for (int row = 0; row < 3; ++row) {
    for (int k = 0; k < 3; ++k) Q(row, State::kV + k) += C[k][row];
  }
  return Q;
}

template <class Model>
template <class Matrix>
void SlipSystem<Model>::jacobian(const State& x, Matrix& J, double t, State& dfdt) const {
  if constexpr (Model::kClosedJacobian) {
    closed_jacobian(x, J, t, dfdt);
  } else {
    difference_jacobian(x, J, t, dfdt);
  }
}

template <class Model>
template <class Matrix>
void SlipSystem<Model>::difference_jacobian(const State& x, Matrix& J, double t, State& dfdt) const {
  State step;
  const Velocities turning = regularization_velocities(model_);
  const double slip = std::isfinite(turning.v[0]) ? 1 : 0;
  step.values.setConstant(kDifference);
  if (slip != 0) {
    step.values.col(1) = (1e-3 * turning.v).min(kDifference);
    step.dphi() = (1e-3 * turning.dphi).min(kDifference);
    step.dgamma() = (1e-3 * turning.dgamma).min(kDifference);
  }
  const auto difference = [&](const State& below, const State& above, double t_below, double t_above, double width) {
    State low, high;
    (*this)(below, low, t_below);
    (*this)(above, high, t_above);
    high.values = (high.values - low.values) / width;
    return high;
  };
  for (int column = 0; column < State::kSize; ++column) {
    State below = x, above = x;
    below.begin()[column] -= step.begin()[column];
    above.begin()[column] += step.begin()[column];
    const State slope = difference(below, above, t, t, above.begin()[column] - below.begin()[column]);
    for (int row = 0; row < State::kSize; ++row) J(row, column) = slope.begin()[row];
  }
  // Torque may jump at t: only what follows counts.
  dfdt = difference(x, x, t, t + kDifference, kDifference);
}

template <class Model>
template <class Matrix>
void SlipSystem<Model>::closed_jacobian(const State& x, Matrix& J, double t, State& dfdt) const {
  const Inertia& inertia = model_.inertia();
  const Velocities u = x.velocities();
  const Wheels M = torque_->value(t);
  const Contacts c = contacts(u, x.phi(), pose(x), M);
  ForceJacobian Q = force_jacobian(x, c, M);
  // d(u . Q)/dx, the power's, from the forces before they become accelerations.
  const Velocities F = model_.forces(u, c, M);
  Eigen::Matrix<double, 11, 1> velocities, forces;
  velocities << u.v.head<3>(), u.dphi, u.dgamma;
  forces << F.v.head<3>(), F.dphi, F.dgamma;
  Eigen::Matrix<double, 1, State::kSize> power_by_state = velocities.transpose() * Q;
  power_by_state.segment<3>(State::kV) += forces.head<3>().transpose();
  power_by_state.segment<4>(State::kDphi) += forces.segment<4>(3).transpose();
  power_by_state.segment<4>(State::kDgamma) += forces.tail<4>().transpose();
  Q.topRows<3>() = (inertia.M_v_inverse * Q.topRows<3>()).eval();
  Q.middleRows<4>(3) *= 1 / inertia.J_1;
  Q.bottomRows<4>() *= 1 / inertia.J_2;

  const double cos_psi = std::cos(x.psi()), sin_psi = std::sin(x.psi());
  for (int row = 0; row < State::kSize; ++row) {
    for (int column = 0; column < State::kSize; ++column) J(row, column) = 0;
  }
  J(State::kX, State::kPsi) = -(u.v[0] * sin_psi + u.v[1] * cos_psi);
  J(State::kY, State::kPsi) = u.v[0] * cos_psi - u.v[1] * sin_psi;
  J(State::kX, State::kV) = J(State::kY, State::kV + 1) = cos_psi;
  J(State::kX, State::kV + 1) = -sin_psi;
  J(State::kY, State::kV) = sin_psi;
  J(State::kPsi, State::kOmega) = 1;
  for (int i = 0; i < kWheels; ++i) J(State::kPhi + i, State::kDphi + i) = J(State::kGamma + i, State::kDgamma + i) = 1;
  for (int column = 0; column < State::kSize; ++column) {
    J(State::kWork, column) = power_by_state[column];
    for (int row = 0; row < 3; ++row) J(State::kV + row, column) = Q(row, column);
    for (int i = 0; i < kWheels; ++i) {
      J(State::kDphi + i, column) = Q(3 + i, column);
      J(State::kDgamma + i, column) = Q(7 + i, column);
    }
  }
  time_derivative(u, c, M, torque_->derivative(t), dfdt);
}

template <class Model>
void SlipSystem<Model>::time_derivative(const Velocities& u, const Contacts& c, const Wheels& M, const Wheels& M_rate,
                                        State& dfdt) const {
  const Inertia& inertia = model_.inertia();
  // Torque acts on dphi; where the contact is shared, through the shares of its rollers.
  Velocities Q_rate = {Wheels::Zero(), M_rate, Wheels::Zero()};
  for (int i = 0; i < kWheels; ++i) {
    if (!modes_.shared(i)) continue;
    const Eigen::Vector4d by_torque = shared_contact(i, u, c, M).torque_derivative();
    Q_rate.v.template head<3>() += M_rate[i] * by_torque.head<3>().array();
    Q_rate.dphi[i] = 0;
    Q_rate.dgamma[i] = M_rate[i] * by_torque[3];
  }
  dfdt.values.setZero();
  dfdt.work() = power(u, Q_rate);
  dfdt.values.col(1).template head<3>() = (inertia.M_v_inverse * Q_rate.v.template head<3>().matrix()).array();
  dfdt.dphi() = Q_rate.dphi * (1 / inertia.J_1);
  dfdt.dgamma() = Q_rate.dgamma * (1 / inertia.J_2);
}

}  // namespace youbot_base_sim
