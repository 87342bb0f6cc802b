#pragma once

#include <algorithm>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <functional>
#include <memory>

#include "youbot_base_sim/integration/event_locating_stepper.h"
#include "youbot_base_sim/integration/fallback_stepper.h"
#include "youbot_base_sim/integration/guarded_stepper.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/smooth_stepper.h"

namespace youbot_base_sim {

/// Integrates models 2a and 2b by any method: odeint's integrate_adaptive over a GuardedStepper, and a
/// loop from row to row within its steps.
template <class Model>
class SlipIntegrator : public MotionIntegrator {
 public:
  using MakeMethod = std::function<std::unique_ptr<SmoothStepper>(IntegrationStatistics&)>;

  /// `make_method` makes the method; `tolerance` is for events, and `max_evaluations` a GuardedStepper's. `torque` must
  /// outlive the integration. The motion begins at `start`, or continues there after `before`.
  SlipIntegrator(const Model& model, const TorqueProfile& torque, const State& start, const Tolerance& tolerance,
                 std::uint64_t max_evaluations, const MakeMethod& make_method, const MotionSoFar* before = nullptr)
      : system_(model, torque, start),
        stepper_(
            {make_method(record_.statistics), tolerance, record_},
            [this](State& x, double t, double dt) { fallback_.do_step(system_, x, t, dt); }, max_evaluations, record_) {
    if (!before) return;
    if (before->contacts) system_.modes() = *before->contacts;
    if (before->reactions) record_.reactions = *before->reactions;
    system_.count_evaluations(before->statistics.evaluations);
    record_.statistics = before->statistics;
    record_.switches = before->switches;
  }

  void advance(State& x, double t, double t_end, double smooth_end) override {
    if (!(t < t_end)) return;
    if (within_step_ || t_end < smooth_end) {
      advance_within_steps(x, t, t_end, smooth_end);
    } else {
      boost::numeric::odeint::integrate_adaptive(std::ref(stepper_), std::ref(system_), x, t, t_end, t_end - t);
    }
    if (!system_.modes().averages()) return;
    for (int i = 0; i < kWheels; ++i) {
      if (system_.modes().averaged(i)) record_.record_passed_rollers(system_.modes(), i, x, t_end);
    }
  }

  void stop_on(const std::atomic<bool>& stop) override { stepper_.stop_on(stop); }
  void torque_jumped() override {
    stepper_.torque_jumped();
    within_step_ = false;
  }
  void constrain(State& x, double t) const override {
    if (system_.model().inertia().J_2 > 0) return;
    x.dgamma() = system_.massless_roller_rates(x.velocities(), x.phi(), system_.pose(x), system_.torque().value(t),
                                               system_.modes().shared());
  }
  double kinetic_energy(const State& x) const override {
    return youbot_base_sim::kinetic_energy(system_.model().robot(), x);
  }
  ContactDetails contacts(const State& x, double t) const override {
    return system_.model().details(system_.contacts(x, t));
  }
  void set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) override {
    const double energy = kinetic_energy(x);
    const Eigen::Matrix3d inertia = system_.model().inertia().M_v;
    const Eigen::Vector3d momentum = product(inertia, x.velocity());
    system_.set_loads(applied);
    if (keep_momentum) {
      x.values.col(1).head<3>() = product(system_.model().inertia().M_v_inverse, momentum).array();
      if (system_.model().inertia().M_v != inertia) system_.modes().renew();
    }
    x.work() += kinetic_energy(x) - energy;
    torque_jumped();
  }
  MotionSoFar leave() override { return {system_.modes(), statistics(), reaction_record(), take_switches()}; }
  std::optional<ReactionRecord> reaction_record() const override {
    if (!system_.reacts()) return std::nullopt;
    return record_.reactions;
  }
  void continue_when_tipping() override { record_.ends_tipping = false; }
  const ContactModes* contact_modes() const override { return &system_.modes(); }
  double regularization_speed() const override { return system_.rest().moving_nu(); }
  std::vector<RollerSwitch> take_switches() override { return record_.take_switches(); }
  const IntegrationStatistics& statistics() const override {
    record_.statistics.evaluations = system_.evaluations();
    return record_.statistics;
  }

 private:
  // Steps may end after t_end; x is then the state there within the last one.
  void advance_within_steps(State& x, double t, double t_end, double smooth_end) {
    if (!within_step_) {
      step_end_ = x;
      step_end_t_ = t;
    }
    while (step_end_t_ < t_end) {
      stepper_.finish(system_, step_end_, step_end_t_);
      const double bound = stepper_.interpolates(step_end_t_) ? smooth_end : t_end;
      double dt = bound - step_end_t_;
      const double reached = step_end_t_ + dt;
      stepper_.try_step(system_, step_end_, step_end_t_, dt, false);
      if (step_end_t_ == reached) step_end_t_ = bound;  // without rounding
    }
    within_step_ = step_end_t_ > t_end;
    if (within_step_) {
      stepper_.state_at(t_end, system_, x);
    } else {
      stepper_.finish(system_, step_end_, step_end_t_);
      x = step_end_;
    }
  }

  mutable MotionRecord record_;
  SlipSystem<Model> system_;
  FallbackStepper<Model> fallback_;
  GuardedStepper stepper_;

  // The end of the last step, where the state was last asked for within it.
  bool within_step_ = false;
  State step_end_;
  double step_end_t_ = 0;
};

}  // namespace youbot_base_sim
