#pragma once

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <cstdint>
#include <memory>
#include <tuple>
#include <utility>

#include "youbot_base_sim/integration/events.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Steps that end where an event happens: a Controlled Stepper of odeint around a SmoothStepper.
///
/// Newton's method on the length of the step locates a switch to 1e-12 s, or to the resolution of phi: each try is a
/// whole step from the same start. The wheel then stands on the far side of the edge, and the next step starts afresh.
/// A wheel exactly on an edge stands on the roller of (2.1), unless its motion leaves that roller at once; one that
/// touches the edge and turns back does not switch. Other events are located by bisection.
///
/// `dt` of try_step is an upper bound; the length worth trying is remembered here, so that odeint may clip the bound at
/// the end of a control period without loss. After success dt is infinite.
template <class System>
class EventLocatingStepper : public ControlledStepperTypes {
 public:
  /// Records in `record`, which must outlive it.
  EventLocatingStepper(std::unique_ptr<SmoothStepper<System>> stepper, const Tolerance& tolerance, MotionRecord& record)
      : stepper_(std::move(stepper)),
        tolerance_(tolerance),
        record_(&record),
        events_(EdgeReached<System>(tolerance, record), SharingEnds<System>{{&record}},
                AveragingEnds<System>{{&record}}, RestChanges<System>{}, TippingReached<System>{&record}) {}

  /// Tries a step of at most dt (s) from x at time t, to the first event. On failure x and t stay as they are, and dt
  /// becomes less. The contacts of `system` change with the state; without `finishes`, not before `finish`.
  Result try_step(System& system, State& x, double& t, double& dt, bool finishes = true) {
    const State& start = settled_start(system, x, t);
    const double bound = std::min(dt, system.max_step(start));
    // A step that would leave a sliver goes to the end.
    const double length = dt_ < kSliver * bound ? dt_ : bound;
    if (!try_length(system, start, t, length) || !end_at_events(system, start, t, length)) {
      ++record_->statistics.rejected_steps;
      dt_ = next_dt_;
      dt = kRoom * dt_;
      return boost::numeric::odeint::fail;
    }
    start_t_ = t;
    t = last_try_.length == bound ? t + bound : t + last_try_.length + residual_dt_;
    x = last_try_.end;
    if (residual_dt_ != 0) extrapolate(system, x);
    starts_elsewhere_ = false;
    ++record_->statistics.steps;
    if (restarting_) dt_after_switch_ = std::max(kFirstStep, dt_);
    restarting_ = false;
    unfinished_ = true;
    if (finishes) finish(system, x, t);
    dt = kInfinity;
    return boost::numeric::odeint::success;
  }

  /// The effects of events at the end of the last step, which is x at time t, unless they have taken place.
  void finish(System& system, State& x, double t) {
    if (!std::exchange(unfinished_, false)) return;
    settle(system, x, t);
    if (system.reacts()) record_->reactions.watch(system.reactions(x, t), t, t - start_t_);
  }

  /// Whether it knows the states within its steps; then, before `finish`, the one at time t within the last step.
  bool interpolates() const { return stepper_->interpolates(); }
  void state_at(double t, const System& system, State& x) const { stepper_->state_within(system, share(t), x); }

  /// The torque jumps here: the next step is as long as was good after the last jump. A step that is not finished ended
  /// here.
  void torque_jumped() {
    std::exchange(unfinished_, false) ? stepper_->restart() : stepper_->reset();
    dt_ = std::min(dt_, dt_after_jump_);
    after_jump_ = true;
    settled_ = starts_elsewhere_ = false;
  }

  /// Forgets all steps so far.
  void restart() {
    stepper_->restart();
    *this = EventLocatingStepper(std::move(stepper_), tolerance_, *record_);
  }

  /// Length of the step that is tried next, s.
  double dt() const { return dt_; }

 private:
  static constexpr double kFirstStep = 1e-6;  // s
  static constexpr double kSliver = 0.99;
  // After failure `dt` is this much longer than what is tried next, so that it does not cut that.
  static constexpr double kRoom = 1.02;
  // Factor on the length that was good after the last jump: an occasional rejected step costs less than short steps.
  static constexpr double kGrowthAfterJump = 1.6;
  // The least length that counts as good after a jump, s: times resolve it.
  static constexpr double kLeastAfterJump = 1e-12;
  static constexpr double kShrinkage = 0.2;    // of a step whose end is not finite
  static constexpr double kFirstOrder = 1e-6;  // of a step: what has a negligible square
  static constexpr double kWithin = 1e-2;      // of a step: how far from its end the states within are as good as that
  // Further from an edge than any resolution, rad: a quick look suffices.
  static constexpr double kNear = 1e-6;

  struct Try {
    State end;
    double length = 0;  // s
  };

  double share(double t) const { return (t - start_t_) / last_try_.length; }

  // Where the step starts: at x, or at what the effects of events make of x.
  const State& settled_start(System& system, const State& x, double t) {
    if (settled_ && !starts_elsewhere_) return x;
    if (!settled_ || t != t_ || (x.values != x_.values).any()) {
      x_ = start_ = x;
      t_ = t;
      settle(system, start_, t);
      starts_elsewhere_ = true;
    }
    return start_;
  }

  // Tries a step of this length; its end is in last_try_, the length to try next in next_dt_.
  bool try_length(System& system, const State& start, double t, double length) {
    next_dt_ = length;
    const Result result = stepper_->try_step(system, start, t, last_try_.end, next_dt_);
    succeeded_ = result == boost::numeric::odeint::success;
    // odeint's step size control accepts a step whose error is NaN.
    if (succeeded_ && !std::isfinite(last_try_.end.values.sum())) {
      next_dt_ = kShrinkage * length;
      succeeded_ = false;
    }
    if (succeeded_) last_try_.length = length;
    return succeeded_;
  }

  // Ends the step of this length at the first event within it. If the last try failed, the one before it stands and is
  // made again, so that the method knows the states within it; false if that fails, too.
  bool end_at_events(System& system, const State& start, double t, double length) {
    remember(length);
    residual_dt_ = 0;
    if (system.rest_may_change(start.velocities(), last_try_.end.velocities())) end_at_brief_rest(system, start, t);
    std::apply([&](const auto&... event) { (end_at(event, system, start, t), ...); }, events_);
    return succeeded_ || !interpolates() || try_length(system, start, t, last_try_.length);
  }

  void remember(double length) {
    const double wanted = dt_;
    dt_ = next_dt_;
    if (after_jump_) dt_after_jump_ = std::max(kGrowthAfterJump * dt_, kLeastAfterJump);
    after_jump_ = false;
    if (length < wanted) dt_ = std::max(dt_, wanted);  // the bound cut it short, not its error
  }

  // Ends the step where the base rests, or moves, for a moment within it only, or soon and for a moment before it does
  // for longer.
  [[gnu::noinline]] void end_at_brief_rest(System& system, const State& start, double t) {
    if (!stepper_->interpolates()) return;
    State x;
    const auto before = [&](double share) {
      stepper_->state_within(system, share, x);
      return -system.past_rest_change(x.velocities());
    };
    constexpr int kBits = 10;
    double low = 0, high = 1;
    if (system.past_rest_change(last_try_.end.velocities()) > 0) {
      for (int bit = 0; bit < kBits; ++bit) {
        const double middle = 0.5 * (low + high);
        (before(middle) > 0 ? low : high) = middle;
      }
      low = -low;  // Brent's method begins at the upper end, which now is the step's start
      high = 0;
    }
    std::uintmax_t iterations = 30;
    const auto [at, least] = boost::math::tools::brent_find_minima(
        [&](double share) { return before(std::abs(share)); }, low, high, kBits, iterations);
    if (!(least < 0)) return;
    try_before_ = last_try_;
    ++record_->statistics.location_steps;
    if (!try_length(system, start, t, std::abs(at) * last_try_.length)) last_try_ = try_before_;
  }

  // Ends the step at the event, if that happens within it: by Newton's method within a bracket, or by bisection where
  // the speed is not known. A remainder, residual_dt_, with a negligible square is extrapolated.
  template <class Event>
  void end_at(const Event& event, System& system, const State& start, double t) {
    const auto first = [&] { return first_crossing(event, system, {start, t, last_try_.end, last_try_.length}); };
    Crossing crossing = first();
    if (!crossing) return;
    double low = 0, high = last_try_.length, length = crossing.dt;
    Try past_event = last_try_;
    residual_dt_ = 0;
    if constexpr (!Event::kEndsPast) {
      if (length <= event.width(high)) return;  // a wheel on its edge: the end decides whether it leaves
      length = by_interpolation(event, system, crossing.condition, length);
    }
    for (int tries = 0; tries < Event::kMaxTries; ++tries) {
      if (!(length > low && length < high)) length = 0.5 * (low + high);
      try_before_ = last_try_;
      ++record_->statistics.location_steps;
      if (!try_length(system, start, t, length)) {
        if (Event::kEndsPast) break;
        last_try_ = try_before_;
        high = length;
        continue;
      }
      const auto witness = [&](int condition) { return event.witness(system, last_try_.end, t + length, condition); };
      if (const Crossing other = first(); other && other.condition != crossing.condition) {
        const Witness earlier = witness(other.condition);
        if (earlier.past > earlier.resolution) {
          crossing = other;
          high = length;
          length = crossing.dt;
          continue;
        }
      }
      const auto [past, speed, resolution] = witness(crossing.condition);
      if (std::abs(past) <= resolution) return;
      (past > 0 ? high : low) = length;
      if (past > 0) past_event = last_try_;
      if (high - low <= event.width(high)) break;
      if constexpr (!Event::kEndsPast) {
        residual_dt_ = -past / speed;
        if (interpolates()) {
          residual_dt_ = by_interpolation(event, system, crossing.condition, length + residual_dt_) - length;
        }
        if (speed > 0 && can_extrapolate(system.modes(), event.wheel(crossing.condition), resolution)) return;
        residual_dt_ = 0;
      }
      length = speed > 0 ? length - past / speed : low;  // low: bisect
    }
    if (Event::kEndsPast && !try_length(system, start, t, high)) last_try_ = past_event;
  }

  // When the event happens by the states that the method knows within the last try, or a little after its end: a try
  // of that length usually is the last one. By Newton's method from `guess`.
  template <class Event>
  double by_interpolation(const Event& event, const System& system, int condition, double guess) const {
    State x;
    double length = guess;
    for (int iteration = 0; iteration < 2; ++iteration) {
      const double share = length / last_try_.length;
      if (!(share > 0 && share < 1 + kWithin) || !stepper_->interpolates()) return guess;
      stepper_->state_within(system, share, x);
      const Witness witness = event.witness(system, x, 0, condition);
      if (!(witness.speed > 0)) return guess;
      length -= witness.past / witness.speed;
    }
    return length;
  }

  // Moves the end x of the last try by residual_dt_.
  void extrapolate(const System& system, State& x) const {
    if (stepper_->interpolates()) {
      State end, there;
      stepper_->state_within(system, 1, end);
      stepper_->state_within(system, 1 + residual_dt_ / last_try_.length, there);
      x.values += there.values - end.values;
    } else {
      x.values += residual_dt_ * secant();
    }
  }

  // Slope of the state at the end of the step, by the last two tries.
  State::Values secant() const {
    return (last_try_.end.values - try_before_.end.values) / (last_try_.length - try_before_.length);
  }

  // Whether the end of the step, residual_dt_ (s) off an edge, may be moved there: by the states that the method knows
  // or to first order, at the secant's slope, which is that of the middle between the two tries. All wheels must stay
  // within their edges but the one that reaches its own.
  bool can_extrapolate(const ContactModes& modes, int wheel, double resolution) const {
    const double residual = std::abs(residual_dt_);
    if (stepper_->interpolates()) {
      if (!(residual < kWithin * last_try_.length)) return false;
    } else {
      const double off = residual + std::abs(last_try_.length - try_before_.length);
      const double acceleration = secant().col(3).abs().maxCoeff();
      if (!(residual < kFirstOrder * last_try_.length && residual * off * acceleration < resolution)) return false;
    }
    const Wheels phi = last_try_.end.phi() + residual_dt_ * last_try_.end.dphi();
    for (int k = 0; k < kWheels; ++k) {
      if (k != wheel && !(phi[k] > modes.lower_edge()[k] && phi[k] < modes.upper_edge()[k])) return false;
    }
    return true;
  }

  // The effects of events where the wheels now are: for each wheel, those of the event that concerns its contact.
  void settle(System& system, State& x, double t) {
    settled_ = true;
    while (RestChanges<System>::apply(system, x)) {
      stepper_->restart();  // its friction is no start for what comes
      begin_afresh();
    }
    const ContactModes& modes = system.modes();
    if (inside_edges(modes, x.phi(), x.phi(), kNear) && !modes.mixed()) return;
    for (int i = 0; i < kWheels; ++i) {  // up to the first event that concerns the wheel
      std::apply([&](auto&... event) { (void)(... || apply_to_wheel(event, system, x, t, i)); }, events_);
    }
  }

  // Whether the event is the one for the contact of wheel i; if so, its effect has taken place.
  template <class Event>
  bool apply_to_wheel(Event& event, System& system, State& x, double t, int i) {
    if (!event.concerns(system.modes(), i)) return false;
    if (event.apply(system, x, t, i)) {
      stepper_->reset();
      begin_afresh();
    }
    return true;
  }

  void begin_afresh() {
    dt_ = dt_after_switch_;
    restarting_ = true;
  }

  std::unique_ptr<SmoothStepper<System>> stepper_;
  Tolerance tolerance_;
  MotionRecord* record_;
  std::tuple<EdgeReached<System>, SharingEnds<System>, AveragingEnds<System>, RestChanges<System>,
             TippingReached<System>>
      events_;

  // Of the step under way, the last two tries; what is left to the event, s.
  Try last_try_, try_before_;
  bool succeeded_ = false;  // whether the last try did
  double residual_dt_ = 0;
  double next_dt_ = 0;

  // Lengths that are worth trying: now, after a switch, after a jump of the torque, s.
  double dt_ = kFirstStep, dt_after_switch_ = kFirstStep;
  double dt_after_jump_ = kInfinity;
  bool restarting_ = false, after_jump_ = false;

  // A start x_ at time t_ that is not the last step's end, and what the effects of events turn it into: start_.
  bool settled_ = false, starts_elsewhere_ = false;
  State x_, start_;
  double t_ = 0;

  double start_t_ = 0;       // of the last step, s
  bool unfinished_ = false;  // whether the effects of events at its end are still to come
};

}  // namespace youbot_base_sim
