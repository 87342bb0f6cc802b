#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/radau_tableau.h"
#include "youbot_base_sim/integration/reacting_stages.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/step_size_controller.h"
#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Radau IIA with three stages, of order 5, for a SlipSystem between two switches: a Controlled Stepper of odeint.
///
/// Newton iterations find the velocities at the stages; positions, heading and work are integrals of these. Each stage
/// has its own friction in the Jacobian: with one for all (Hairer and Wanner), the iterations fail where a wheel goes
/// from gripping to slipping within a step. Where they still fail, the regularization speed is raised, and then lowered
/// step by step (continuation).
///
/// A linearly implicit method needs no iterations, but steps by the derivatives at the start, and friction at slip
/// speeds near nu turns within a step. Near sticking Radau's error is about a thousand times smaller.
///
/// It remembers the last step, to predict the next one and to reuse its friction. Contacts may change between steps;
/// call `reset` where the torque jumps. The functions that do the work are marked `flatten`: what they call is small.
template <class Model>
class Radau final : public SmoothStepper<SlipSystem<Model>> {
 public:
  using Result = ControlledStepperTypes::Result;
  using SmoothStepper<SlipSystem<Model>>::try_step;

  /// Counts its iterations in `statistics`, which must outlive it.
  Radau(const Tolerance& tolerance, IntegrationStatistics& statistics)
      : tolerance_(tolerance), statistics_(&statistics) {}
  Radau(const Radau&) = delete;
  Radau& operator=(const Radau&) = delete;

  /// A step that is shorter than one whose error was small enough, from the same start, is not judged again; nor is one
  /// that the rounding of t lets be no shorter.
  Result try_step(SlipSystem<Model>& system, const State& in, double& t, State& out, double& dt) override {
    using boost::numeric::odeint::fail;
    if (!started_ || !starts_at(in, t)) initialize(system, in, t);
    const double length = dt, shortest = kTimeRounding * std::abs(t);
    const bool judged = !(length <= accepted_dt_);
    if (!solve(system, dt, judged && length > shortest)) {
      dt *= kShrinkage;
      return fail;
    }
    if (judged) {
      const double error = hopeless_error_ > 0 ? hopeless_error_ : this->error(system);
      dt = std::max(control_.next(dt, error), shortest);
      if (!(error <= 1) && !(length <= shortest && std::isfinite(error))) {
        filters_twice_ = true;
        return fail;
      }
      accepted_dt_ = length;
    }
    end(dt_, stages_, out);
    t += length;
    return boost::numeric::odeint::success;
  }

  /// By the collocation polynomial of the velocities and one of the friction, which wheels and rollers follow where
  /// they grip: an O(h^4) error of the slip would be a large one of the friction.
  bool interpolates() const override { return true; }
  [[gnu::noinline]] void state_within(const SlipSystem<Model>& system, double share, State& x) const override {
    StageVelocities u;
    for (int j = 0; j < 3; ++j) {
      u[j] = weighted(lagrange_weights(share * RadauTableau::c[j]), start_, stages_);
    }
    end(share * dt_, u, x);
    follow_friction_within(system, share, x, u[2]);
    x.set(u[2]);
    // That of its accelerations. Forces are less accurate: what friction is off by does no work at the stages alone.
    x.work() = x_.work() + 0.5 * dot(u[2] - start_, system.model().inertia() * (u[2] + start_));
  }

  /// Forgets the derivative at the start and the errors of the steps before: the torque jumps.
  void reset() override {
    started_ = false;
    end_t_ = kUnknown;
    control_.restart();
  }

  void restart() override {
    started_ = false;
    end_t_ = kUnknown;
    control_ = StepSizeController();
    known_ = Known::kNothing;
    rate_ = kFirstRate;
    curvature_ = kFirstCurvature;
    end_contact_ids_.setConstant(-1);  // none
  }

 private:
  using Contacts = typename Model::Contacts;
  using Friction = typename Model::Friction;
  using ContactStiffnesses = std::array<Wheels, RadauTableau::stages>;
  using StageContacts = std::array<Contacts, RadauTableau::stages>;
  struct Evaluation {
    StageContacts contacts;
    std::array<typename Model::Stiffness, RadauTableau::stages> stiffness;
  };
  using StageVelocities = std::array<Velocities, RadauTableau::stages>;
  enum class Known { kNothing, kThisStep, kStepBefore };

  static constexpr int kMaxIterations = 25;
  static constexpr double kMinLength = 1.0 / 16;  // of a damped correction
  static constexpr int kFreeIterations = 4;
  static constexpr double kFreeGrowth = 4;    // of their corrections
  static constexpr double kConverged = 0.03;  // of the tolerance
  // How small an error of the slip rounding lets iterations reach, m/s; with dynamic reactions
  static constexpr double kRounding = 3e-16, kReactingRounding = 1e-12;
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  static constexpr double kTimeRounding = 1e-15;  // of t, as control periods count it
  static constexpr double kShrinkage = 0.3;       // of a step after iterations that failed
  // The smallest rate of convergence that the next step's first correction is expected to have, judging by this step
  static constexpr double kMinRate = 0.03;
  static constexpr double kFirstRate = 0.1;
  // Of a correction over the square of the one before it, in convergence tolerances: the largest one of late counts.
  static constexpr double kFirstCurvature = 1, kForgetting = 0.8, kCurvatureMargin = 10;
  // Of nu. Friction may turn in a larger correction: how fast corrections shrank before does not tell the next one.
  static constexpr double kForeseeable = 0.1;
  // The error of a step that is not worth further iterations, and the first correction, in convergence tolerances, from
  // which on it is worth estimating at once.
  static constexpr double kHopeless = 1.5, kFarOff = 3000;
  static constexpr double kExpected = 0.03;  // of the limit of friction, may a correction leave it off
  // How many times stiffer than elsewhere in the step a contact is at its end when its friction turns there
  static constexpr double kTransientStiffnessRatio = 4;
  // How many times the error of the pose counts less than those of the velocities: its estimate's order is lower by
  // two.
  static constexpr double kPoseShare = 30;
  // Continuation: the slip speed at which it begins, m/s, and the ratio of one to the next.
  static constexpr double kFirstRegularizationSpeed = 1e-2;
  static constexpr double kRegularizationRatio = 0.2, kMaxRegularizationRatio = 0.7;

  // Of two buffers the one that is not `used`: what the last correction began with stays without a copy.
  template <class T>
  static T* other(T (&buffers)[2], const T* used) {
    return &buffers[used == &buffers[0]];
  }

  bool starts_at(const State& x, double t) const {
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the very same bits are meant
    return t == t_ && std::memcmp(x.begin(), x_.begin(), sizeof x.values) == 0;
  }

  // Steps that follow start from x at time t.
  [[gnu::flatten, gnu::noinline]] void initialize(const SlipSystem<Model>& system, const State& x, double t) {
    if (known_ == Known::kThisStep && !starts_at(x, t)) accept();
    const WheelMask unchanged = system.modes().ids() == end_contact_ids_;
    after_switch_ = !unchanged.all();
    friction_lasts_ = after_switch_ && known_ == Known::kStepBefore && unchanged.any() && !system.modes().mixed();
    if (after_switch_) {  // another contact: the step before does not predict this one
      known_ = Known::kNothing;
      control_.restart();
    }
    started_ = true;
    filters_twice_ = after_switch_;
    accepted_dt_ = 0;
    x_ = x;
    t_ = t;
    contact_ids_ = system.modes().ids();
    start_ = x.velocities();
    const bool goes_on = std::abs(t - end_t_) <= kTimeRounding * std::abs(t);  // where the last step ended
    const Wheels M = goes_on ? torque_[2] : system.torque().value(t);
    start_pose_ = system.pose(x);
    if (known_ == Known::kStepBefore && goes_on && !system.modes().mixed()) {
      start_forces_ = forces_by_motion(system, 2, before_);
      start_friction_ = end_friction_;
    } else {
      evaluate_start(system, M, unchanged);
    }
    error_scale_ = allowed_errors(system.model());
    set_convergence_tolerance(system);
  }

  // The errors that count as 1. A roller counts a third of what it does for other methods, since this one damps its
  // errors too. The rim of a wheel that hardly turns may be off by a tenth of what the platform may be, unless dry
  // friction turns there.
  Velocities allowed_errors(const Model& model) const {
    constexpr double kRollerScale = 3, kRimScale = 0.1;
    Velocities scale = error_scale(tolerance_, start_);
    if (!model.dry_bearings().any()) {
      const Wheels relative = scale.v - tolerance_.absolute;
      scale.dphi = scale.dphi.max(tolerance_.absolute + kRimScale / model.robot().R * relative);
    }
    scale.dgamma *= kRollerScale;
    return scale;
  }

  // Forces at stage j by its equation, for a step that starts with the velocities `start`.
  Velocities forces_by_motion(const SlipSystem<Model>& system, int j, const Velocities& start) const {
    return system.model().inertia() *
           (D_[j][0] * (stages_[0] - start) + D_[j][1] * (stages_[1] - start) + D_[j][2] * (stages_[2] - start));
  }

  // Forces and friction at the start under the torques M; contacts that are `unchanged` have the friction of the last
  // step's end.
  void evaluate_start(const SlipSystem<Model>& system, const Wheels& M, const WheelMask& unchanged) {
    if (system.model().inertia().J_2 == 0 && !unchanged.all()) {
      start_.dgamma = system.massless_roller_rates(start_, x_.phi(), start_pose_, M, system.modes().shared());
    }
    Contacts contacts = system.contacts(start_, x_.phi(), start_pose_, M);
    system.count_evaluations(1);
    // The converged friction: recomputed from the slip, its O(nu) error would become an O(1) error of the force.
    if (unchanged.any()) {
      system.reuse_friction(unchanged && !system.modes().shared(), end_friction_, start_, M, contacts);
    }
    start_forces_ = system.model().forces(start_, contacts, M);
    start_friction_ = system.model().friction(contacts);
  }

  // At most a fraction of the regularization speed, however large the tolerance. Prescribed wheels do work against
  // friction: its error must be within the tolerance of the energy balance.
  void set_convergence_tolerance(const SlipSystem<Model>& system) {
    Velocities turning = regularization_velocities(system.model());
    if (system.model().robot().wheels_prescribed) {
      const double rounding = (system.reacts() ? kReactingRounding : kRounding) / (kConverged * turning.v[0]);
      turning = std::min(1.0, std::max(1e3 * tolerance_.relative, rounding)) * turning;
    }
    per_tolerance_ = {1 / (kConverged * error_scale_.v.min(turning.v)),
                      1 / (kConverged * error_scale_.dphi.min(turning.dphi)),
                      1 / (kConverged * error_scale_.dgamma.min(turning.dgamma))};
    foreseeable_ = kForeseeable * system.model().regularization_speed() * per_tolerance_.v[0];
  }

  // The last step stands: the next one is predicted from it.
  void accept() {
    known_ = Known::kStepBefore;
    began_after_switch_ = after_switch_;
    before_ = start_;
    friction_before_ = start_friction_;
    end_friction_ = friction_[2];
    end_contact_ids_ = contact_ids_;
  }

  // Finds the stages of a step of length dt, unless it is `judged` and hopeless. False without convergence, or if the
  // platform would turn by over 1 rad.
  bool solve(SlipSystem<Model>& system, double dt, bool judged) {
    if (known_ != Known::kNothing) predict(system, dt);
    if ((known_ == Known::kNothing || !iterate(system, dt, judged)) && !iterate_from_start(system, dt, judged) &&
        !continue_to_regularization_speed(system, dt)) {
      known_ = Known::kNothing;
      return false;
    }
    known_ = Known::kThisStep;
    return dt * std::max({std::abs(stages_[0].v[2]), std::abs(stages_[1].v[2]), std::abs(stages_[2].v[2])}) < 1;
  }

  // A step that is longer than the transient after a switch begins with the friction before it, also where the contact
  // is another.
  bool iterate_from_start(const SlipSystem<Model>& system, double dt, bool judged) {
    constexpr double kTransient = 1e-4;  // s
    const bool outlasts = friction_lasts_ && dt > kTransient;
    stages_.fill(start_);
    friction_.fill(outlasts ? end_friction_ : start_friction_);
    if (outlasts) follow_friction(system, dt);
    return iterate(system, dt, judged);
  }

  // A larger regularization speed is easier to solve for, and its solution is a good start for a smaller one. Where the
  // next speed is too small, one nearer to the last is tried.
  [[gnu::noinline]] bool continue_to_regularization_speed(SlipSystem<Model>& system, double dt) {
    const double nu = system.model().regularization_speed();
    if (!(nu < kFirstRegularizationSpeed)) return false;
    stages_.fill(start_);
    friction_.fill(start_friction_);
    StageVelocities solved = stages_;
    std::array<Friction, 3> solved_friction = friction_;
    double speed = kFirstRegularizationSpeed, ratio = kRegularizationRatio, last = 0;
    bool converged = false;
    for (;;) {
      system.set_regularization_speed(speed);
      set_convergence_tolerance(system);
      converged = iterate(system, dt, false);
      if (converged) {
        if (speed <= nu) break;
        last = speed;
        solved = stages_;
        solved_friction = friction_;
      } else {
        ratio = std::sqrt(ratio);
        if (last == 0 || ratio > kMaxRegularizationRatio) break;
        stages_ = solved;
        friction_ = solved_friction;
      }
      speed = std::max(nu, ratio * last);
    }
    system.set_regularization_speed(nu);
    set_convergence_tolerance(system);
    return converged;
  }

  // State at the end of a step of length dt with these velocities at the stages.
  [[gnu::flatten, gnu::noinline]] void end(double dt, const StageVelocities& stages, State& x) const {
    using T = RadauTableau;
    x = x_;
    x.set(stages[2]);
    // Heading at the stages, from the step's start.
    const auto column = [](int l) { return Wheels{T::A[0][l], T::A[1][l], T::A[2][l], 0}; };
    const Wheels heading = dt * (column(0) * stages[0].v[2] + column(1) * stages[1].v[2] + column(2) * stages[2].v[2]);
    const auto [sine, cosine] = small_sine_and_cosine(heading);
    double along = 0, across = 0, work = 0;
    for (int j = 0; j < 3; ++j) {
      const Velocities& u = stages[j];
      const double b = dt * T::A[2][j];
      along += b * (u.v[0] * cosine[j] - u.v[1] * sine[j]);
      across += b * (u.v[0] * sine[j] + u.v[1] * cosine[j]);
      work += b * dot(u, forces_[j]);
      x.phi() += b * u.dphi;
      x.gamma() += b * u.dgamma;
    }
    const auto [sin_psi, cos_psi] = sine_and_cosine(x_.psi());
    x.x() += along * cos_psi - across * sin_psi;
    x.y() += along * sin_psi + across * cos_psi;
    x.psi() += heading[2];
    x.work() += work;
  }

  // Estimate of the step's error in units of what is allowed: 1 where it is just allowed.
  [[gnu::flatten, gnu::noinline]] double error(const SlipSystem<Model>& system) {
    using T = RadauTableau;
    const Velocities change = (T::error[0] / dt_) * (stages_[0] - start_) +
                              (T::error[1] / dt_) * (stages_[1] - start_) + (T::error[2] / dt_) * (stages_[2] - start_);
    const Inertia& inertia = system.model().inertia();
    const ContactStiffnesses stiffness = {damping_[0].contact_stiffness(), damping_[1].contact_stiffness(),
                                          damping_[2].contact_stiffness()};
    std::array<DampingMatrix, 1> damping = {damping_[2]};
    limit_transient_damping(stiffness, damping[0]);
    filter_.factorize({{T::gamma / dt_}}, inertia, damping, {{coriolis_[2]}});
    std::array<Velocities, 1> error;
    filter_.solve({start_forces_ + inertia * change}, error);
    if (inertia.J_2 == 0) error[0].dgamma.setZero();  // follows from the other velocities
    double norm = error_norm(error[0], error_scale_);
    if (norm > 1 && filters_twice_ && has_seen_energy(inertia)) norm = norm_filtered_again(inertia, error);
    return std::max(norm, error_of_pose() * (turns_within(stiffness) ? kPoseShare : 1));
  }

  // Of components that decay within the step, the filtered error counts although they have no effect on its end.
  [[gnu::noinline]] double norm_filtered_again(const Inertia& inertia, std::array<Velocities, 1>& error) const {
    filter_.solve({(RadauTableau::gamma / dt_) * (inertia * error[0])}, error);
    if (inertia.J_2 == 0) error[0].dgamma.setZero();
    return error_norm(error[0], error_scale_);
  }

  // Whether stages have seen all but a negligible share of the energy. The balance of energy misses that of the jump
  // from the start to the polynomial through the stages: of a transient that is over before the first one.
  bool has_seen_energy(const Inertia& inertia) const {
    constexpr double kUnseen = 0.01;  // of the tolerance
    const Velocities jump = start_ - weighted(lagrange_weights(0, 3), start_, stages_);
    return dot(jump, inertia * jump) <= kUnseen * tolerance_.relative * dot(start_, inertia * start_);
  }

  // The same of the platform's pose. Where contacts hold the velocities, these are right at the step's end, however
  // long the step, and their integral alone shows what it misses.
  double error_of_pose() const {
    using T = RadauTableau;
    const Wheels mean_error =
        (1 / T::gamma) * (start_.v + T::error_of_integral(0) * stages_[0].v + T::error_of_integral(1) * stages_[1].v +
                          T::error_of_integral(2) * stages_[2].v);
    return std::sqrt(sum(mean_error.square())) / (kPoseShare * error_scale_.v[0]);
  }

  // Friction that turns within a step is stiff for an instant only. Where the step happens to end in it, the damping
  // there would hide the error of the whole step: the wheel's weakest damping is taken instead.
  void limit_transient_damping(const ContactStiffnesses& stiffness, DampingMatrix& at_end) const {
    if ((stiffness[2] <= kTransientStiffnessRatio * stiffness[0].min(stiffness[1])).all()) return;
    for (int i = 0; i < kWheels; ++i) {
      const int weakest = stiffness[0][i] < stiffness[1][i] ? 0 : 1;
      if (stiffness[2][i] > kTransientStiffnessRatio * stiffness[weakest][i]) at_end.set_wheel(i, damping_[weakest]);
    }
  }

  // Whether a wheel's friction turns at one of the inner stages alone. Where in the turn that stage lies, the error's
  // estimate changes its sign, and a step may be as long as makes it vanish: the pose's must be small as well.
  static bool turns_within(const ContactStiffnesses& stiffness) {
    const auto &a = stiffness[0], &b = stiffness[1], &c = stiffness[2];
    return (a.max(b) - kTransientStiffnessRatio * a.min(b).max(c)).maxCoeff() > 0;
  }

  Wheels phi_at(int j, double dt) const {
    using T = RadauTableau;
    return x_.phi() + dt * (T::A[j][0] * stages_[0].dphi + T::A[j][1] * stages_[1].dphi + T::A[j][2] * stages_[2].dphi);
  }

  // Poses at the stages of a step of length dt, where they matter. An iterate may turn further than the range of
  // small_sine_and_cosine: either it does not converge, or `solve` rejects solved stages that turn further than 1 rad.
  std::array<Pose, 3> poses(const SlipSystem<Model>& system, double dt) const {
    std::array<Pose, 3> pose;
    if (!system.model().features().by_pose()) return pose;
    using T = RadauTableau;
    const auto integral = [&](int j, double a, double b, double c) {
      return dt * (T::A[j][0] * a + T::A[j][1] * b + T::A[j][2] * c);
    };
    const auto turn = [&](int j) { return integral(j, stages_[0].v[2], stages_[1].v[2], stages_[2].v[2]); };
    const auto [sine, cosine] = small_sine_and_cosine(Wheels{turn(0), turn(1), turn(2), 0});
    double dx[3], dy[3];
    for (int j = 0; j < 3; ++j) {
      pose[j].cosine = start_pose_.cosine * cosine[j] - start_pose_.sine * sine[j];
      pose[j].sine = start_pose_.sine * cosine[j] + start_pose_.cosine * sine[j];
      dx[j] = stages_[j].v[0] * pose[j].cosine - stages_[j].v[1] * pose[j].sine;
      dy[j] = stages_[j].v[0] * pose[j].sine + stages_[j].v[1] * pose[j].cosine;
    }
    for (int j = 0; j < 3; ++j) {
      pose[j].x = x_.x() + integral(j, dx[0], dx[1], dx[2]);
      pose[j].y = x_.y() + integral(j, dy[0], dy[1], dy[2]);
    }
    return pose;
  }

  // Lagrange's weights at s on the nodes 0, c_1, c_2, 1, or on the last `nodes` of them.
  static std::array<double, 4> lagrange_weights(double s, int nodes = 4) {
    constexpr double c_1 = RadauTableau::c[0], c_2 = RadauTableau::c[1], k_0 = -1 / (c_1 * c_2),
                     k_1 = 1 / (c_1 * (c_1 - c_2) * (c_1 - 1)), k_2 = 1 / (c_2 * (c_2 - c_1) * (c_2 - 1)),
                     k_3 = 1 / ((1 - c_1) * (1 - c_2));
    const double a = s - c_1, b = s - c_2, c = s - 1;
    if (nodes == 2) return {0, 0, c / (c_2 - 1), b / (1 - c_2)};
    if (nodes == 3) return {0, k_1 * c_1 * b * c, k_2 * c_2 * a * c, k_3 * a * b};
    return {k_0 * a * b * c, k_1 * s * b * c, k_2 * s * a * c, k_3 * s * a * b};
  }

  // The polynomial that has these values at the nodes.
  template <class Value>
  static Value weighted(const std::array<double, 4>& w, const Value& start, const std::array<Value, 3>& stages) {
    return w[0] * start + w[1] * stages[0] + w[2] * stages[1] + w[3] * stages[2];
  }

  // Changes the velocities u of the state x within the step to those that its friction asks for.
  void follow_friction_within(const SlipSystem<Model>& system, double share, const State& x, Velocities& u) const {
    Contacts contacts = evaluated_->contacts[2];
    if constexpr (Model::kReactionsFollow) contacts = system.contacts(x, t_ + share * dt_);
    const Friction F = system.model().bounded(weighted(lagrange_weights(share), start_friction_, friction_), contacts);
    constexpr double kShare = 0.98;  // nearer to the largest friction, the polynomial of the slip is more accurate
    system.follow_friction(F, contacts, x.phi(), kShare, u);
  }

  // The same at the stages of a step of length dt. Near the largest friction, the slip depends on it too much.
  void follow_friction(const SlipSystem<Model>& system, double dt) {
    constexpr double kShare = 0.9;
    const Wheels phi[3] = {phi_at(0, dt), phi_at(1, dt), phi_at(2, dt)};
    for (int j = 0; j < 3; ++j) {
      system.follow_friction(friction_[j], evaluated_->contacts[j], phi[j], kShare, stages_[j]);
    }
  }

  // The collocation polynomial of the step that is known, at the stages of one of length dt. Of a step that began with
  // the transient after a switch, the line through its last two stages.
  [[gnu::flatten, gnu::noinline]] void predict(const SlipSystem<Model>& system, double dt) {
    using T = RadauTableau;
    const bool is_next = known_ == Known::kStepBefore;
    const StageVelocities known = stages_;
    const std::array<Friction, 3> known_friction = friction_;
    const Velocities& start = is_next ? before_ : start_;
    const Friction& start_friction = is_next ? friction_before_ : start_friction_;
    // Where contacts grip, the slip follows from the force: small errors of velocity would be large ones of friction.
    // Not within the polynomial's own step, nor where its errors, some tolerances, are small against nu.
    constexpr double kSmall = 1e-3;
    const bool follows = is_next && !(error_scale_.v[0] < kSmall * system.model().regularization_speed());
    constexpr double kFar = 1.5;  // lengths of the step before, from which on its start does more harm than good
    const int nodes = is_next && began_after_switch_ ? 2 : follows && dt > kFar * dt_ ? 3 : 4;
    for (int j = 0; j < 3; ++j) {
      const double s = (is_next ? 1 : 0) + T::c[j] * dt / dt_;
      const std::array<double, 4> weights = lagrange_weights(s, nodes);
      stages_[j] = weighted(weights, start, known);
      friction_[j] = system.model().bounded(weighted(weights, start_friction, known_friction), evaluated_->contacts[j]);
    }
    if (follows) follow_friction(system, dt);
  }

  // Newton's iterations for the stages, from what `stages_` and `friction_` hold. Those of a step that is `judged` end
  // early, with its hopeless_error_, where that is clearly too large.
  [[gnu::flatten, gnu::noinline]] bool iterate(const SlipSystem<Model>& system, double dt, bool judged) {
    using T = RadauTableau;
    const double per_dt = 1 / dt;
    dt_ = dt;
    hopeless_error_ = 0;
    end_t_ = t_ + T::c[2] * dt;
    torque_ = system.torque().values({t_ + T::c[0] * dt, t_ + T::c[1] * dt, t_ + T::c[2] * dt});
    for (int j = 0; j < 3; ++j) {
      for (int l = 0; l < 3; ++l) D_[j][l] = per_dt * T::A_inverse[j][l];
    }
    StageVelocities left;
    double length = 1, last = 0, rate = rate_;
    bool exact = true;  // whether the matrix is that of where the last correction began
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      ++statistics_->newton_iterations;
      evaluated_ = other(evaluations_, from_.evaluated);
      StageVelocities& change = *other(corrections_, from_.correction);
      residual(system, dt, left);
      if (iteration == 0) factorize(system);
      double size = correction(system, left, change);
      if (iteration > 0) {
        // Deuflhard's natural monotonicity test: with the same Jacobian, the correction must have shrunk. At first it
        // may grow: stiffness by the friction makes up for that sooner than shorter corrections do.
        const bool free = length == 1 && iteration <= kFreeIterations;
        if (!(size <= (free ? kFreeGrowth : 1 - length / 4) * last)) {
          length /= 2;
          if (length < kMinLength) return false;
          move(system, length);
          continue;
        }
        rate = size / last;
        if (exact) curvature_ = std::max(rate / last, kForgetting * curvature_);
        // With a matrix that is no longer exact, corrections shrink about twice as slowly as the first one did.
        exact = !leaves_little(size, exact ? 2 * rate : rate) || !friction_is_as_expected(system);
        if (exact) {
          factorize(system);
          size = correction(system, left, change);
        }
      }
      if (!(size <= std::numeric_limits<double>::max())) return false;
      from_.stages = stages_;
      from_.evaluated = evaluated_;
      from_.correction = &change;
      if (system.reacts()) from_.dN = dN_;
      length = 1;
      last = size;
      move(system, length);
      if (size <= foreseeable_) {
        // With an exact matrix the next correction is about the curvature times the square of this one.
        if (exact && !system.reacts() && kCurvatureMargin * curvature_ * size * size < 1) {
          for (int j = 0; j < 3; ++j) forces_[j] = forces_by_motion(system, j, start_);
          return true;
        }
        if (leaves_little(size, rate)) {
          rate_ = std::min(std::max(rate, kMinRate), 0.5);
          return true;
        }
      }
      if (judged && (iteration == 1 || (iteration == 0 && size > kFarOff))) {
        const double error = this->error(system);
        if (error > kHopeless) {
          hopeless_error_ = error;
          return true;
        }
      }
    }
    return false;
  }

  // Whether all corrections after one of this size, at this rate, sum up to less than the convergence tolerance.
  static bool leaves_little(double size, double rate) { return rate < 1 && size * rate < 1 - rate; }

  // Whether the last correction brought about the friction that it was made for. Where not, its matrix tells nothing of
  // how corrections shrink: a slip that is small may stand for large forces.
  bool friction_is_as_expected(const SlipSystem<Model>& system) const {
    const auto gap = [&](int j) {
      return system.model().friction_gap(friction_[j], evaluated_->contacts[j], kExpected);
    };
    return !(gap(0).max(gap(1)).max(gap(2)).maxCoeff() > 0);
  }

  // Moves the stages by a part of the last correction.
  [[gnu::flatten, gnu::noinline]] void move(const SlipSystem<Model>& system, double length) {
    const auto& [contacts, stiffness] = *from_.evaluated;
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      const Velocities part = length * (*from_.correction)[j];
      stages_[j] = from_.stages[j] + part;
      if constexpr (Model::kReactionsFollow) {
        if (system.reacts()) {
          friction_[j] = system.model().friction_after(contacts[j], stiffness[j], part, length * from_.dN[j]);
          continue;
        }
      }
      friction_[j] = system.model().friction_after(contacts[j], stiffness[j], part);
    }
  }

  // Forces that are left over at each stage.
  [[gnu::flatten, gnu::noinline]] void residual(const SlipSystem<Model>& system, double dt, StageVelocities& r) {
    const auto& model = system.model();
    const Velocities z[3] = {stages_[0] - start_, stages_[1] - start_, stages_[2] - start_};
    system.contacts(stages_, {phi_at(0, dt), phi_at(1, dt), phi_at(2, dt)}, poses(system, dt), torque_, friction_,
                    evaluated_->contacts, evaluated_->stiffness);
    model.forces(stages_, evaluated_->contacts, torque_, forces_);
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      r[j] = forces_[j] - model.inertia() * (D_[j][0] * z[0] + D_[j][1] * z[1] + D_[j][2] * z[2]);
    }
  }

  [[gnu::flatten, gnu::noinline]] void factorize(const SlipSystem<Model>& system) {
    const auto& model = system.model();
    const auto& [contacts, stiffness] = *evaluated_;
    for (int j = 0; j < 3; ++j) {
      system.damping(stages_[j], contacts[j], stiffness[j], torque_[j], damping_[j]);
      coriolis_[j] = model.inertia().coriolis_derivative(stages_[j].v);
    }
    solver_.factorize(D_, model.inertia(), damping_, coriolis_);
    if constexpr (Model::kReactionsFollow) {
      if (system.reacts()) {
        for (int j = 0; j < 3; ++j) system.couple(stages_[j], contacts[j], torque_[j], damping_[j], couplings_[j]);
      }
    }
    ++statistics_->factorizations;
  }

  // Newton's correction for what is left over; returns its size in units of the convergence tolerance.
  [[gnu::flatten, gnu::noinline]] double correction(const SlipSystem<Model>& system, const StageVelocities& left,
                                                    StageVelocities& change) {
    solver_.solve(left, change);
    if constexpr (Model::kReactionsFollow) {
      if (system.reacts()) ReactingStages<3>::correct(solver_, couplings_, change, dN_);
    }
    Wheels squares = Wheels::Zero();
    for (const Velocities& u : change) {
      squares += (u.v * per_tolerance_.v).square() + (u.dphi * per_tolerance_.dphi).square() +
                 (u.dgamma * per_tolerance_.dgamma).square();
    }
    return std::sqrt(sum(squares) / 11);
  }

  Tolerance tolerance_;
  IntegrationStatistics* statistics_;
  StepSizeController control_;

  // The start of the step.
  bool started_ = false;
  double t_ = 0;
  double end_t_ = kUnknown;  // when torque_[2] acts
  State x_;
  Velocities start_, start_forces_, error_scale_;
  Velocities per_tolerance_;  // the inverse of the convergence tolerance
  double foreseeable_ = 0;    // the largest correction of which the next one's size is known, in that tolerance
  Friction start_friction_;
  Pose start_pose_;  // beyond the paper
  ContactModes::Ids contact_ids_ = ContactModes::Ids::Zero();
  bool filters_twice_ = false;  // whether the error's estimate is filtered twice if it is too large
  double accepted_dt_ = 0;      // longest step from here whose error is known to be small enough

  // The step that is known: its stages, and the start of the step before it.
  Known known_ = Known::kNothing;
  bool after_switch_ = false, began_after_switch_ = false;  // whether this step and that one begin with another contact
  bool friction_lasts_ = false;                             // whether end_friction_ is a first guess across the switch
  double dt_ = 0;
  double rate_ = kFirstRate, curvature_ = kFirstCurvature;
  Velocities before_;
  Friction friction_before_;
  Friction end_friction_;
  ContactModes::Ids end_contact_ids_ = ContactModes::Ids::Constant(-1);  // none

  // Newton's iterations.
  double D_[3][3];             // of BorderedStages, 1/s
  double hopeless_error_ = 0;  // that ended them; 0: none
  StageVelocities stages_, forces_;
  Evaluation evaluations_[2];
  Evaluation* evaluated_ = &evaluations_[0];  // at the stages as they are
  StageVelocities corrections_[2];
  alignas(kAlignment) std::array<Wheels, RadauTableau::stages> torque_;
  std::array<DampingMatrix, 3> damping_;
  alignas(kAlignment) std::array<PlatformMatrix, 3> coriolis_;
  std::array<Friction, 3> friction_;
  struct {
    StageVelocities stages;
    Evaluation* evaluated = nullptr;
    StageVelocities* correction = nullptr;
    std::array<Wheels, RadauTableau::stages> dN;  // of dynamic reactions
  } from_;                                        // where the last correction began, and it
  BorderedStages<3> solver_;
  std::array<ReactionCoupling, RadauTableau::stages> couplings_;
  std::array<Wheels, RadauTableau::stages> dN_;  // what the last correction adds to dynamic reactions
  BorderedStages<1> filter_;
};

}  // namespace youbot_base_sim
