#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <utility>

#include "youbot_base_sim/integration/edge_crossing.h"
#include "youbot_base_sim/integration/sliding_mode.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/integration/switch_log.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Steps that end where a wheel reaches the edge of its roller: a Controlled Stepper of odeint around a SmoothStepper.
///
/// A switch is located to 1e-12 s, or to the resolution of phi for a wheel that hardly turns, by Newton's method on the
/// length of the step: each try is a whole step of the inner stepper from the same start. The wheel then stands on the
/// far side of the edge, and the step after it starts afresh. A wheel exactly on an edge stands on the roller that
/// (2.1) names, unless its motion leaves that roller at once; a wheel that touches the edge and turns back does not
/// switch.
///
/// `dt` of try_step is an upper bound: how long a step is worth trying is remembered here, so that odeint may clip the
/// bound at the end of a control period without any loss. After success dt is infinite, and odeint clips it again.
template <class System>
class LocatedStepper : public ControlledStepperTypes {
 public:
  /// Records in `switches` and counts in `statistics`, which must outlive it.
  LocatedStepper(std::unique_ptr<SmoothStepper<System>> stepper, const Tolerance& tolerance, SwitchLog& switches,
                 IntegrationStatistics& statistics)
      : stepper_(std::move(stepper)), tolerance_(tolerance), switches_(&switches), statistics_(&statistics) {}

  /// Tries a step of at most dt (s) from x at time t, to the first edge that is reached. `system` is a SlipSystem or
  /// another one with edges, by std::ref; its contacts change with the state.
  Result try_step(System& system, State& x, double& t, double& dt) {
    if (!settled_) settle(system, x, t);
    const double bound = std::min(dt, system.max_step(x));
    // A step that would leave a sliver goes to the end.
    double length = dt_ < kSliver * bound ? dt_ : bound;
    if (!try_length(system, x, t, length)) {
      ++statistics_->rejected_steps;
      dt_ = next_dt_;
      return boost::numeric::odeint::fail;
    }
    remember(length);
    length_ = length;
    beyond_ = 0;
    if (EdgeCrossing crossing = first_crossing(system, x, end_, length)) locate(system, x, t, crossing);
    if (system.shares() || system.averages()) end_where_contact_ends(system, x, t);
    if (system.ends_tipping()) end_where_base_tips(system, x, t);
    const double start = t;
    t = length_ == bound ? t + bound : t + length_ + beyond_;
    x = end_;
    if (beyond_ != 0) x.values += beyond_ * secant();
    ++statistics_->steps;
    if (afresh_) dt_after_switch_ = std::max(kFirstStep, 0.5 * dt_);
    afresh_ = false;
    settle(system, x, t);
    if (system.watches()) system.watch(x, t, t - start);
    dt = std::numeric_limits<double>::infinity();
    return boost::numeric::odeint::success;
  }

  /// The torque jumps here: the next step is as long as was good after the last jump.
  void torque_jumped() {
    stepper_->reset();
    dt_ = std::min(dt_, dt_after_jump_);
    after_jump_ = true;
    settled_ = false;
  }

  /// Forgets all steps so far.
  void restart() {
    stepper_->restart();
    *this = LocatedStepper(std::move(stepper_), tolerance_, *switches_, *statistics_);
  }

  /// Announces the rollers that wheel i, whose contact is averaged, has passed since it was last asked, in one record.
  void record_passed_rollers(System& system, const State& x, double t, int i) {
    const std::int64_t from = system.roller(i);
    system.follow(i, x);
    announce(system, t, i, from, x);
  }

  /// Which wheels chatter.
  SlidingMode& sliding_mode() { return sliding_mode_; }

  /// Length of the step that is tried next, s.
  double dt() const { return dt_; }

 private:
  static constexpr double kFirstStep = 1e-6;  // s
  static constexpr double kSliver = 0.99;
  // A rejected step after a jump now and then costs less than short ones after all jumps.
  static constexpr double kDaring = 1.6;
  static constexpr double kShrinkage = 0.2;            // of a step whose end is not finite
  static constexpr double kReleaseResolution = 1e-6;   // of the step
  static constexpr double kTippingResolution = 1e-10;  // s
  static constexpr double kFirstOrder = 1e-6;          // of a step: what has a negligible square
  static constexpr double kTimeResolution = 1e-13;     // s; the promised 1e-12 with room for what sums
  // Further from an edge than any resolution, rad: a quick look suffices.
  static constexpr double kNear = 1e-6;
  static constexpr int kMaxTries = 100, kMaxHalvings = 40;

  // Distance from an edge (rad) below which a wheel stands on it.
  static double resolution(double edge, double dphi) {
    return std::max(kTimeResolution * std::abs(dphi),
                    4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(edge)));
  }

  // Tries a step of this length; its end is in end_, the length to try next in next_dt_.
  bool try_length(System& system, const State& x, double t, double length) {
    next_dt_ = length;
    const Result result = stepper_->try_step(system, x, t, end_, next_dt_);
    if (result == boost::numeric::odeint::fail) return false;
    // odeint's step size control accepts a step whose error is NaN.
    if ((0 * end_.values).sum() == 0) return true;  // all of it is finite
    next_dt_ = kShrinkage * length;
    return false;
  }

  void remember(double length) {
    const double wanted = dt_;
    dt_ = next_dt_;
    if (after_jump_) dt_after_jump_ = kDaring * dt_;
    after_jump_ = false;
    if (length < wanted) dt_ = std::max(dt_, wanted);  // the bound cut it short, not its error
  }

  // Shortens the step so that it ends on the edge that is reached first: Newton's method on its length, kept in the
  // bracket that is known. A remainder, beyond_, whose square is negligible is covered by extrapolation instead of
  // another try.
  void locate(System& system, const State& x, double t, EdgeCrossing crossing) {
    double low = 0, high = length_, length = crossing.dt;
    for (int tries = 0; tries < kMaxTries; ++tries) {
      if (!(length > low && length < high)) length = 0.5 * (low + high);
      other_end_ = end_;
      other_length_ = length_;
      ++statistics_->location_steps;
      if (!try_length(system, x, t, length)) {
        end_ = other_end_;
        high = length;
        continue;
      }
      length_ = length;
      const EdgeCrossing other = first_crossing(system, x, end_, length);
      if (other && other.wheel != crossing.wheel && other.past(end_) > resolution(other)) {
        crossing = other;
        high = length;
        length = crossing.dt;
        continue;
      }
      const double past = crossing.past(end_), speed = crossing.speed(end_);
      if (std::abs(past) <= resolution(crossing)) return;
      (past > 0 ? high : low) = length;
      if (high - low <= std::numeric_limits<double>::epsilon() * high) return;
      beyond_ = -past / speed;
      if (speed > 0 && may_go_on(system, crossing)) return;
      beyond_ = 0;
      length = speed > 0 ? length - past / speed : low;  // low: bisect
    }
  }

  double resolution(const EdgeCrossing& crossing) const { return resolution(crossing.edge, crossing.speed(end_)); }

  // Slope of the state at the end of the step, by the last two tries.
  State::Values secant() const { return (end_.values - other_end_.values) / (length_ - other_length_); }

  // Whether the end of the step, which is `beyond_` (s) off the edge, may be moved there to first order: the secant's
  // slope is that of the middle between the two tries.
  bool may_go_on(const System& system, const EdgeCrossing& crossing) const {
    const Wheels phi = end_.phi() + beyond_ * end_.dphi();
    const double off = std::abs(beyond_) + std::abs(length_ - other_length_);
    const double acceleration = secant().col(3).abs().maxCoeff();
    if (!(std::abs(beyond_) < kFirstOrder * length_ && std::abs(beyond_) * off * acceleration < resolution(crossing))) {
      return false;
    }
    for (int k = 0; k < kWheels; ++k) {
      if (k != crossing.wheel && !(phi[k] > system.lower_edge()[k] && phi[k] < system.upper_edge()[k])) return false;
    }
    return true;
  }

  // Shortens the step so that a wheel is just released from sliding mode, or just slow enough for its switches to be
  // located again. Forces are continuous there, or nearly so: the time need not be exact.
  void end_where_contact_ends(System& system, const State& x, double t) {
    for (int i = 0; i < kWheels; ++i) {
      if (!contact_ends(system, i, end_, t + length_)) continue;
      double low = 0, high = length_;
      State ended = end_;
      for (int halving = 0; halving < kMaxHalvings && high - low > kReleaseResolution * high; ++halving) {
        const double middle = 0.5 * (low + high);
        if (!try_length(system, x, t, middle)) break;
        ++statistics_->location_steps;
        const bool ends = contact_ends(system, i, end_, t + middle);
        (ends ? high : low) = middle;
        if (ends) ended = end_;
      }
      length_ = high;
      beyond_ = 0;
      if (!try_length(system, x, t, high)) end_ = ended;
    }
  }

  // Shortens the step so that the base has just reached its tipping limit.
  void end_where_base_tips(System& system, const State& x, double t) {
    if (!system.tips(end_, t + length_) || system.tips(x, t)) return;
    double low = 0, high = length_;
    State tipped = end_;
    for (int halving = 0; halving < kMaxHalvings && high - low > kTippingResolution; ++halving) {
      const double middle = 0.5 * (low + high);
      ++statistics_->location_steps;
      if (!try_length(system, x, t, middle)) break;
      const bool tips = system.tips(end_, t + middle);
      (tips ? high : low) = middle;
      if (tips) tipped = end_;
    }
    length_ = high;
    beyond_ = 0;
    if (!try_length(system, x, t, high)) end_ = tipped;
  }

  static bool contact_ends(const System& system, int i, const State& x, double t) {
    if (system.averaged(i)) return system.slow_again(i, x);
    return system.shared(i) && SlidingMode::excess(system, i, x, t) > 0;
  }

  // The effects of where the wheels now are: hands over those that stand on an edge and move across it, or puts them in
  // sliding mode, or averages their contacts; releases from sliding mode those that one roller carries alone.
  void settle(System& system, State& x, double t) {
    settled_ = true;
    if (inside_edges(system, x, kNear) && !system.shares() && !system.averages()) return;
    for (int i = 0; i < kWheels; ++i) {
      if (system.averaged(i)) {
        if (system.slow_again(i, x)) resolve(system, x, t, i);
      } else if (system.shared(i)) {
        release(system, x, t, i);
      } else {
        cross(system, x, t, i);
      }
    }
  }

  void cross(System& system, State& x, double t, int i) {
    const double phi = x.phi()[i];
    int direction = 0;
    if (phi >= system.upper_edge()[i] - resolution(phi, x.dphi()[i])) direction = +1;
    if (phi <= system.lower_edge()[i] + resolution(phi, x.dphi()[i])) direction = -1;
    if (direction == 0) return;
    const std::int64_t from = system.roller(i);
    if (!moves(system, x, t, i, direction)) {
      keep_inside(system, x, i);
    } else if (sliding_mode_.enters(system, x, t, i, direction, error_scale(tolerance_, x.velocities()).v[0])) {
      ++statistics_->shared_contacts;
      system.enter_sliding(i, direction > 0 ? from : from - 1, x);
      start_afresh();
    } else {
      const double edge = direction > 0 ? system.upper_edge()[i] : system.lower_edge()[i];
      system.hand_over(i, from + direction, x);
      x.phi()[i] = direction > 0 ? edge : std::nextafter(edge, -std::numeric_limits<double>::infinity());
      announce(system, t, i, from, x);
      if (system.too_fast(i, x)) {
        system.average(i);
        ++statistics_->averaged_contacts;
      }
      start_afresh();
    }
  }

  // Whether wheel i, on an edge, turns in `direction`, or is about to.
  static bool moves(const System& system, const State& x, double t, int i, int direction) {
    if (x.dphi()[i] != 0) return direction * x.dphi()[i] > 0;
    State dxdt;
    system(x, dxdt, t);
    return direction * dxdt.dphi()[i] > 0;
  }

  void release(System& system, State& x, double t, int i) {
    const double alpha = system.alpha(i, x, t);
    if (alpha >= 0 && alpha <= 1) return;
    const std::int64_t from = system.roller(i), to = system.lower_roller(i) + (alpha > 1 ? 1 : 0);
    if (to != from) {
      system.hand_over(i, to, x);
    } else {
      system.put(i, to);
    }
    keep_inside(system, x, i);
    announce(system, t, i, from, x);  // nothing, if it stays on the roller that it reached last
    sliding_mode_.left(i);
    start_afresh();
  }

  void resolve(System& system, State& x, double t, int i) {
    record_passed_rollers(system, x, t, i);
    system.put(i, system.roller(i));
    start_afresh();
  }

  void start_afresh() {
    stepper_->reset();
    dt_ = dt_after_switch_;
    afresh_ = true;
  }

  void announce(const System& system, double t, int i, std::int64_t from, const State& x) {
    switches_->record(t, i, from, system.roller(i), system.rollers(), x.phi()[i]);
  }

  static void keep_inside(const System& system, State& x, int i) {
    const double below = std::nextafter(system.upper_edge()[i], -std::numeric_limits<double>::infinity());
    x.phi()[i] = std::min(std::max(x.phi()[i], system.lower_edge()[i]), below);
  }

  std::unique_ptr<SmoothStepper<System>> stepper_;
  Tolerance tolerance_;
  SwitchLog* switches_;
  IntegrationStatistics* statistics_;
  SlidingMode sliding_mode_;

  // The step under way: its end and length; those of the try before; what is left to the edge, s.
  State end_, other_end_;
  double length_ = 0, other_length_ = 0, beyond_ = 0;
  double next_dt_ = 0;

  // Lengths that are worth trying: now, after a switch, after a jump of the torque, s.
  double dt_ = kFirstStep, dt_after_switch_ = kFirstStep;
  double dt_after_jump_ = std::numeric_limits<double>::infinity();
  bool afresh_ = false, after_jump_ = false;
  bool settled_ = false;
};

}  // namespace youbot_base_sim
