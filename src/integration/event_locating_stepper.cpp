#include "youbot_base_sim/integration/event_locating_stepper.h"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

EventLocatingStepper::EventLocatingStepper(std::unique_ptr<SmoothStepper> method, const Tolerance& tolerance,
                                           MotionRecord& record)
    : method_(std::move(method)),
      record_(&record),
      events_(EdgeReached(tolerance, record), SharingEnds{{}, &record}, AveragingEnds{{}, &record}, RestChanges{},
              TippingReached{{}, &record}) {}

EventLocatingStepper::Result EventLocatingStepper::try_step(ContactSystem& system, State& x, double& t, double& dt,
                                                            bool finishes) {
  const State& start = start_after_effects(system, x, t);
  const double bound = std::min(dt, system.max_step(start, t));
  const double beyond_edge = (1 + 0.25 * kMaxExtrapolation) * EdgeReached::time_to_edge(system.modes(), start, ddphi_);
  const double length = std::min(lengths_.next() < kMergeRemainder * bound ? lengths_.next() : bound, beyond_edge);
  if (!try_length(system, start, t, length) || !end_at_events(system, start, t)) {
    ++record_->statistics.rejected_steps;
    lengths_.rejected(next_dt_);
    dt = lengths_.next();
    return odeint::fail;
  }
  start_t_ = t;
  t = t + last_try_.length + residual_dt_;
  ddphi_ = (1 / last_try_.length) * (last_try_.end.dphi() - start.dphi());
  x = last_try_.end;
  if (residual_dt_ != 0) {
    State end, there;
    method_->state_within(system, 1, end);
    method_->state_within(system, 1 + residual_dt_ / last_try_.length, there);
    x.values += there.values - end.values;
  }
  ++record_->statistics.steps;
  lengths_.ended();
  point_ = Point::kEnded;
  if (finishes) finish(system, x, t);
  dt = kInfinity;
  return odeint::success;
}

void EventLocatingStepper::finish(ContactSystem& system, State& x, double t) {
  if (point_ != Point::kEnded) return;
  point_ = Point::kSettled;
  settle(system, x, t);
  if (system.reacts()) record_->record_reactions(system.reactions(x, t), t, t - start_t_);
}

void EventLocatingStepper::finish_foreign_step(ContactSystem& system, const State& start, State& x, double t,
                                               double dt) {
  const EdgeReached& edge = std::get<EdgeReached>(events_);
  for (int i = 0; i < kWheels; ++i) {
    if (EdgeReached::concerns(system.modes(), i)) edge.pass(system.modes(), x, t - dt, dt, i, start.phi()[i]);
  }
  start_t_ = t - dt;
  point_ = Point::kEnded;
  finish(system, x, t);
  restart();
}

void EventLocatingStepper::torque_jumped() {
  point_ == Point::kEnded ? method_->restart() : method_->reset();
  lengths_.torque_jumped();
  point_ = Point::kFresh;
}

void EventLocatingStepper::restart() {
  method_->restart();
  lengths_ = {};
  point_ = Point::kFresh;
}

// The start of the step: x, or what the effects of events make of x.
const State& EventLocatingStepper::start_after_effects(ContactSystem& system, const State& x, double t) {
  if (point_ == Point::kEnded || point_ == Point::kSettled) return x;
  if (point_ == Point::kFresh || t != t_ || (x.values != x_.values).any()) {
    x_ = start_ = x;
    t_ = t;
    settle(system, start_, t);
    point_ = Point::kReplaced;
  }
  return start_;
}

// Tries a step of this length, which then is last_try_, unless it fails; next_dt_ is the length to try next.
bool EventLocatingStepper::try_length(ContactSystem& system, const State& start, double t, double length) {
  next_dt_ = length;
  bool succeeds = method_->try_step(system, start, t, last_try_.end, next_dt_) == odeint::success;
  // odeint's step size control accepts a step whose error is NaN.
  if (succeeds && !std::isfinite(last_try_.end.values.sum())) {
    next_dt_ = kShrinkage * length;
    succeeds = false;
  }
  if (succeeds) last_try_.length = length;
  known_length_ = succeeds ? length : std::numeric_limits<double>::quiet_NaN();
  return succeeds;
}

// Ends the step that is the last try at the first event within it. Where a later try failed, the step is made again, so
// that the method knows the states within it; false if that fails, too.
bool EventLocatingStepper::end_at_events(ContactSystem& system, const State& start, double t) {
  lengths_.accepted(last_try_.length, next_dt_);
  residual_dt_ = 0;
  const RestFriction& rest = system.rest();
  if (rest.holds() && rest.may_change(start.velocities(), last_try_.end.velocities())) {
    end_at_brief_rest(system, start, t);
  }
  const auto locate = [&](const auto& event) {
    if (event.possible(system, {start, t, last_try_.end, last_try_.length})) end_at(event, system, start, t);
  };
  std::apply([&](const auto&... event) { (locate(event), ...); }, events_);
  if (system.jumps(start, last_try_.end)) {
    method_->reset();  // which else would accept a shorter step whatever its error
    next_dt_ = kShrinkage * last_try_.length;
    return false;
  }
  return known_length_ == last_try_.length || !interpolates() || try_length(system, start, t, last_try_.length);
}

// Ends the step where the base crosses the threshold of rest and comes back within it, or before it crosses for longer.
void EventLocatingStepper::end_at_brief_rest(ContactSystem& system, const State& start, double t) {
  if (!interpolates()) return;
  State x;
  const auto before = [&](double share) {
    method_->state_within(system, share, x);
    return -system.rest().margin(x.velocities());
  };
  constexpr int kBits = 10;
  double low = 0, high = 1;
  if (system.rest().margin(last_try_.end.velocities()) > 0) {
    for (int bit = 0; bit < kBits; ++bit) {
      const double middle = 0.5 * (low + high);
      (before(middle) > 0 ? low : high) = middle;
    }
    low = -low;  // Brent's method begins at the upper end, which now is the step's start
    high = 0;
  }
  std::uintmax_t iterations = 30;
  const auto [at, least] = boost::math::tools::brent_find_minima([&](double share) { return before(std::abs(share)); },
                                                                 low, high, kBits, iterations);
  if (!(least < 0)) return;
  try_before_ = last_try_;
  ++record_->statistics.location_steps;
  if (!try_length(system, start, t, std::abs(at) * last_try_.length)) last_try_ = try_before_;
}

// Ends the step at the event, if that happens within it: by Newton's method within a bracket, or by bisection where the
// speed is not known. A small remainder, residual_dt_, is left to the states that the method knows. Throughout, a step
// of `low` ends before the event, one of `high` past it, and last_try_ is one that succeeded.
template <class Event>
void EventLocatingStepper::end_at(const Event& event, ContactSystem& system, const State& start, double t) {
  const auto first = [&] { return first_crossing(event, system, {start, t, last_try_.end, last_try_.length}); };
  Crossing crossing = first();
  if (!crossing) return;
  double low = 0, high = last_try_.length, length = crossing.dt;
  Try past_event = last_try_;
  residual_dt_ = 0;
  if (!Event::kEndsPast && length <= event.width(high)) return;  // a wheel on its edge: the end decides if it leaves
  for (int tries = 0; tries < Event::kMaxTries; ++tries) {
    if constexpr (!Event::kEndsPast) {
      if (leaves_remainder(event, system, crossing.condition, length)) return;
    }
    if (!(length > low && length < high)) length = 0.5 * (low + high);
    try_before_ = last_try_;
    ++record_->statistics.location_steps;
    if (!try_length(system, start, t, length)) {
      last_try_ = try_before_;
      if constexpr (Event::kEndsPast) break;
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
    length = speed > 0 ? length - past / speed : low;  // low: bisect
  }
  if (Event::kEndsPast && !try_length(system, start, t, high)) last_try_ = past_event;
}

// Corrects `length` (s), a guess of the time from the start to an event, by Newton's method on the states that the
// method knows within the last try. True if what remains from its end, residual_dt_, is so short that these states are
// the step's end. All wheels must stay within their edges but the one that reaches its own.
template <class Event>
bool EventLocatingStepper::leaves_remainder(const Event& event, const ContactSystem& system, int condition,
                                            double& length) {
  if (!interpolates() || known_length_ != last_try_.length) return false;
  State x;
  double newton = length;
  for (int iteration = 0; iteration < 2; ++iteration) {
    const double share = newton / last_try_.length;
    if (!(share > 0 && share < 1 + kMaxExtrapolation)) return false;
    method_->state_within(system, share, x);
    const Witness witness = event.witness(system, x, 0, condition);
    if (!(witness.speed > 0)) return false;
    newton -= witness.past / witness.speed;
  }
  length = newton;
  const double remainder = length - last_try_.length;
  bool leaves = std::abs(remainder) < kMaxExtrapolation * last_try_.length;
  const Wheels phi = last_try_.end.phi() + remainder * last_try_.end.dphi();
  const Wheels room = (phi - system.modes().lower_edge()).min(system.modes().upper_edge() - phi);
  for (int k = 0; k < kWheels; ++k) leaves &= k == event.wheel(condition) || room[k] > 0;
  if (leaves) residual_dt_ = remainder;
  return leaves;
}

// The effects of events in state x: for the base and each wheel, that of the event which concerns it.
void EventLocatingStepper::settle(ContactSystem& system, State& x, double t) {
  const bool due = std::apply([&](const auto&... event) { return (... || event.due(system, x)); }, events_);
  if (!due) return;
  for (int subject = kBase; subject < kWheels; ++subject) {
    const auto apply = [&](auto& event) {
      if (!event.concerns(system.modes(), subject)) return false;
      note(event.apply(system, x, t, subject));
      return true;
    };
    std::apply([&](auto&... event) { (void)(... || apply(event)); }, events_);
  }
}

// The motion starts afresh after an effect. Friction that has changed its regularization is no start for what comes.
void EventLocatingStepper::note(Effect effect) {
  if (effect == Effect::kNone) return;
  effect == Effect::kFriction ? method_->restart() : method_->reset();
  lengths_.switched();
}

}  // namespace youbot_base_sim
