#pragma once

#include <cstdint>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/step_size_controller.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/physics/roller_switch.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Integrates a SlipSystem from switch to switch: a step ends where a wheel reaches the edge of its roller, located to
/// 1e-12 s (or to the resolution of phi, for a wheel that hardly turns), with phi on the far side, and the next one
/// starts afresh.
///
/// A wheel exactly on an edge stands on the roller that (2.1) names, unless its motion leaves that roller at once; a
/// wheel that touches the edge and turns back does not switch.
///
/// It asks this of a Stepper:
///
///   Stepper::System                what it integrates: a SlipSystem, or another one with edges and rollers
///   Stepper(tolerance)
///   stepper.begin(system, x, t)    steps that follow start here
///   stepper.step(dt)               computes one; false where that fails
///   stepper.error()                its error, 1 where it is just allowed
///   stepper.end(beyond)            State at its end, moved by `beyond` (s), whose square is nothing; end_phi(),
///                                  end_dphi(), end_velocities(), end_acceleration() for less
///   stepper.keep()                 the step stands: what follows may be predicted from it
///   stepper.forget()               the motion goes on in another way
///   stepper.forget(i)              the same, on account of wheel i
///   stepper.negligible(speed)      whether an error of the platform's velocity by `speed` (m/s) is allowed
template <class Stepper>
class SwitchingIntegrator {
 public:
  using System = typename Stepper::System;

  /// `rollers` is their number on a wheel.
  SwitchingIntegrator(const Tolerance& tolerance, int rollers) : rollers_(rollers), stepper_(tolerance) {}

  /// Advances (x, t) to t_end (s), within which the torque must be smooth. `on_switch(RollerSwitch, State&)` is called
  /// at each switch and may change velocities and gamma. Returns false where it gives up, at the (x, t) that it has
  /// come to: after more steps than kMostAttempts within kWindow, or where step sizes vanish.
  template <class OnSwitch>
  bool advance(System& system, State& x, double& t, double t_end, OnSwitch&& on_switch) {
    begun_ = false;
    settle(system, x, t, on_switch);
    while (t < t_end) {
      if (t > window_start_ + kWindow || t < window_start_) {
        window_start_ = t;
        attempts_ = 0;
      }
      if (++attempts_ > kMostAttempts || t + dt_ <= t) {
        ++statistics_.exhausted;
        restart();
        return false;
      }
      if (!attempt(system, x, t, t_end)) continue;
      ++statistics_.steps;
      settle(system, x, t, on_switch);
    }
    return true;
  }

  /// The torque jumps here: what follows starts with the step that the last jump was good for.
  void jump() {
    control_.restart();
    dt_ = std::min(dt_, dt_after_jump_);
    after_jump_ = true;
  }

  /// Forgets the step sizes of the past, as for a new initial state.
  void restart() {
    control_.restart();
    stepper_.forget();
    dt_ = dt_after_switch_ = kFirstStep;
    dt_after_jump_ = std::numeric_limits<double>::infinity();
    after_jump_ = false;
    window_start_ = std::numeric_limits<double>::infinity();
    reversals_.fill(0);
  }

  const IntegrationStatistics& statistics() const { return statistics_; }
  IntegrationStatistics& statistics() { return statistics_; }

 private:
  static constexpr double kFirstStep = 1e-6;  // s
  static constexpr int kMostHalvings = 40;
  // A rejected step after a jump now and then costs less than short ones after all jumps.
  static constexpr double kDaring = 1.6;
  static constexpr double kReleaseResolution = 1e-6;  // of the step
  static constexpr double kFirstOrder = 1e-6;         // of a step: the square of it is nothing
  static constexpr double kTimeResolution = 1e-13;    // s; the promised 1e-12 with room for what sums
  // Work is bounded per window of simulated time, so that no control period can take for ever.
  static constexpr double kWindow = 1e-3;  // s
  static constexpr int kMostAttempts = 4000;
  // A wheel may rest on two rollers when it has rocked between them kRocks times with less than kWindow between, and
  // must when it has done so kMostRocks times.
  static constexpr int kRocks = 8;
  static constexpr int kMostRocks = 32;

  struct Crossing {
    int wheel = -1;
    int direction = 0;
    double edge = 0;
    double dt = std::numeric_limits<double>::infinity();  // after the start of the step
  };

  // Distance from an edge (rad) below which a wheel stands on it.
  static double resolution(double edge, double dphi) {
    return std::max(kTimeResolution * std::abs(dphi),
                    4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(edge)));
  }

  // One try at a step towards t_end, cut short at the first edge that is reached. True if (x, t) moved on.
  bool attempt(const System& system, State& x, double& t, double t_end) {
    if (!begun_) {
      stepper_.begin(system, x, t);
      begun_ = true;
    }
    const double remaining = t_end - t;
    const double wanted = dt_;
    // A step that would leave a sliver goes to the end.
    const double dt = wanted < 0.99 * remaining ? wanted : remaining;
    if (!stepper_.step(dt)) {
      ++statistics_.rejected_steps;
      dt_ = 0.3 * dt;
      return false;
    }
    const double error = stepper_.error();
    dt_ = control_.next(dt, error);
    if (!(error <= 1)) {
      ++statistics_.rejected_steps;
      return false;
    }
    if (after_jump_) dt_after_jump_ = kDaring * dt_;
    after_jump_ = false;
    if (dt < wanted) dt_ = std::max(dt_, wanted);  // cut short by t_end, not for its error

    const Crossing crossing = first_crossing(system, x, dt);
    double taken = dt, beyond = 0;
    if (crossing.wheel >= 0) taken = locate(system, x, crossing, dt, beyond);
    if (system.shares()) taken = until_released(system, t, taken, beyond);
    t = taken == remaining ? t_end : t + taken + beyond;
    x = stepper_.end(beyond);
    stepper_.keep();
    begun_ = false;
    if (after_switch_) {
      dt_after_switch_ = std::max(kFirstStep, 0.5 * dt_);
      after_switch_ = false;
    }
    return true;
  }

  // First edge that a wheel reaches in the step of length dt that was computed last, by the cubic through phi and dphi
  // at both of its ends.
  Crossing first_crossing(const System& system, const State& x, double dt) const {
    const Wheels phi = stepper_.end_phi(), dphi = stepper_.end_dphi();
    Crossing first;
    if ((phi > system.lower_edge() && phi < system.upper_edge() && x.dphi() * dphi >= 0).all()) return first;
    for (int i = 0; i < kWheels; ++i) {
      for (const int direction : {+1, -1}) {
        const double edge = direction > 0 ? system.upper_edge()[i] : system.lower_edge()[i];
        // Progress towards the edge, beyond it at >= 0 (a roller's range holds its lower edge, not its upper one).
        const Cubic progress{direction * (x.phi()[i] - edge), direction * (phi[i] - edge), direction * x.dphi()[i] * dt,
                             direction * dphi[i] * dt};
        const bool beyond = direction > 0 ? progress.end >= 0 : progress.end > 0;
        double high = 1;
        if (!beyond) {
          if (!(progress.start_slope > 0 && progress.end_slope < 0)) continue;
          high = progress.maximum();
          if (!(progress(high) > 0)) continue;
        }
        const double theta = progress.root(high);
        if (theta * dt < first.dt) first = {i, direction, edge, theta * dt};
      }
    }
    return first;
  }

  // Cubic on [0, 1] by its values and slopes at the ends.
  struct Cubic {
    double start, end, start_slope, end_slope;

    double operator()(double s) const {
      const double rise = end - start;
      return start + s * (start_slope +
                          s * (3 * rise - 2 * start_slope - end_slope + s * (start_slope + end_slope - 2 * rise)));
    }
    double slope(double s) const {
      const double rise = end - start;
      return start_slope +
             s * (2 * (3 * rise - 2 * start_slope - end_slope) + s * 3 * (start_slope + end_slope - 2 * rise));
    }
    // Where the slope falls through zero, if it is positive at 0 and negative at 1.
    double maximum() const {
      double low = 0, high = 1;
      for (int k = 0; k < 40; ++k) {
        const double middle = 0.5 * (low + high);
        (slope(middle) > 0 ? low : high) = middle;
      }
      return 0.5 * (low + high);
    }
    // Where it rises through zero before `high`, at which it is positive.
    double root(double high) const {
      double low = 0;
      for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        ((*this)(middle) < 0 ? low : high) = middle;
      }
      return 0.5 * (low + high);
    }
  };

  // Shortens the step of length dt_1 so that it ends on the edge that is reached first. Returns the length. Newton's
  // method on the step itself, kept in the bracket that is known.
  // What is left at last, `beyond`, need not be another step.
  double locate(const System& system, const State& x, Crossing crossing, double dt_1, double& beyond) {
    double low = 0, high = dt_1;
    double dt = crossing.dt;
    for (int iteration = 0; iteration < 100; ++iteration) {
      if (!(dt > low && dt < high)) dt = 0.5 * (low + high);
      ++statistics_.location_steps;
      ++attempts_;
      if (!stepper_.step(dt)) {
        high = dt;
        continue;
      }
      const Crossing other = first_crossing(system, x, dt);
      if (other.wheel >= 0 && other.wheel != crossing.wheel && is_beyond(other)) {
        crossing = other;
        high = dt;
        dt = crossing.dt;
        continue;
      }
      const int i = crossing.wheel;
      const double past = crossing.direction * (stepper_.end_phi()[i] - crossing.edge);
      const double speed = crossing.direction * stepper_.end_dphi()[i];
      if (std::abs(past) <= resolution(crossing.edge, speed)) return dt;
      (past > 0 ? high : low) = dt;
      if (high - low <= std::numeric_limits<double>::epsilon() * high) return dt;
      beyond = -past / speed;
      if (speed > 0 && may_go_on(system, crossing, dt, beyond)) return dt;
      beyond = 0;
      dt = speed > 0 ? dt - past / speed : low;  // low: bisect
    }
    return dt;
  }

  // Whether a step of length dt that ends `beyond` (s) off the edge may be moved there to first order.
  bool may_go_on(const System& system, const Crossing& crossing, double dt, double beyond) const {
    const int i = crossing.wheel;
    const Wheels dphi = stepper_.end_dphi(), phi = stepper_.end_phi() + beyond * dphi;
    if (!(std::abs(beyond) < kFirstOrder * dt &&
          beyond * beyond * std::abs(stepper_.end_acceleration().dphi[i]) < resolution(crossing.edge, dphi[i]))) {
      return false;
    }
    for (int k = 0; k < kWheels; ++k) {
      if (k != i && !(phi[k] > system.lower_edge()[k] && phi[k] < system.upper_edge()[k])) return false;
    }
    return true;
  }

  bool is_beyond(const Crossing& crossing) const {
    const int i = crossing.wheel;
    return crossing.direction * (stepper_.end_phi()[i] - crossing.edge) >
           resolution(crossing.edge, stepper_.end_dphi()[i]);
  }

  // By how much the shares of wheel i on two rollers are beyond [0, 1], at the end of a step that began at time t.
  double released(const System& system, int i, double t, double dt) const {
    const double alpha = system.alpha(i, stepper_.end_velocities(), t + dt);
    return std::max(alpha - 1, -alpha);
  }

  // Shortens the step of length dt that was computed last, so that the first wheel on two rollers that one of them
  // leaves is just released. Friction is continuous there, so that its time need not be exact.
  double until_released(const System& system, double t, double dt, double& beyond) {
    for (int i = 0; i < kWheels; ++i) {
      if (!system.shared(i) || released(system, i, t, dt) <= 0) continue;
      double low = 0, high = dt;
      for (int halving = 0; halving < kMostHalvings && high - low > kReleaseResolution * high; ++halving) {
        const double middle = 0.5 * (low + high);
        if (!stepper_.step(middle)) break;
        ++statistics_.location_steps;
        (released(system, i, t, middle) > 0 ? high : low) = middle;
      }
      dt = high;
      beyond = 0;
      stepper_.step(dt);
    }
    return dt;
  }

  // Hands over the wheels that stand on an edge and move across it; lets those rest on two rollers that rock between
  // them, and go those that one of the two has left.
  template <class OnSwitch>
  void settle(System& system, State& x, double t, OnSwitch&& on_switch) {
    for (int i = 0; i < kWheels; ++i) {
      if (system.shared(i)) {
        release(system, x, t, i, on_switch);
        continue;
      }
      const double phi = x.phi()[i];
      int direction = 0;
      if (phi >= system.upper_edge()[i] - resolution(phi, x.dphi()[i])) direction = +1;
      if (phi <= system.lower_edge()[i] + resolution(phi, x.dphi()[i])) direction = -1;
      if (direction == 0) continue;
      if (!moves(system, x, t, i, direction)) {
        keep_inside(system, x, i);
      } else if (at_rest_between(system, x, t, i, direction)) {
        ++statistics_.shared_contacts;
        system.share(i, direction > 0 ? system.roller(i) : system.roller(i) - 1, x);
        start_afresh(i);
      } else {
        hand_over(system, x, t, i, direction, on_switch);
      }
    }
  }

  // Whether wheel i, on an edge, turns in `direction`, or is about to.
  static bool moves(const System& system, const State& x, double t, int i, int direction) {
    if (x.dphi()[i] != 0) return direction * x.dphi()[i] > 0;
    State dxdt;
    system(x, dxdt, t);
    return direction * dxdt.dphi()[i] > 0;
  }

  // Whether wheel i has rocked on its edge for so long that it is taken to rest there.
  bool at_rest_between(const System& system, const State& x, double t, int i, int direction) {
    if (direction != -last_direction_[i] || t > last_switch_[i] + kWindow) reversals_[i] = 0;
    if (++reversals_[i] <= kRocks || !system.holds(i, x, t)) return false;
    return reversals_[i] > kMostRocks || stepper_.negligible(system.momentum(i, x));
  }

  template <class OnSwitch>
  void release(System& system, State& x, double t, int i, OnSwitch&& on_switch) {
    const double alpha = system.alpha(i, x.velocities(), t);
    if (alpha >= 0 && alpha <= 1) return;
    const int direction = alpha > 1 ? +1 : -1;
    const std::int64_t lower = system.lower_roller(i), to = direction > 0 ? lower + 1 : lower, from = system.roller(i);
    system.put(i, to);
    keep_inside(system, x, i);
    reversals_[i] = 0;
    if (to != from) announce(t, i, from, to, x, on_switch);
    start_afresh(i);
  }

  void start_afresh(int i) {
    control_.restart();
    stepper_.forget(i);
    dt_ = dt_after_switch_;
    after_switch_ = true;
    begun_ = false;
  }

  template <class OnSwitch>
  void announce(double t, int i, std::int64_t from, std::int64_t to, State& x, OnSwitch&& on_switch) {
    ++statistics_.switches;
    on_switch(RollerSwitch{t, i, wrapped(from, rollers_), wrapped(to, rollers_), x.phi()[i], to > from ? +1 : -1}, x);
  }

  template <class OnSwitch>
  void hand_over(System& system, State& x, double t, int i, int direction, OnSwitch&& on_switch) {
    const double edge = direction > 0 ? system.upper_edge()[i] : system.lower_edge()[i];
    const std::int64_t from = system.roller(i);
    system.put(i, from + direction);
    x.phi()[i] = direction > 0 ? edge : std::nextafter(edge, -std::numeric_limits<double>::infinity());
    last_direction_[i] = direction;
    last_switch_[i] = t;
    announce(t, i, from, from + direction, x, on_switch);
    start_afresh(i);
  }

  static void keep_inside(const System& system, State& x, int i) {
    const double below = std::nextafter(system.upper_edge()[i], -std::numeric_limits<double>::infinity());
    x.phi()[i] = std::min(std::max(x.phi()[i], system.lower_edge()[i]), below);
  }

  int rollers_;
  StepSizeController control_;
  Stepper stepper_;
  bool begun_ = false;
  double dt_ = kFirstStep;
  double dt_after_switch_ = kFirstStep;
  bool after_switch_ = false;
  double dt_after_jump_ = std::numeric_limits<double>::infinity();
  bool after_jump_ = false;
  double window_start_ = std::numeric_limits<double>::infinity();
  int attempts_ = 0;
  std::array<int, kWheels> last_direction_{}, reversals_{};
  std::array<double, kWheels> last_switch_{};
  IntegrationStatistics statistics_;
};

}  // namespace youbot_base_sim
