#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "youbot_base_sim/integration/integration.h"
#include "youbot_base_sim/integration/located_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/integration/switch_log.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The work that a stepper may spend on a millisecond of motion.
struct WorkBound {
  std::uint64_t max_evaluations;  ///< of the right-hand side, in kWindow
};

/// Bounds the work of a LocatedStepper: a Controlled Stepper of odeint around it. Work is counted in evaluations of the
/// right-hand side, not timed, so that results do not depend on the machine.
///
/// Once a millisecond of motion has used up its bound, the rest of it gets kEasedShare more: a second stepper with a
/// looser tolerance continues, and the transition speed is raised to at least kEasedSpeed. If that is not enough, or
/// steps become too short to advance t, fallback steps cover the next millisecond, and twice as long each time this
/// recurs within kSoon. Switches on the way are announced like all others, with times that are interpolated within the
/// step.
template <class System, class Fallback>
class GuardedStepper : public ControlledStepperTypes {
 public:
  /// Records in `switches` and counts in `statistics`, which must outlive it.
  GuardedStepper(LocatedStepper<System> fine, LocatedStepper<System> coarse, const WorkBound& bound,
                 SwitchLog& switches, IntegrationStatistics& statistics)
      : fine_(std::move(fine)),
        coarse_(std::move(coarse)),
        bound_(bound),
        switches_(&switches),
        statistics_(&statistics) {}

  /// As LocatedStepper's; `dt` is an upper bound. Never fails kMaxFailures times in a row. Throws Stopped if it is to.
  Result try_step(System& system, State& x, double& t, double& dt) {
    if (stop_ && stop_->load(std::memory_order_relaxed)) throw Stopped();
    if (t < fallback_end_) return fall_back(system, x, t, dt);
    if (!(t < window_start_ + kWindow) || t < window_start_) begin_window(system, t);
    const bool stuck = failures_ >= kMaxFailures || t + stepper_->dt() <= t;
    if (stuck || system.evaluations() - spent_ > allowed_) {
      statistics_->exhausted += !eased_;
      if (stuck || eased_) {
        begin_fallback(system, t);
        return fall_back(system, x, t, dt);
      }
      ease(system);
    }
    const double end = dt < stepper_->dt() ? t + dt : std::numeric_limits<double>::infinity();
    const std::uint64_t before = system.evaluations();
    const Result result = stepper_->try_step(system, x, t, dt);
    // A step that the caller cut short is free, up to what an ordinary one takes: fallback steps would be no longer.
    if (result == boost::numeric::odeint::success && t >= end) {
      spent_ += std::min(system.evaluations() - before, kFreeEvaluations);
    }
    failures_ = result == boost::numeric::odeint::fail ? failures_ + 1 : 0;
    return result;
  }

  /// As Integration's.
  void stop_on(const std::atomic<bool>& stop) { stop_ = &stop; }

  /// As LocatedStepper's.
  void torque_jumped() { stepper_->torque_jumped(); }

  /// The stepper whose work is bounded.
  LocatedStepper<System>& stepper() { return *stepper_; }

  GuardedStepper(const GuardedStepper&) = delete;
  GuardedStepper& operator=(const GuardedStepper&) = delete;

 private:
  static constexpr double kWindow = 1e-3;      // s
  static constexpr double kEasedShare = 0.8;   // of the bound
  static constexpr double kEasedSpeed = 1e-6;  // m/s
  static constexpr int kMaxFailures = 400;     // odeint throws after 500
  static constexpr std::uint64_t kFreeEvaluations = 20;
  static constexpr double kFallbackStep = 2e-5;                     // s
  static constexpr double kMinStretch = 1e-3, kMaxStretch = 64e-3;  // s of fallback steps in a row
  static constexpr double kSoon = 10e-3;                            // s after the last stretch

  void begin_window(System& system, double t) {
    window_start_ = t;
    spent_ = system.evaluations();
    allowed_ = bound_.max_evaluations;
    if (eased_) end_easing(system);
  }

  void ease(System& system) {
    eased_ = system.transition_speed();
    system.set_transition_speed(std::max(*eased_, kEasedSpeed));
    replace_stepper(coarse_);
    allowed_ += static_cast<std::uint64_t>(kEasedShare * static_cast<double>(bound_.max_evaluations));
    ++statistics_->eased_periods;
  }

  void end_easing(System& system) {
    system.set_transition_speed(*eased_);
    eased_.reset();
    replace_stepper(fine_);
  }

  // Keeps the record of chattering wheels.
  void replace_stepper(LocatedStepper<System>& stepper) {
    stepper.restart();
    stepper.sliding_mode() = stepper_->sliding_mode();
    stepper_ = &stepper;
  }

  void begin_fallback(System& system, double t) {
    if (eased_) end_easing(system);
    stretch_ = t < fallback_end_ + kSoon ? std::min(2 * stretch_, kMaxStretch) : kMinStretch;
    fallback_end_ = t + stretch_;
    stepper_->restart();
    failures_ = 0;
    window_start_ = std::numeric_limits<double>::infinity();
  }

  Result fall_back(System& system, State& x, double& t, double& dt) {
    for (int i = 0; i < kWheels; ++i) {
      if (system.shared(i)) system.put(i, system.roller(i));
    }
    const double length = std::min(dt, kFallbackStep);
    const Wheels start = x.phi();
    fallback_.do_step(std::ref(system), x, t, length);
    for (int i = 0; i < kWheels; ++i) {
      if (!system.averaged(i)) {
        cross(system, x, t, length, i, start[i]);
      } else if (system.slow_again(i, x)) {
        stepper_->record_passed_rollers(system, x, t + length, i);
        system.put(i, system.roller(i));
      }
    }
    t += length;
    if (system.watches()) system.watch(x, t, length);
    ++statistics_->fallback_steps;
    dt = std::numeric_limits<double>::infinity();
    return boost::numeric::odeint::success;
  }

  // Hands wheel i, whose angle was `start` (rad) at time t, over to the roller that it has come to `length` (s) later.
  void cross(System& system, State& x, double t, double length, int i, double start) {
    const std::int64_t from = system.roller(i), to = system.model().geometry().roller_at(x.phi()[i]);
    if (from == to) return;
    const double edge = to > from ? system.upper_edge()[i] : system.lower_edge()[i];
    const double moved = x.phi()[i] - start, at = moved == 0 ? 0 : std::clamp((edge - start) / moved, 0.0, 1.0);
    system.hand_over(i, to, x);
    const double far_side = to > from ? edge : std::nextafter(edge, -std::numeric_limits<double>::infinity());
    switches_->record(t + at * length, i, from, to, system.rollers(), far_side);
  }

  LocatedStepper<System> fine_, coarse_;
  LocatedStepper<System>* stepper_ = &fine_;  // the one at work
  WorkBound bound_;
  SwitchLog* switches_;
  IntegrationStatistics* statistics_;
  Fallback fallback_;
  const std::atomic<bool>* stop_ = nullptr;  // null: never

  // The millisecond under way: its start, the evaluations before it and those that it may take.
  double window_start_ = std::numeric_limits<double>::infinity();
  std::uint64_t spent_ = 0, allowed_ = 0;
  int failures_ = 0;             // in a row
  std::optional<double> eased_;  // the transition speed to return to, m/s, while the coarse stepper is at work

  double fallback_end_ = -std::numeric_limits<double>::infinity();
  double stretch_ = kMinStretch;
};

}  // namespace youbot_base_sim
