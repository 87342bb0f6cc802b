#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "youbot_base_sim/physics/roller_switch.h"
#include "youbot_base_sim/physics/shared_contact.h"
#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// The equations of motion of models 2a and 2b under given wheel torques, for the rollers that are in contact now: what
/// odeint calls a System, with the edges at which the contacts change.
///
/// A wheel is in one of three contacts:
///   - on one roller, between that roller's two edges;
///   - shared between two rollers, on the edge between them (Filippov's sliding mode, see SharedContact);
///   - averaged over its rollers, when it passes them faster than kMaxLocatedRate.
///
/// As a System:       system(x, dxdt, t), system.jacobian(x, J, t, dfdt)
/// As edges:          lower_edge(), upper_edge(), and hand_over(i, k, x), the effect of crossing one
/// As sliding mode:   attractive(i, x, t), momentum(i, x), enter_sliding(i, k, x), alpha(i, x, t), put(i, k)
/// As bounds:         max_step(x); watches(), ends_tipping(), tips(x, t), watch(x, t, dt) of normal reactions
/// As averaging:      too_fast(i, x), slow_again(i, x), average(i), follow(i, x), put(i, k)
template <class Model>
class SlipSystem {
 public:
  using Contacts = typename Model::Contacts;
  using Mask = WheelMask;

  /// `torque` must outlive the system. The rollers in contact are those on which `state` stands.
  SlipSystem(const Model& model, const TorqueProfile& torque, const State& state)
      : model_(model),
        torque_(&torque),
        max_located_dphi_(kMaxLocatedRate * model.geometry().pitch()),
        resting_angle_(static_cast<std::size_t>(kWheels * model.robot().rollers), 0.0) {
    for (int i = 0; i < kWheels; ++i) put(i, model.geometry().roller_at(state.phi()[i]));
  }

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
    if (mixed() || reacts()) return any_contacts(u, phi, pose, M, shared_, c);
    own_contacts(u, phi, pose, c);
  }
  /// The same at three stages at once. What is rare stays out of the loop.
  void contacts(const std::array<Velocities, 3>& u, const std::array<Wheels, 3>& phi, const std::array<Pose, 3>& pose,
                const std::array<Wheels, 3>& M, std::array<Contacts, 3>& c) const {
    if (mixed() || reacts()) {
      for (int j = 0; j < 3; ++j) any_contacts(u[j], phi[j], pose[j], M[j], shared_, c[j]);
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
    press(u, M, shared_, c, [&](Contacts& pressed) { model_.put_friction(known, F, pressed); });
  }
  /// Pose of x, if it matters.
  Pose pose(const State& x) const { return model_.features().by_pose() ? x.pose() : Pose(); }
  Contacts contacts(const State& x, double t) const {
    return contacts(x.velocities(), x.phi(), pose(x), torque_->value(t));
  }

  /// Sets `c` to the contacts at the velocities u with wheel angles, pose and normal reactions of x, where they are
  /// `at_x`. No contact may be shared.
  void contacts_near(const State& x, const Contacts& at_x, const Velocities& u, Contacts& c) const {
    model_.place(u, geometry(x.phi()), pose(x), c);
    model_.press_like(at_x, c);
  }

  /// Damping matrix at these contacts, for the friction F.
  void damping(const Velocities& u, const Contacts& c, const typename Model::Friction& F, const Wheels& M,
               DampingMatrix& G) const {
    model_.damping(u, c, F, G);
    if (shares_) put_shared(u, c, M, G);
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
    model_.press(Wheels::Ones(), unit);
    ContactByReaction by_reaction = model_.by_reaction(unit);
    if (shares_) share_reactions(u, M, shared_, unit, by_reaction);
    model_.couple(c, by_reaction, G, coupling);
  }

  /// Lets the base carry other loads and feel other wrenches from now on.
  void set_burden(const Burden& burden) { model_.set_burden(burden); }

  // Normal reactions, of models that know them.

  /// Whether they must be looked at after each step.
  bool watches() const { return reacts(); }

  /// Whether the motion ends where the base reaches its tipping limit.
  bool ends_tipping() const { return watches() && !goes_on_tipping_; }

  /// Whether the base is at its tipping limit.
  bool tips(const State& x, double t) const {
    if constexpr (Model::kReactionsFollow) return contacts(x, t).tipping != Side::kNone;
    return false;
  }

  /// Looks at the end x of a step from `t - dt` to t, s. Throws TippedOver at the tipping limit unless told to go on.
  void watch([[maybe_unused]] const State& x, [[maybe_unused]] double t, [[maybe_unused]] double dt) {
    if constexpr (Model::kReactionsFollow) {
      const Contacts c = contacts(x, t);
      record_.least_N = record_.least_N.min(c.N);
      record_.time_off_floor += (c.N <= 0).select(Wheels::Constant(dt), Wheels::Zero());
      const bool tipped_before = record_.tipping != Side::kNone;
      record_.tipping = c.tipping;
      if (c.tipping == Side::kNone) return;
      if (!goes_on_tipping_) throw TippedOver(t, c.tipping);
      if (!tipped_before) record_.tipped_at = t;
      record_.tipped = c.tipping;
      record_.time_at_limit += dt;
    }
  }
  const ReactionRecord& reaction_record() const { return record_; }
  void go_on_tipping() { goes_on_tipping_ = true; }

  /// The longest step from x (s) that friction, which changes from place to place, allows.
  double max_step(const State& x) const {
    if (!model_.features().by_patches()) return std::numeric_limits<double>::infinity();
    return model_.features().max_step(x, geometry(x.phi()).Delta_Y);
  }

  // Edges.

  /// Wheel angles between which each wheel stays in its contact, [lower, upper), rad; infinite for shared and averaged
  /// contacts.
  const Wheels& lower_edge() const { return lower_edge_; }
  const Wheels& upper_edge() const { return upper_edge_; }

  /// Unwrapped number of the roller on which wheel i stands; of two, the one that it reached last.
  std::int64_t roller(int i) const { return roller_[i]; }
  int rollers() const { return model_.robot().rollers; }

  /// Stands wheel i on roller k (unwrapped number).
  void put(int i, std::int64_t k) {
    ++contact_ids_[i];
    roller_[i] = k;
    shared_[i] = averaged_[i] = false;
    shares_ = shared_.any();
    averages_ = averaged_.any();
    phi_center_[i] = static_cast<double>(k) * model_.geometry().pitch();
    lower_edge_[i] = model_.geometry().upper_edge(k - 1);
    upper_edge_[i] = model_.geometry().upper_edge(k);
  }

  /// The effect of a switch: wheel i of state x goes over to roller k. The roller that leaves the floor keeps its
  /// angle; the new one starts at the angle that it left the floor with, and with the rate that RollerRateAtSwitch
  /// says.
  void hand_over(int i, std::int64_t k, State& x) {
    const int n = rollers();
    resting_angle_[index(i, wrapped(roller_[i], n))] = x.gamma()[i];
    x.gamma()[i] = resting_angle_[index(i, wrapped(k, n))];
    put(i, k);
    if (model_.robot().roller_rate_at_switch == RollerRateAtSwitch::kContinuous) return;
    // The bearing of the roller that leaves takes its energy.
    x.work() -= 0.5 * model_.robot().J_2 * x.dgamma()[i] * x.dgamma()[i];
    x.dgamma()[i] = 0;
  }

  /// Angle about its own axis at which roller k (0 .. n-1) of wheel i left the floor, rad.
  double resting_angle(int i, int k) const { return resting_angle_[index(i, k)]; }
  void set_resting_angle(int i, int k, double angle) { resting_angle_[index(i, k)] = angle; }

  // Sliding mode.

  bool shares() const { return shares_; }
  bool shared(int i) const { return shared_[i]; }
  const Mask& shared() const { return shared_; }
  /// The lower one of the two rollers of a shared contact, unwrapped.
  std::int64_t lower_roller(int i) const { return lower_roller_[i]; }

  /// Whether the rollers on both sides of the edge at which wheel i stands would drive it back there.
  bool attractive(int i, const State& x, double t) const {
    Velocities u = x.velocities();
    u.dphi[i] = 0;
    Mask shared = shared_;
    shared[i] = true;
    return shared_contact(i, u, x, shared, torque_->value(t)).attractive();
  }

  /// Share of the upper roller of the shared contact of wheel i; the contact holds while it lies in [0, 1].
  double alpha(int i, const State& x, double t) const {
    return shared_contact(i, x.velocities(), x, shared_, torque_->value(t)).alpha();
  }

  /// Stands wheel i, which is at the upper edge of roller k, on rollers k and k + 1. What momentum it had goes to the
  /// platform, through the contact that took it.
  void enter_sliding(int i, std::int64_t k, State& x);

  /// Change of the platform's speed if wheel i gave up its momentum, m/s.
  double momentum(int i, const State& x) const {
    const RobotParameters& robot = model_.robot();
    return robot.J_1 * std::abs(x.dphi()[i]) / (robot.R * robot.m_s());
  }

  // Averaging.

  bool averages() const { return averages_; }
  bool averaged(int i) const { return averaged_[i]; }

  /// Whether wheel i passes rollers too fast for its switches to be located; whether, averaged, it no longer does.
  bool too_fast(int i, const State& x) const { return std::abs(x.dphi()[i]) > max_located_dphi_; }
  bool slow_again(int i, const State& x) const {
    return averaged_[i] && std::abs(x.dphi()[i]) < kResolve * max_located_dphi_;
  }

  /// Averages the contact of wheel i over its rollers.
  void average(int i) {
    ++contact_ids_[i];
    shared_[i] = false;
    shares_ = shared_.any();
    averaged_[i] = averages_ = true;
    phi_center_[i] = std::numeric_limits<double>::infinity();
    lower_edge_[i] = -std::numeric_limits<double>::infinity();
    upper_edge_[i] = std::numeric_limits<double>::infinity();
  }

  /// Moves the roller number of wheel i, whose contact is averaged, to the roller at the wheel's angle. All its rollers
  /// share the angle and rate gamma and dgamma meanwhile; RollerRateAtSwitch has no effect.
  void follow(int i, const State& x) { roller_[i] = model_.geometry().roller_at(x.phi()[i]); }

  /// A number for each wheel that changes whenever its contact does.
  using ContactIds = Eigen::Array<std::int64_t, kWheels, 1>;
  const ContactIds& contact_ids() const { return contact_ids_; }

  const Model& model() const { return model_; }
  const TorqueProfile& torque() const { return *torque_; }

  /// The transition speed nu of the friction, m/s.
  double transition_speed() const { return model_.transition_speed(); }
  void set_transition_speed(double nu) { model_.set_transition_speed(nu); }

  /// Evaluations of the right-hand side so far.
  std::uint64_t evaluations() const { return evaluations_; }
  void count_evaluations(std::uint64_t more) const { evaluations_ += more; }

 private:
  // An averaged contact is resolved again at this share of the rate at which it was averaged, so that it does not flip.
  static constexpr double kResolve = 0.8;

  std::size_t index(int i, int k) const { return static_cast<std::size_t>(i * rollers() + k); }

  // Whether some contacts are averaged or shared.
  bool mixed() const { return shares_ || averages_; }
  // Where each wheel stands on a roller of its own, under the normal reactions of the base at rest.
  void own_contacts(const Velocities& u, const Wheels& phi, const Pose& pose, Contacts& c) const {
    model_.place(u, model_.geometry().at(phi - phi_center_), pose, c);
    model_.press_at_rest(c);
  }
  // Anywhere, where the contacts in `shared` are shared.
  [[gnu::flatten, gnu::noinline]] void any_contacts(const Velocities& u, const Wheels& phi, const Pose& pose,
                                                    const Wheels& M, const Mask& shared, Contacts& c) const {
    model_.place(u, averages_ ? geometry(phi) : model_.geometry().at(phi_tilde(phi)), pose, c);
    press(u, M, shared, c, [](const Contacts&) {});
  }
  // Presses contacts that have their place; `amend` may change their friction before reactions follow from it.
  template <class Amend>
  void press(const Velocities& u, const Wheels& M, const Mask& shared, Contacts& c, const Amend& amend) const {
    if (reacts()) {
      press_by_motion(u, M, shared, c, amend);
    } else {
      model_.press_at_rest(c);
      amend(c);
    }
    if (shared.any()) share_contacts(u, M, shared, c);
  }
  template <class Amend>
  void press_by_motion(const Velocities& u, const Wheels& M, const Mask& shared, Contacts& c,
                       const Amend& amend) const {
    if constexpr (Model::kReactionsFollow) {
      model_.press(Wheels::Ones(), c);
      amend(c);
      ContactByReaction by_reaction = model_.by_reaction(c);
      if (shared.any()) share_reactions(u, M, shared, c, by_reaction);
      model_.scale_by_reactions(model_.reactions(u, M, c, by_reaction), c);
    }
  }
  [[gnu::noinline]] void share_reactions(const Velocities& u, const Wheels& M, const Mask& shared, const Contacts& unit,
                                         ContactByReaction& by_reaction) const {
    const Wheels zero = Wheels::Zero();
    by_reaction.constant = {zero, zero, zero, zero, zero};
    by_reaction.shares = true;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, unit, M).put(by_reaction);
    }
  }
  [[gnu::noinline]] void share_contacts(const Velocities& u, const Wheels& M, const Mask& shared, Contacts& c) const {
    const Contacts pressed = c;
    for (int i = 0; i < kWheels; ++i) {
      if (shared[i]) shared_contact(i, u, pressed, M).put(c);
    }
  }

  // The shared contact of wheel i at the pose and normal reactions of `c`.
  SharedContact<Model> shared_contact(int i, const Velocities& u, const Contacts& c, const Wheels& M) const {
    const Wheels half = Wheels::Constant(0.5 * model_.geometry().pitch());
    Contacts lower, upper;
    model_.place_beside(c, u, model_.geometry().at(half), lower);
    model_.place_beside(c, u, model_.geometry().at(-half), upper);
    model_.press_like(c, lower);
    model_.press_like(c, upper);
    return {model_, i, u, M[i], lower, upper};
  }
  // The same at the wheel angles and pose of x, with the velocities u.
  SharedContact<Model> shared_contact(int i, const Velocities& u, const State& x, const Mask& shared,
                                      const Wheels& M) const {
    Contacts c;
    any_contacts(u, x.phi(), pose(x), M, shared, c);
    return shared_contact(i, u, c, M);
  }

  // Angle of each wheel from where its roller points straight down, rad; 0 where the contact is averaged.
  Wheels phi_tilde(const Wheels& phi) const { return averaged_.select(Wheels::Zero(), phi - phi_center_); }
  ContactGeometry geometry(const Wheels& phi) const;

  // The Jacobian of the paper's equations in closed form; that of those beyond by central differences.
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

  [[gnu::noinline]] void put_shared(const Velocities& u, const Contacts& c, const Wheels& M, DampingMatrix& G) const {
    for (int i = 0; i < kWheels; ++i) {
      if (shared_[i]) shared_contact(i, u, c, M).put(G);
    }
  }

  Model model_;
  const TorqueProfile* torque_;
  double max_located_dphi_;  // rad/s
  std::array<std::int64_t, kWheels> roller_{}, lower_roller_{};
  ContactIds contact_ids_ = ContactIds::Zero();
  Mask shared_ = Mask::Constant(false), averaged_ = Mask::Constant(false);
  bool shares_ = false, averages_ = false;  // whether any is
  alignas(kAlignment) Wheels phi_center_;   // wheel angles at which the rollers in contact point straight down, rad
  Wheels lower_edge_, upper_edge_;
  std::vector<double> resting_angle_;
  ReactionRecord record_;
  bool goes_on_tipping_ = false;
  mutable std::uint64_t evaluations_ = 0;
};

template <class Model>
ContactGeometry SlipSystem<Model>::geometry(const Wheels& phi) const {
  const ContactGeometry mean = model_.geometry().mean();
  ContactGeometry g = model_.geometry().at(phi_tilde(phi));
  for (Wheels ContactGeometry::*entry : {&ContactGeometry::Delta_Y, &ContactGeometry::dDelta_Y, &ContactGeometry::r_X,
                                         &ContactGeometry::dr_X, &ContactGeometry::r_Y, &ContactGeometry::dr_Y}) {
    g.*entry = averaged_.select(mean.*entry, g.*entry);
  }
  return g;
}

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
  phi_center_[i] = static_cast<double>(k) * model_.geometry().pitch();
  lower_edge_[i] = -std::numeric_limits<double>::infinity();
  upper_edge_[i] = std::numeric_limits<double>::infinity();
  shared_[i] = shares_ = true;
  lower_roller_[i] = k;
  ++contact_ids_[i];
}

template <class Model>
typename SlipSystem<Model>::ForceJacobian SlipSystem<Model>::force_jacobian(const State& x, const Contacts& c,
                                                                            const Wheels& M) const {
  const Velocities u = x.velocities();
  AngleStiffness by_phi = model_.angle_stiffness(u, geometry(x.phi()), c);
  DampingMatrix G;
  model_.damping(u, c, G);
  if (shares_) {
    put_shared(u, c, M, G);
    for (Wheels* entry :
         {&by_phi.platform[0], &by_phi.platform[1], &by_phi.platform[2], &by_phi.dphi, &by_phi.dgamma}) {
      *entry = shared_.select(Wheels::Zero(), *entry);  // phi stays on the edge
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
  const Velocities turning = transition_velocities(model_);
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
    if (!shared_[i]) continue;
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
