#pragma once

#include <algorithm>
#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <boost/numeric/odeint/util/unwrap_reference.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/switch_log.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// How much work a stepper may take for a millisecond of motion.
struct WorkBound {
  std::uint64_t max_evaluations;  ///< of the right-hand side, in kWindow
};

/// Bounds the work of a LocatedStepper: a Controlled Stepper of odeint around it. Work is counted in evaluations of the
/// right-hand side, not timed, so that results do not depend on the machine.
///
/// Once the bound for a millisecond of motion is spent, or step lengths vanish, fallback steps go on: for a
/// millisecond, and for twice as long each time that the bound is spent again soon after. Switches on the way are
/// announced like all others, with times that are interpolated within the step.
template <class Stepper, class Fallback>
class GuardedStepper {
 public:
  using state_type = State;
  using deriv_type = State;
  using value_type = double;
  using time_type = double;
  using order_type = unsigned short;
  using stepper_category = boost::numeric::odeint::controlled_stepper_tag;
  using Result = boost::numeric::odeint::controlled_step_result;

  /// Records in `switches` and counts in `statistics`, which must outlive it.
  GuardedStepper(const Stepper& stepper, const WorkBound& bound, SwitchLog& switches, IntegrationStatistics& statistics)
      : fresh_(stepper), stepper_(fresh_), bound_(bound), switches_(&switches), statistics_(&statistics) {}

  /// As LocatedStepper's; `dt` is an upper bound. Never fails kMaxFailures times in a row.
  template <class System>
  Result try_step(System system_reference, State& x, double& t, double& dt) {
    auto& system = static_cast<typename boost::numeric::odeint::unwrap_reference<System>::type&>(system_reference);
    if (t < fallback_end_) return fall_back(system, x, t, dt);
    if (!(t < window_start_ + kWindow) || t < window_start_) {
      window_start_ = t;
      spent_ = system.evaluations();
    }
    if (system.evaluations() - spent_ > bound_.max_evaluations || failures_ >= kMaxFailures ||
        t + stepper_->dt() <= t) {
      begin_fallback(t);
      return fall_back(system, x, t, dt);
    }
    const Result result = stepper_->try_step(system_reference, x, t, dt);
    failures_ = result == boost::numeric::odeint::fail ? failures_ + 1 : 0;
    return result;
  }

  void torque_jumped() { stepper_->torque_jumped(); }

  /// The stepper whose work is bounded.
  Stepper& stepper() { return *stepper_; }

 private:
  static constexpr double kWindow = 1e-3;                           // s
  static constexpr int kMaxFailures = 400;                          // odeint throws after 500
  static constexpr double kFallbackStep = 5e-5;                     // s
  static constexpr double kMinStretch = 1e-3, kMaxStretch = 64e-3;  // s of fallback steps in a row
  static constexpr double kSoon = 10e-3;                            // s after the last stretch

  void begin_fallback(double t) {
    ++statistics_->exhausted;
    stretch_ = t < fallback_end_ + kSoon ? std::min(2 * stretch_, kMaxStretch) : kMinStretch;
    fallback_end_ = t + stretch_;
    stepper_.emplace(fresh_);
    failures_ = 0;
    window_start_ = std::numeric_limits<double>::infinity();
  }

  template <class System>
  Result fall_back(System& system, State& x, double& t, double& dt) {
    for (int i = 0; i < kWheels; ++i) {
      if (system.shared(i)) system.put(i, system.roller(i));
    }
    const double length = std::min(dt, kFallbackStep);
    const Wheels start = x.phi();
    fallback_.do_step(std::ref(system), x, t, length);
    for (int i = 0; i < kWheels; ++i) {
      if (!system.averaged(i)) cross(system, x, t, length, i, start[i]);
    }
    t += length;
    ++statistics_->fallback_steps;
    dt = std::numeric_limits<double>::infinity();
    return boost::numeric::odeint::success;
  }

  // Hands wheel i, whose angle was `start` (rad) at time t, over to the roller that it has come to `length` (s) later.
  template <class System>
  void cross(System& system, State& x, double t, double length, int i, double start) {
    const std::int64_t from = system.roller(i), to = system.model().geometry().roller_at(x.phi()[i]);
    if (from == to) return;
    const double edge = to > from ? system.upper_edge()[i] : system.lower_edge()[i];
    const double at = std::clamp((edge - start) / (x.phi()[i] - start), 0.0, 1.0);
    system.hand_over(i, to, x);
    switches_->record(t + at * length, i, from, to, system.rollers(), edge);
  }

  Stepper fresh_;                   // as it begins
  std::optional<Stepper> stepper_;  // odeint's implicit steppers can be copied but not assigned
  WorkBound bound_;
  SwitchLog* switches_;
  IntegrationStatistics* statistics_;
  Fallback fallback_;
  double window_start_ = std::numeric_limits<double>::infinity();
  double fallback_end_ = -std::numeric_limits<double>::infinity();
  double stretch_ = kMinStretch;
  std::uint64_t spent_ = 0;
  int failures_ = 0;
};

}  // namespace youbot_base_sim
