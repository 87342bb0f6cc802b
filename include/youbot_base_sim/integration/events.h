#pragma once

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/integration/contact_system.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/tolerance.h"

// The events at which EventLocatingStepper ends a step: a condition, which ends it, and an effect, which takes place
// wherever a step or the motion begins or ends. Each event has
//   a condition   kConditions                       how many; the first one that is met within a step counts
//                 possible(system, step)            a quick look: false if none is met within the step
//                 witness(system, x, t, condition)  how far the state x at time t is past it
//   a location    kEndsPast                         whether the step ends past the event (by bisection) or on it
//                 width(length)                     s: how closely it is located within a step of that length
//                 kMaxTries                         how often a step may be repeated for that
//                 wheel(condition)                  the wheel that it is about; unless kEndsPast
//   an effect     due(system, x)                    a quick look: false if the state x brings about none
//                 concerns(modes, subject)          whether it is the one for this subject in its present contact
//                 apply(system, x, t, subject)      changes contacts and state
// A subject is the base or a wheel. An effect need not end its condition: what is true at a step's start is no event.
namespace youbot_base_sim {

/// A step of a System from `start` at time t (s) to `end`, dt later.
struct Step {
  const State& start;
  double t;
  const State& end;
  double dt;
};

/// Distance of a state past an event, in any unit.
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

/// The subject of an effect: the base, or wheel 0 to 3.
constexpr int kBase = -1;

/// The part of the equations that an effect has changed: nothing, contacts, or all friction.
enum class Effect { kNone, kContact, kFriction };

/// The cubic on [0, 1] with given values and slopes at both ends (Hermite's).
struct HermiteCubic {
  double start, end, start_slope, end_slope;

  double operator()(double s) const {
    const double rise = end - start;
    return start +
           s * (start_slope + s * (3 * rise - 2 * start_slope - end_slope + s * (start_slope + end_slope - 2 * rise)));
  }

  /// The point in [0, high] at which it rises through zero; it must be positive at `high`, but for rounding. At 0 it
  /// counts as negative, because a wheel that starts on an edge may leave it and come back.
  double root(double high) const {
    constexpr double kTiny = std::numeric_limits<double>::min();
    std::uintmax_t iterations = 40;
    const auto [low, up] = boost::math::tools::toms748_solve(*this, 0.0, high, std::min((*this)(0), -kTiny),
                                                             std::max((*this)(high), kTiny),
                                                             boost::math::tools::eps_tolerance<double>(50), iterations);
    return 0.5 * (low + up);
  }

  /// The point of its local maximum; not a number if it has none.
  double maximum() const {
    const double rise = end - start, a = 3 * (start_slope + end_slope - 2 * rise);
    const double half_b = 3 * rise - 2 * start_slope - end_slope;  // the slope is a s^2 + 2 half_b s + start_slope
    const double root = std::sqrt(half_b * half_b - a * start_slope);
    return half_b < 0 ? start_slope / (root - half_b) : -(half_b + root) / a;
  }
};

/// The first crossing within a step of an event that is located by Newton's method: by the cubic through `past` and its
/// speed at both ends, so that there and back is seen.
inline Crossing crossing_of_cubic(const Witness& start, const Witness& end, int condition, double dt) {
  // The cubic lies below the largest of Bezier's points.
  const double third = dt / 3, before = start.past + third * start.speed, after = end.past - third * end.speed;
  if (!(std::max(end.past, std::max(before, after)) > 0)) return {};
  const HermiteCubic past{start.past, end.past, start.speed * dt, end.speed * dt};
  const double top = past.maximum();
  const bool over_the_top = top > 0 && top < 1 && past(top) > 0;
  if (!over_the_top && !(end.past > 0)) return {};
  return {condition, dt * past.root(over_the_top ? top : 1)};
}

/// The first condition of an event that is met within a step. Of an event that is located by bisection, the first one
/// in number that holds at the step's end and did not at its start.
template <class Event>
Crossing first_crossing(const Event& event, const ContactSystem& system, const Step& step) {
  Crossing first;
  if (!event.possible(system, step)) return first;
  for (int condition = 0; condition < Event::kConditions; ++condition) {
    const Witness end = event.witness(system, step.end, step.t + step.dt, condition);
    if constexpr (Event::kEndsPast) {
      if (end.past > 0 && !(event.witness(system, step.start, step.t, condition).past > 0)) return {condition, 0};
    } else {
      const Witness start = event.witness(system, step.start, step.t, condition);
      const Crossing other = crossing_of_cubic(start, end, condition, step.dt);
      if (other.dt < first.dt) first = other;
    }
  }
  return first;
}

/// A wheel reaches an edge: it goes over to the next roller, rests on both if it chatters, or is averaged if too fast.
class EdgeReached {
 public:
  EdgeReached(const Tolerance& tolerance, MotionRecord& record) : tolerance_(tolerance), record_(&record) {}

  static constexpr int kConditions = 2 * kWheels;  // the upper and the lower edge of each wheel
  static constexpr bool kEndsPast = false;
  static double width(double length) { return std::numeric_limits<double>::epsilon() * length; }
  static constexpr int kMaxTries = 100;
  static constexpr int wheel(int condition) { return condition / 2; }

  static bool possible(const ContactSystem& system, const Step& step) {
    // A cubic lies in the hull of Bezier's points.
    const double third = step.dt / 3;
    const Wheels a = step.start.phi() + third * step.start.dphi(), b = step.end.phi() - third * step.end.dphi();
    return !inside_edges(system.modes(), a.min(b).min(step.end.phi()), a.max(b).max(step.end.phi()), 0);
  }
  static Witness witness(const ContactSystem& system, const State& x, double, int condition) {
    const int i = wheel(condition), direction = condition % 2 == 0 ? +1 : -1;
    const double edge = direction > 0 ? system.modes().upper_edge()[i] : system.modes().lower_edge()[i];
    return {direction * (x.phi()[i] - edge), direction * x.dphi()[i], resolution(edge, x.dphi()[i])};
  }

  static bool due(const ContactSystem& system, const State& x) {
    constexpr double kEdgeMargin = 1e-6;  // rad, further from an edge than any resolution
    return !inside_edges(system.modes(), x.phi(), x.phi(), kEdgeMargin);
  }
  static bool concerns(const ContactModes& modes, int i) { return i != kBase && modes.on_one_roller(i); }
  Effect apply(ContactSystem& system, State& x, double t, int i);

  /// Time (s) in which the first wheel reaches an edge that it does not stand on, at these accelerations (rad/s^2).
  static double time_to_edge(const ContactModes& modes, const State& x, const Wheels& ddphi);
  /// Stands wheel i of x, whose angle was `start` (rad) at time t (s), on the roller that it has come to dt later,
  /// however many it has passed: the effect of a step that no event has ended.
  void pass(ContactModes& modes, State& x, double t, double dt, int i, double start) const;

 private:
  static constexpr double kTimeResolution = 1e-13;  // s; the promised 1e-12 with room for what sums

  // True if wheel angles from `low` to `high` (rad) are further than `margin` (rad) from the edges of their contacts.
  static bool inside_edges(const ContactModes& modes, const Wheels& low, const Wheels& high, double margin) {
    return (low - modes.lower_edge()).min(modes.upper_edge() - high).minCoeff() > margin;
  }

  // Distance from an edge (rad) below which a wheel stands on it.
  static double resolution(double edge, double dphi) {
    return std::max(kTimeResolution * std::abs(dphi),
                    4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(edge)));
  }

  // True if wheel i, on an edge, rotates in `direction`, or is about to.
  static bool moves(const ContactSystem& system, const State& x, double t, int i, int direction);

  Tolerance tolerance_;
  MotionRecord* record_;
};

/// Base of events that are located by bisection: forces hardly jump there, the time need not be exact.
struct Bisected {
  static constexpr bool kEndsPast = true;
  static double width(double length) { return 1e-6 * length; }
  // An event at the start of the step has no width: halving on would end in steps of no length.
  static constexpr int kMaxTries = 40;
};

/// One of the two rollers that share a wheel carries it alone: it is released from sliding mode.
struct SharingEnds : Bisected {
  static constexpr int kConditions = kWheels;
  static bool possible(const ContactSystem& system, const Step&) { return system.modes().shares(); }
  static Witness witness(const ContactSystem& system, const State& x, double t, int i) {
    if (!system.modes().shared(i)) return {-1};
    const double alpha = system.sharing(i, x, t).alpha;
    return {std::max(alpha - 1, -alpha)};
  }

  static bool due(const ContactSystem& system, const State&) { return system.modes().shares(); }
  static bool concerns(const ContactModes& modes, int i) { return i != kBase && modes.shared(i); }
  Effect apply(ContactSystem& system, State& x, double t, int i);

  MotionRecord* record;
};

/// A wheel whose contact is averaged becomes slow enough for its switches to be located again.
struct AveragingEnds : Bisected {
  static constexpr int kConditions = kWheels;
  static bool possible(const ContactSystem& system, const Step&) { return system.modes().averages(); }
  static Witness witness(const ContactSystem& system, const State& x, double, int i) {
    return {system.modes().averaged(i) ? system.modes().below_resolution_limit(i, x) : -1};
  }

  static bool due(const ContactSystem& system, const State&) { return system.modes().averages(); }
  static bool concerns(const ContactModes& modes, int i) { return i != kBase && modes.averaged(i); }
  Effect apply(ContactSystem& system, State& x, double t, int i);

  MotionRecord* record;
};

/// The base is slow or fast enough for the next level of its RestFriction, of which the last one holds it at rest.
struct RestChanges : Bisected {
  static constexpr int kConditions = 1;
  static bool possible(const ContactSystem& system, const Step& step) {
    return system.rest().margin(step.end.velocities()) > 0;
  }
  static Witness witness(const ContactSystem& system, const State& x, double, int) {
    return {system.rest().margin(x.velocities())};
  }

  static bool due(const ContactSystem& system, const State& x) { return system.rest().margin(x.velocities()) > 0; }
  static bool concerns(const ContactModes&, int subject) { return subject == kBase; }
  static Effect apply(ContactSystem& system, State& x, double t, int subject);
};

/// The base reaches its tipping limit, where MotionRecord ends the motion, once the step is recorded.
struct TippingReached : Bisected {
  static double width(double) { return 1e-10; }

  static constexpr int kConditions = 1;
  bool possible(const ContactSystem& system, const Step&) const { return system.reacts() && record->ends_tipping; }
  static Witness witness(const ContactSystem& system, const State& x, double t, int) {
    return {system.reactions(x, t).tipping != Side::kNone ? 1.0 : -1.0};
  }

  static bool due(const ContactSystem&, const State&) { return false; }
  static bool concerns(const ContactModes&, int) { return false; }
  static Effect apply(ContactSystem&, State&, double, int) { return Effect::kNone; }

  const MotionRecord* record;
};

}  // namespace youbot_base_sim
