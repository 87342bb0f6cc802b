#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/integration/hermite_cubic.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/contact_modes.h"

// The events at which EventLocatingStepper ends a step. An event has
//   conditions    kConditions                       how many; the first one that is met counts
//                 possible(system, step)            a quick look: false if none is met within the step
//                 witness(system, x, t, condition)  how far the state x at time t is past it
//                 wheel(condition)                  the wheel that it is about, where its speed is known
//   a location    kEndsPast                         whether the step ends past the event rather than on it
//                 width(length)                     s: how closely it is located within a step of that length
//                 kMaxTries                         how often a step may be repeated for that
//   an effect     concerns(modes, i)                whether it is the one for wheel i in its present contact
//                 apply(system, x, t, i)            changes contacts and state; true if the motion starts afresh
// RestChanges, which is about the whole base, has apply(system, x) instead.
namespace youbot_base_sim {

/// A step of a System from `start` at time t (s) to `end`, dt later.
struct Step {
  const State& start;
  double t;
  const State& end;
  double dt;
};

/// How far a state is past an event, in any unit.
struct Witness {
  double past;             ///< positive past the event
  double speed = 0;        ///< its time derivative; 0 where it is not known
  double resolution = -1;  ///< |past| within which the state is on the event; negative: it never is
};

/// A condition that is met within a step, `dt` (s) after its start; 0 where that is not known.
struct Crossing {
  int condition = -1;  ///< none: -1
  double dt = kInfinity;
  explicit operator bool() const { return condition >= 0; }
};

/// The first condition of an event that is met within a step: by the cubics through `past` and its speed at both ends,
/// so that there and back is seen; where the speed is not known, any that is met at the end.
template <class Event, class System>
Crossing first_crossing(const Event& event, const System& system, const Step& step) {
  Crossing first;
  if (!event.possible(system, step)) return first;
  for (int condition = 0; condition < Event::kConditions; ++condition) {
    const Witness end = event.witness(system, step.end, step.t + step.dt, condition);
    if (Event::kEndsPast) {
      if (end.past > 0) return {condition, 0};
      continue;
    }
    if (!std::isfinite(end.past)) continue;
    const Witness start = event.witness(system, step.start, step.t, condition);
    const HermiteCubic past{start.past, end.past, start.speed * step.dt, end.speed * step.dt};
    const double top = past.maximum();
    const bool over_the_top = top > 0 && top < 1 && past(top) > 0;
    if (!over_the_top && !(end.past > 0)) continue;
    const double at = step.dt * past.root(over_the_top ? top : 1);
    if (at < first.dt) first = {condition, at};
  }
  return first;
}

/// Whether wheel angles from `low` to `high` (rad) are further than `margin` (rad) from the edges of their contacts.
inline bool inside_edges(const ContactModes& modes, const Wheels& low, const Wheels& high, double margin) {
  return (low - modes.lower_edge()).min(modes.upper_edge() - high).minCoeff() > margin;
}

/// A wheel reaches an edge: it goes over to the next roller, rests on both if it chatters, or is averaged if too fast.
template <class System>
class EdgeReached {
 public:
  EdgeReached(const Tolerance& tolerance, MotionRecord& record) : tolerance_(tolerance), record_(&record) {}

  static constexpr int kConditions = 2 * kWheels;  // the upper and the lower edge of each wheel
  static constexpr bool kEndsPast = false;
  static double width(double length) { return std::numeric_limits<double>::epsilon() * length; }
  static constexpr int kMaxTries = 100;
  static constexpr int wheel(int condition) { return condition / 2; }

  static bool possible(const System& system, const Step& step) {
    // A cubic lies in the hull of Bezier's points.
    const double third = step.dt / 3;
    const Wheels a = step.start.phi() + third * step.start.dphi(), b = step.end.phi() - third * step.end.dphi();
    return !inside_edges(system.modes(), a.min(b).min(step.end.phi()), a.max(b).max(step.end.phi()), 0);
  }
  static Witness witness(const System& system, const State& x, double, int condition) {
    const int i = wheel(condition), direction = condition % 2 == 0 ? +1 : -1;
    const double edge = direction > 0 ? system.modes().upper_edge()[i] : system.modes().lower_edge()[i];
    return {direction * (x.phi()[i] - edge), direction * x.dphi()[i], resolution(edge, x.dphi()[i])};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.on_one_roller(i); }
  bool apply(System& system, State& x, double t, int i) {
    ContactModes& modes = system.modes();
    const double phi = x.phi()[i];
    int direction = 0;
    if (phi >= modes.upper_edge()[i] - resolution(phi, x.dphi()[i])) direction = +1;
    if (phi <= modes.lower_edge()[i] + resolution(phi, x.dphi()[i])) direction = -1;
    if (direction == 0) return false;
    if (!moves(system, x, t, i, direction)) {
      modes.keep_inside(i, x);
      return false;
    }
    if (record_->sliding_mode.stands(system, x, t, i, direction)) {
      modes.widen(i, SlidingMode::kHop);
      return false;
    }
    const std::int64_t from = modes.roller(i);
    const double max_momentum = error_scale(tolerance_, x.velocities()).v[0];
    if (record_->sliding_mode.enters(system, x, t, i, direction, max_momentum)) {
      ++record_->statistics.shared_contacts;
      const double momentum = system.momentum(i, x);
      if (momentum >= max_momentum) record_->statistics.speed_of_rests += momentum;
      system.enter_sliding(i, direction > 0 ? from : from - 1, x);
      return true;
    }
    const double edge = direction > 0 ? modes.upper_edge()[i] : modes.lower_edge()[i];
    modes.switch_roller(i, from + direction, x);
    x.phi()[i] = ContactModes::far_side(edge, direction);
    record_->record_switch(modes, i, from, t, x.phi()[i]);
    if (modes.above_location_limit(i, x)) {
      modes.enter_averaging(i);
      ++record_->statistics.averaged_contacts;
    }
    return true;
  }

 private:
  static constexpr double kTimeResolution = 1e-13;  // s; the promised 1e-12 with room for what sums

  // Distance from an edge (rad) below which a wheel stands on it.
  static double resolution(double edge, double dphi) {
    return std::max(kTimeResolution * std::abs(dphi),
                    4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(edge)));
  }

  // Whether wheel i, on an edge, turns in `direction`, or is about to.
  static bool moves(const System& system, const State& x, double t, int i, int direction) {
    if (x.dphi()[i] != 0) return direction * x.dphi()[i] > 0;
    State dxdt;
    system(x, dxdt, t);
    return direction * dxdt.dphi()[i] > 0;
  }

  Tolerance tolerance_;
  MotionRecord* record_;
};

/// Events located by bisection, one condition for each wheel. Forces hardly jump there: the time need not be exact.
struct WheelEvent {
  static constexpr int kConditions = kWheels;
  static constexpr bool kEndsPast = true;
  static double width(double length) { return 1e-6 * length; }
  // An event at the start of the step has no width: halving on would end in steps of no length.
  static constexpr int kMaxTries = 40;
  MotionRecord* record;
};

/// One of the two rollers that share a wheel carries it alone: it is released from sliding mode.
template <class System>
struct SharingEnds : WheelEvent {
  static bool possible(const System& system, const Step&) { return system.modes().shares(); }
  static Witness witness(const System& system, const State& x, double t, int i) {
    if (!system.modes().shared(i)) return {-1};
    const double alpha = system.sharing(i, x, t).alpha;
    return {std::max(alpha - 1, -alpha)};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.shared(i); }
  bool apply(System& system, State& x, double t, int i) {
    const double alpha = system.sharing(i, x, t).alpha;
    if (alpha >= 0 && alpha <= 1) return false;
    ContactModes& modes = system.modes();
    const std::int64_t from = modes.roller(i), to = modes.lower_roller(i) + (alpha > 1 ? 1 : 0);
    if (to != from) {
      modes.switch_roller(i, to, x);
    } else {
      modes.set_roller(i, to);
    }
    modes.keep_inside(i, x);
    record->record_switch(modes, i, from, t, x.phi()[i]);  // nothing, if it stays on the roller that it reached last
    record->sliding_mode.left(i);
    return true;
  }
};

/// A wheel whose contact is averaged becomes slow enough for its switches to be located again.
template <class System>
struct AveragingEnds : WheelEvent {
  static bool possible(const System& system, const Step&) { return system.modes().averages(); }
  static Witness witness(const System& system, const State& x, double, int i) {
    return {system.modes().averaged(i) ? system.modes().below_resolution_limit(i, x) : -1};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.averaged(i); }
  bool apply(System& system, State& x, double t, int i) {
    ContactModes& modes = system.modes();
    if (!(modes.below_resolution_limit(i, x) > 0)) return false;
    record->record_passed_rollers(modes, i, x, t);
    modes.set_roller(i, modes.roller(i));
    return true;
  }
};

/// The base comes to rest, where friction holds it, or starts to move.
template <class System>
struct RestChanges {
  static constexpr int kConditions = 1;
  static constexpr bool kEndsPast = true;
  static double width(double length) { return 1e-6 * length; }
  static constexpr int kMaxTries = 40;

  static bool possible(const System& system, const Step& step) {
    return system.past_rest_change(step.end.velocities()) > 0;
  }
  static Witness witness(const System& system, const State& x, double, int) {
    return {system.past_rest_change(x.velocities())};
  }

  static bool concerns(const ContactModes&, int) { return false; }
  static bool apply(System&, State&, double, int) { return false; }
  static bool apply(System& system, const State& x) {
    if (!(system.past_rest_change(x.velocities()) > 0)) return false;
    system.change_rest(x.velocities());
    return true;
  }
};

/// The base reaches its tipping limit, where ReactionMonitor ends the motion.
template <class System>
struct TippingReached {
  static constexpr int kConditions = 1;
  static constexpr bool kEndsPast = true;
  static double width(double) { return 1e-10; }
  static constexpr int kMaxTries = 40;

  bool possible(const System& system, const Step& step) const {
    return system.reacts() && record->reactions.ends_tipping() && tips(system, step.end, step.t + step.dt) &&
           !tips(system, step.start, step.t);
  }
  static Witness witness(const System& system, const State& x, double t, int) {
    return {tips(system, x, t) ? 1.0 : -1.0};
  }

  static bool concerns(const ContactModes&, int) { return false; }
  static bool apply(System&, State&, double, int) { return false; }

  static bool tips(const System& system, const State& x, double t) {
    return system.reactions(x, t).tipping != Side::kNone;
  }

  const MotionRecord* record;
};

}  // namespace youbot_base_sim
