#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "youbot_base_sim/integration/radau_error.h"
#include "youbot_base_sim/integration/radau_newton.h"
#include "youbot_base_sim/integration/radau_prediction.h"
#include "youbot_base_sim/integration/radau_stages.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Radau IIA with three stages, of order 5, for a SlipSystem<Model> between two switches: a Controlled Stepper of
/// odeint. RadauNewton solves for the velocities u_j at the stages (docs/method.md, "A step"), from the guess of
/// RadauPrediction; RadauError estimates the error, and StepSizeController the next length.
///
/// Contacts may change between steps; call `reset` where the torque jumps. Functions that do the work are marked
/// `flatten` and `noinline`: GCC then inlines the many small functions that they call, and not them into one another,
/// which would spill the vector registers.
template <class Model>
class Radau final : public SmoothStepper {
 public:
  using SmoothStepper::try_step;

  /// Counts its iterations in `statistics`, which must outlive it.
  Radau(const Tolerance& tolerance, IntegrationStatistics& statistics)
      : newton_(tolerance, statistics), error_(tolerance) {}

  /// A step that is shorter than one whose error was small enough, from the same start, is not judged again; one that
  /// the rounding of t lets be no shorter is not rejected for its error.
  Result try_step(const SmoothSystem& smooth, const State& in, double& t, State& out, double& dt) override {
    using boost::numeric::odeint::fail;
    const auto& system = static_cast<const SlipSystem<Model>&>(smooth);
    if (!started_ || !starts_at(in, t)) begin(system, in, t);
    const double length = dt, shortest = kTimeRounding * std::abs(t);
    const bool judged = !(length <= accepted_dt_);
    early_error_ = 0;
    if (!solve(system, dt, judged && length > shortest)) {
      dt *= radau_options.max_shrinkage;
      return fail;
    }
    if (judged) {
      const double error = early_error_ > 0 ? early_error_ : error_of_stages(system);
      const bool finite = std::isfinite(error);
      dt = std::max(control_.next(dt, error), finite ? shortest : 0);
      if (!(error <= 1) && !(finite && length <= shortest)) {
        error_.reject();
        return fail;
      }
      accepted_dt_ = length;
    }
    end(newton_.dt(), stages_->u, out);
    t += length;
    return boost::numeric::odeint::success;
  }

  /// Dense output: the collocation polynomial, O(h^4). Where a contact sticks, its slip is recomputed from the
  /// interpolated friction, since an O(h^4) slip error would be an O(1) friction error.
  bool interpolates() const override { return true; }
  [[gnu::noinline]] void state_within(const SmoothSystem& smooth, double share, State& x) const override {
    const auto& system = static_cast<const SlipSystem<Model>&>(smooth);
    StageVelocities u;
    for (int j = 0; j < 3; ++j) {
      u[j] = weighted(lagrange_weights(share * RadauTableau::c[j]), start_.u, stages_->u);
    }
    end(share * newton_.dt(), u, x);
    follow_friction_within(system, share, x, u[2]);
    x.set(u[2]);
    // The work of the polynomial's accelerations. Forces are less accurate: what friction is off by does no work at the
    // stages alone.
    x.work() = start_.x.work() + 0.5 * dot(u[2] - start_.u, system.model().inertia() * (u[2] + start_.u));
  }

  /// Forgets the derivative at the start and the errors of the steps before: the torque jumps.
  void reset() override {
    started_ = false;
    end_t_ = kUnknown;
    control_.restart();
  }

  void restart() override {
    reset();
    control_ = StepSizeController();
    prediction_.restart();
    newton_.restart();
  }

 private:
  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  static constexpr double kTimeRounding = 1e-15;  // of t, as control periods count it

  bool starts_at(const State& x, double t) const {
    // NOLINTNEXTLINE(bugprone-suspicious-memory-comparison): the very same bits are meant
    return t == start_.t && std::memcmp(x.begin(), start_.x.begin(), sizeof x.values) == 0;
  }

  // Steps that follow start from x at time t.
  [[gnu::flatten, gnu::noinline]] void begin(const SlipSystem<Model>& system, const State& x, double t) {
    if (!starts_at(x, t)) prediction_.accept(start_);
    const ContactModes& modes = system.modes();
    const WheelMask unchanged = prediction_.unchanged(modes.ids());
    start_.after_switch = !unchanged.all();
    start_.carries_friction = start_.after_switch && prediction_.continues() && unchanged.any() && !modes.mixed();
    if (start_.after_switch) {  // another contact: the step before does not predict this one
      prediction_.forget();
      control_.restart();
    }
    started_ = true;
    accepted_dt_ = 0;
    start_.x = x;
    start_.t = t;
    start_.contact_ids = modes.ids();
    start_.u = x.velocities();
    const bool goes_on = std::abs(t - end_t_) <= kTimeRounding * std::abs(t);  // where the last step ended
    const Wheels M = goes_on ? newton_.torque_at_end() : system.torque().value(t);
    start_.pose = system.pose(x);
    if (radau_options.start_by_motion && prediction_.continues() && goes_on && !modes.mixed()) {
      const auto& before = *prediction_.last();
      start_.forces = newton_.forces_by_motion(system, 2, before.start, before.stages.u);
      start_.friction = prediction_.end_friction();
    } else {
      evaluate_start(system, M);
    }
    error_.begin(start_.after_switch);
    start_.error_scale = error_.scale(start_.u);
    newton_.begin(system, start_);
  }

  // Forces and friction at the start under the torques M.
  void evaluate_start(const SlipSystem<Model>& system, const Wheels& M) {
    if (system.model().inertia().J_2 == 0 && start_.after_switch) {
      start_.u.dgamma = system.massless_roller_rates(start_.u, start_.x.phi(), start_.pose, M, system.modes().shared());
    }
    typename Model::Contacts contacts = system.contacts(start_.u, start_.x.phi(), start_.pose, M);
    system.count_evaluations(1);
    start_.forces = system.model().forces(start_.u, contacts, M);
    start_.friction = system.model().friction(contacts);
  }

  // Finds the stages of a step of length dt. One that is `judged` ends early, with its early_error_, where that is
  // too large. False without convergence, or if the platform's rate at a stage would rotate it by over 1 rad.
  bool solve(const SlipSystem<Model>& system, double dt, bool judged) {
    end_t_ = start_.t + RadauTableau::c[2] * dt;
    stages_ = &prediction_.next_stages();
    if (!find_stages(system, dt, judged)) {
      prediction_.forget();
      return false;
    }
    prediction_.keep(dt);
    const StageVelocities& u = stages_->u;
    return dt * std::max({std::abs(u[0].v[2]), std::abs(u[1].v[2]), std::abs(u[2].v[2])}) < 1;
  }

  bool find_stages(const SlipSystem<Model>& system, double dt, bool judged) {
    const auto give_up = [this, &system, judged] {
      const double error = judged ? error_of_stages(system) : 0;
      if (error > 1) early_error_ = error;
      return error > 1;
    };
    if (prediction_.known()) {
      prediction_.predict(system, start_, newton_.contacts(), dt, *stages_);
      if (newton_.iterate(system, start_, dt, *stages_, give_up)) return true;
    }
    prediction_.begin_as_start(system, start_, newton_.contacts(), dt, *stages_);
    return newton_.iterate(system, start_, dt, *stages_, give_up);
  }

  double error_of_stages(const SlipSystem<Model>& system) {
    return error_.estimate(system, start_, stages_->u, newton_.matrix());
  }

  // State at the end of a step of length dt with these velocities at the stages.
  [[gnu::flatten, gnu::noinline]] void end(double dt, const StageVelocities& stages, State& x) const {
    using T = RadauTableau;
    x = start_.x;
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
      work += b * dot(u, newton_.forces()[j]);
      x.phi() += b * u.dphi;
      x.gamma() += b * u.dgamma;
    }
    const auto [sin_psi, cos_psi] = sine_and_cosine(start_.x.psi());
    x.x() += along * cos_psi - across * sin_psi;
    x.y() += along * sin_psi + across * cos_psi;
    x.psi() += heading[2];
    x.work() += work;
  }

  // Changes the velocities u of the state x within the step so that the slip yields the friction there.
  void follow_friction_within(const SlipSystem<Model>& system, double share, const State& x, Velocities& u) const {
    typename Model::Contacts contacts = newton_.contacts()[2];
    if constexpr (Model::kReactionsFollow) contacts = system.contacts(x, start_.t + share * newton_.dt());
    const typename Model::Friction F =
        bounded_friction(system.model(), weighted(lagrange_weights(share), start_.friction, stages_->F), contacts);
    follow_friction(system, F, contacts, x.phi(), radau_options.dense_gripping_share, u);
  }

  StepSizeController control_;
  RadauNewton<Model> newton_;
  RadauError<Model> error_;
  RadauPrediction<Model> prediction_;

  bool started_ = false;
  RadauStart<Model> start_;
  RadauStages<Model>* stages_;  // of the last try
  double end_t_ = kUnknown;     // time of Newton's torque at the end, s
  double early_error_ = 0;      // of iterations that it ended; 0: none
  double accepted_dt_ = 0;      // longest step from here whose error is known to be small enough
};

}  // namespace youbot_base_sim
