#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/integration/edge_crossing.h"
#include "youbot_base_sim/integration/motion_record.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/contact_modes.h"

// The events at which LocatedStepper ends a step. An event has
//   a condition   find(system, step, i)             the condition i, of kConditions, as it is met within the step; or
//   none
//                 witness(system, found, x, t)      how far the state x at time t is past it
//   a location    width(length)                     s: how closely it is located within a step of that length
//                 kEndsPast                         whether the step ends past the event rather than on it
//   an effect     concerns(modes, i)                whether it is the one for wheel i in its present contact
//                 apply(system, x, t, i)            changes contacts and state; true if the motion starts afresh
namespace youbot_base_sim {

/// A step of a System from `start` at time t (s), as far as it is known: its end `dt` later.
struct Step {
  const State& start;
  double t;
  const State& end;
  double dt;
};

/// How far a state is past an event, in any unit.
struct Witness {
  double past;             ///< positive past the event
  double speed = 0;        ///< its time derivative; 0: not known
  double resolution = -1;  ///< |past| below which the state is on the event; negative: only past or not counts
};

/// A condition that is met within a step, where it is not known.
struct Found {
  int wheel = -1;  ///< none: -1
  double dt = 0;   ///< after the start of the step, s; 0: not known
  explicit operator bool() const { return wheel >= 0; }
};

/// A wheel reaches an edge of its roller. It goes over to the next one; or, where it chatters, rests on both; or has
/// its contact averaged, where it is too fast.
class EdgeReached {
 public:
  EdgeReached(const Tolerance& tolerance, MotionRecord& record) : tolerance_(tolerance), record_(&record) {}

  static constexpr int kConditions = 1;  // of all wheels, the first
  static constexpr bool kEndsPast = false;
  static double width(double length) { return std::numeric_limits<double>::epsilon() * length; }

  template <class System>
  EdgeCrossing find(const System& system, const Step& step, int) const {
    return first_crossing(system.modes(), step.start, step.end, step.dt);
  }
  template <class System>
  Witness witness(const System&, const EdgeCrossing& crossing, const State& x, double) const {
    const double speed = crossing.speed(x);
    return {crossing.past(x), speed, resolution(crossing.edge, speed)};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.on_one_roller(i); }
  template <class System>
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
    const std::int64_t from = modes.roller(i);
    if (record_->sliding_mode.enters(system, x, t, i, direction, error_scale(tolerance_, x.velocities()).v[0])) {
      ++record_->statistics.shared_contacts;
      system.enter_sliding(i, direction > 0 ? from : from - 1, x);
      return true;
    }
    const double edge = direction > 0 ? modes.upper_edge()[i] : modes.lower_edge()[i];
    modes.switch_roller(i, from + direction, x);
    x.phi()[i] = ContactModes::far_side(edge, direction);
    record_->switches.record(modes, i, from, t, x.phi()[i]);
    if (modes.above_location_limit(i, x)) {
      modes.average(i);
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
  template <class System>
  static bool moves(const System& system, const State& x, double t, int i, int direction) {
    if (x.dphi()[i] != 0) return direction * x.dphi()[i] > 0;
    State dxdt;
    system(x, dxdt, t);
    return direction * dxdt.dphi()[i] > 0;
  }

  Tolerance tolerance_;
  MotionRecord* record_;
};

/// One of the two rollers that share a wheel carries it alone: it is released from sliding mode. Forces are continuous
/// there, or nearly so: the time need not be exact.
class SharingEnds {
 public:
  explicit SharingEnds(MotionRecord& record) : record_(&record) {}

  static constexpr int kConditions = kWheels;
  static constexpr bool kEndsPast = true;
  static double width(double length) { return 1e-6 * length; }

  template <class System>
  Found find(const System& system, const Step& step, int i) const {
    if (!system.modes().shares() || !system.modes().shared(i)) return {};
    return witness(system, {i}, step.end, step.t + step.dt).past > 0 ? Found{i} : Found{};
  }
  template <class System>
  Witness witness(const System& system, const Found& found, const State& x, double t) const {
    const double alpha = system.sharing(found.wheel, x, t).alpha;
    return {std::max(alpha - 1, -alpha)};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.shared(i); }
  template <class System>
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
    record_->switches.record(modes, i, from, t, x.phi()[i]);  // nothing, if it stays on the roller that it reached last
    record_->sliding_mode.left(i);
    return true;
  }

 private:
  MotionRecord* record_;
};

/// A wheel whose contact is averaged becomes slow enough for its switches to be located again.
class AveragingEnds {
 public:
  explicit AveragingEnds(MotionRecord& record) : record_(&record) {}

  static constexpr int kConditions = kWheels;
  static constexpr bool kEndsPast = true;
  static double width(double length) { return 1e-6 * length; }

  template <class System>
  Found find(const System& system, const Step& step, int i) const {
    const ContactModes& modes = system.modes();
    return modes.averages() && modes.averaged(i) && modes.below_resolution_limit(i, step.end) > 0 ? Found{i} : Found{};
  }
  template <class System>
  Witness witness(const System& system, const Found& found, const State& x, double) const {
    return {system.modes().below_resolution_limit(found.wheel, x)};
  }

  static bool concerns(const ContactModes& modes, int i) { return modes.averaged(i); }
  template <class System>
  bool apply(System& system, State& x, double t, int i) {
    ContactModes& modes = system.modes();
    if (!(modes.below_resolution_limit(i, x) > 0)) return false;
    record_->record_passed_rollers(modes, i, x, t);
    modes.set_roller(i, modes.roller(i));
    return true;
  }

 private:
  MotionRecord* record_;
};

/// The base reaches its tipping limit, where the motion ends: the effect is ReactionMonitor's.
class TippingReached {
 public:
  explicit TippingReached(const MotionRecord& record) : record_(&record) {}

  static constexpr int kConditions = 1;
  static constexpr bool kEndsPast = true;
  static double width(double) { return 1e-10; }

  template <class System>
  Found find(const System& system, const Step& step, int) const {
    if (!system.reacts() || !record_->reactions.ends_tipping()) return {};
    return tips(system, step.end, step.t + step.dt) && !tips(system, step.start, step.t) ? Found{0} : Found{};
  }
  template <class System>
  Witness witness(const System& system, const Found&, const State& x, double t) const {
    return {tips(system, x, t) ? 1.0 : -1.0};
  }

  static bool concerns(const ContactModes&, int) { return false; }
  template <class System>
  bool apply(System&, State&, double, int) {
    return false;
  }

 private:
  template <class System>
  static bool tips(const System& system, const State& x, double t) {
    return system.reactions(x, t).tipping != Side::kNone;
  }

  const MotionRecord* record_;
};

}  // namespace youbot_base_sim
