#include "youbot_base_sim/integration/guarded_stepper.h"

#include <algorithm>
#include <utility>

#include "youbot_base_sim/integration/motion_integrator.h"

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

GuardedStepper::GuardedStepper(EventLocatingStepper stepper, Fallback fallback, std::uint64_t max_evaluations,
                               MotionRecord& record)
    : stepper_(std::move(stepper)),
      fallback_(std::move(fallback)),
      max_evaluations_(max_evaluations),
      record_(&record) {}

GuardedStepper::Result GuardedStepper::try_step(ContactSystem& system, State& x, double& t, double& dt, bool finishes) {
  for (int failures = 0;; ++failures) {
    if (stop_ && stop_->load(std::memory_order_relaxed)) throw Stopped();
    if (t < fallback_end_) {
      fall_back(system, x, t, std::min(dt, kFallbackStep));
      dt = kInfinity;
      return odeint::success;
    }
    if (!(t < window_start_ + kWindow) || t < window_start_) begin_window(system, t);
    const bool stuck = failures >= kMaxFailures || t + stepper_.dt() <= t;
    if (stuck || system.evaluations() > allowed_) {
      record_->statistics.exhausted += !record_->sliding_mode.holds_early;
      if (stuck || !save_work()) {
        begin_fallback(t);
        continue;
      }
    }
    double next = dt;
    if (stepper_.try_step(system, x, t, next, finishes) == odeint::fail) continue;
    dt = next;
    return odeint::success;
  }
}

void GuardedStepper::begin_window(const ContactSystem& system, double t) {
  window_start_ = t;
  allowed_ = system.evaluations() + max_evaluations_;
  record_->sliding_mode.holds_early = false;
}

// Makes what is left of the millisecond less work, and allows some; false if that has been done.
bool GuardedStepper::save_work() {
  if (record_->sliding_mode.holds_early) return false;
  record_->sliding_mode.holds_early = true;
  ++record_->statistics.eased_periods;
  allowed_ += static_cast<std::uint64_t>(kExtraBudget * static_cast<double>(max_evaluations_));
  return true;
}

void GuardedStepper::begin_fallback(double t) {
  const bool recurs = t < fallback_end_ + kFallbackCooldown;
  fallback_duration_ = recurs ? std::min(2 * fallback_duration_, kMaxDuration) : kMinDuration;
  fallback_end_ = t + fallback_duration_;
  stepper_.restart();
  record_->sliding_mode = {};
  window_start_ = kInfinity;
}

void GuardedStepper::fall_back(ContactSystem& system, State& x, double& t, double dt) {
  ContactModes& modes = system.modes();
  for (int i = 0; i < kWheels; ++i) {
    if (modes.shared(i)) modes.set_roller(i, modes.roller(i));
  }
  const State start = x;
  fallback_(x, t, dt);
  t += dt;
  stepper_.finish_foreign_step(system, start, x, t, dt);
  ++record_->statistics.fallback_steps;
}

}  // namespace youbot_base_sim
