#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>

#include "youbot_base_sim/integration/event_locating_stepper.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Bounds the work of an EventLocatingStepper: a Controlled Stepper of odeint around it. Work is counted in evaluations
/// of the right-hand side, so that results do not depend on the machine.
///
/// A millisecond of motion that has used up its bound gets kMoreWork more, with a stepper of looser tolerance and a
/// regularization speed of at least kEasedSpeed. Then it gets as much again, in which wheels that chatter come to rest
/// at once. If that is not enough, or steps become too short to advance t, fallback steps cover the next millisecond,
/// and twice as long each time this recurs within kFallbackCooldown.
template <class System, class Fallback>
class GuardedStepper : public ControlledStepperTypes {
 public:
  /// Spends `max_evaluations` on a millisecond of motion. Records in `record`, which must outlive it.
  GuardedStepper(EventLocatingStepper<System> fine, EventLocatingStepper<System> coarse, std::uint64_t max_evaluations,
                 MotionRecord& record)
      : fine_(std::move(fine)), coarse_(std::move(coarse)), max_evaluations_(max_evaluations), record_(&record) {}

  /// As EventLocatingStepper's, but it fails only where fallback steps begin: it tries again itself. Throws Stopped
  /// once the stop flag is set.
  Result try_step(System& system, State& x, double& t, double& dt, bool finishes = true) {
    for (int failures = 0;; ++failures) {
      if (stop_ && stop_->load(std::memory_order_relaxed)) throw Stopped();
      if (t < fallback_end_) return fall_back(system, x, t, dt);
      if (!(t < window_start_ + kWindow) || t < window_start_) begin_window(system, t);
      const bool stuck = failures >= kMaxFailures || t + stepper_->dt() <= t;
      if (stuck || system.evaluations() - uncounted_ > allowed_) {
        record_->statistics.exhausted += !eased_;
        if (stuck || !save_work(system)) {
          begin_fallback(system, t);
          return boost::numeric::odeint::fail;
        }
      }
      const double end = dt < stepper_->dt() ? t + dt : kInfinity;
      const std::uint64_t before = system.evaluations();
      double next = dt;
      if (stepper_->try_step(system, x, t, next, finishes) == boost::numeric::odeint::fail) continue;
      // A step that the caller cut short is free, up to what an ordinary one takes: fallback steps would be no longer.
      if (t >= end) uncounted_ += std::min(system.evaluations() - before, kFreeEvaluations);
      dt = next;
      return boost::numeric::odeint::success;
    }
  }

  /// As EventLocatingStepper's, for a step from time t and for the last one.
  bool interpolates(double t) const { return !(t < fallback_end_) && stepper_->interpolates(); }
  void state_at(double t, const System& system, State& x) const { stepper_->state_at(t, system, x); }
  void finish(System& system, State& x, double t) { stepper_->finish(system, x, t); }

  /// As MotionIntegrator::stop_on.
  void stop_on(const std::atomic<bool>& stop) { stop_ = &stop; }

  /// As EventLocatingStepper's.
  void torque_jumped() { stepper_->torque_jumped(); }

  GuardedStepper(const GuardedStepper&) = delete;
  GuardedStepper& operator=(const GuardedStepper&) = delete;

 private:
  static constexpr double kWindow = 1e-3;   // s
  static constexpr double kMoreWork = 0.4;  // of the bound
  static constexpr int kMaxFailures = 400;  // of one step
  static constexpr std::uint64_t kFreeEvaluations = 20;
  static constexpr double kFallbackStep = 2e-5;                     // s
  static constexpr double kMinStretch = 1e-3, kMaxStretch = 64e-3;  // s of fallback steps in a row
  static constexpr double kFallbackCooldown = 10e-3;                // s after the last stretch

  void begin_window(System& system, double t) {
    window_start_ = t;
    uncounted_ = system.evaluations();
    allowed_ = max_evaluations_;
    if (eased_) end_easing(system);
  }

  // Makes the rest of the millisecond less work, and allows some; false if all of that has been done.
  bool save_work(System& system) {
    SlidingMode& sliding_mode = record_->sliding_mode;
    if (sliding_mode.hurried()) return false;
    eased_ ? sliding_mode.hurry(true) : ease(system);
    allowed_ += static_cast<std::uint64_t>(kMoreWork * static_cast<double>(max_evaluations_));
    return true;
  }

  void ease(System& system) {
    eased_ = true;
    system.ease_friction(kEasedSpeed);
    replace_stepper(coarse_);
    ++record_->statistics.eased_periods;
  }

  void end_easing(System& system) {
    system.ease_friction(0);
    record_->sliding_mode.hurry(false);
    eased_ = false;
    replace_stepper(fine_);
  }

  void replace_stepper(EventLocatingStepper<System>& stepper) {
    stepper.restart();
    stepper_ = &stepper;
  }

  void begin_fallback(System& system, double t) {
    if (eased_) end_easing(system);
    stretch_ = t < fallback_end_ + kFallbackCooldown ? std::min(2 * stretch_, kMaxStretch) : kMinStretch;
    fallback_end_ = t + stretch_;
    stepper_->restart();
    record_->sliding_mode = {};
    window_start_ = kInfinity;
  }

  Result fall_back(System& system, State& x, double& t, double& dt) {
    ContactModes& modes = system.modes();
    for (int i = 0; i < kWheels; ++i) {
      if (modes.shared(i)) modes.set_roller(i, modes.roller(i));
    }
    const double length = std::min(dt, kFallbackStep);
    const Wheels start = x.phi();
    fallback_.do_step(system, x, t, length);
    for (int i = 0; i < kWheels; ++i) {
      if (!modes.averaged(i)) {
        cross(modes, x, t, length, i, start[i]);
      } else if (modes.below_resolution_limit(i, x) > 0) {
        record_->record_passed_rollers(modes, i, x, t + length);
        modes.set_roller(i, modes.roller(i));
      }
    }
    t += length;
    if (system.past_rest_change(x.velocities()) > 0) system.change_rest(x.velocities());
    if (system.reacts()) record_->reactions.watch(system.reactions(x, t), t, length);
    ++record_->statistics.fallback_steps;
    dt = kInfinity;
    return boost::numeric::odeint::success;
  }

  // Stands wheel i, whose angle was `start` (rad) at time t, on the roller that it has come to `length` (s) later.
  void cross(ContactModes& modes, State& x, double t, double length, int i, double start) {
    const std::int64_t from = modes.roller(i), to = modes.roller_at(x.phi()[i]);
    if (from == to) return;
    const double edge = to > from ? modes.upper_edge()[i] : modes.lower_edge()[i];
    const double moved = x.phi()[i] - start, at = moved == 0 ? 0 : std::clamp((edge - start) / moved, 0.0, 1.0);
    modes.switch_roller(i, to, x);
    record_->record_switch(modes, i, from, t + at * length, ContactModes::far_side(edge, to > from ? +1 : -1));
  }

  EventLocatingStepper<System> fine_, coarse_;
  EventLocatingStepper<System>* stepper_ = &fine_;  // the one in use
  std::uint64_t max_evaluations_;
  MotionRecord* record_;
  Fallback fallback_;
  const std::atomic<bool>* stop_ = nullptr;  // null: never

  // The millisecond under way: its start (infinite: none yet), the evaluations that do not count, which are those
  // before it and of steps that were cut short, and how many it may take.
  double window_start_ = kInfinity;
  std::uint64_t uncounted_ = 0, allowed_ = 0;
  bool eased_ = false;  // whether the coarse stepper is at work

  double fallback_end_ = -kInfinity;
  double stretch_ = kMinStretch;
};

}  // namespace youbot_base_sim
