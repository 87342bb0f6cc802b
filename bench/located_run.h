#pragma once

#include <algorithm>
#include <cmath>

#include "slip_problem.h"

namespace youbot_base_sim {
namespace bench {

/// First edge that a wheel reaches within a step, by the cubic through its phi~ and dphi at both ends.
struct Crossing {
  int wheel = -1;
  int direction = 0;
  double dt = std::numeric_limits<double>::infinity();  ///< after the start of the step, s
};

/// Progress towards an edge over a step, on [0, 1]: zero on the edge, positive beyond.
struct Progress {
  double start, end, start_slope, end_slope;

  double operator()(double s) const {
    const double rise = end - start;
    return start +
           s * (start_slope + s * (3 * rise - 2 * start_slope - end_slope + s * (start_slope + end_slope - 2 * rise)));
  }

  double slope(double s) const {
    const double rise = end - start;
    return start_slope +
           s * (2 * (3 * rise - 2 * start_slope - end_slope) + 3 * s * (start_slope + end_slope - 2 * rise));
  }

  // Where `rises` changes from true to false on [low, high].
  template <class Rises>
  static double bisect(double low, double high, Rises&& rises) {
    for (int k = 0; k < 50; ++k) {
      const double middle = 0.5 * (low + high);
      (rises(middle) ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  // Where the edge is reached; above 1 if it is not. A touch and return within the step counts as reached.
  double reached() const {
    double high = 1;
    if (!(end > 0)) {
      if (!(start_slope > 0 && end_slope < 0)) return 2;
      high = bisect(0, 1, [this](double s) { return slope(s) > 0; });
      if (!((*this)(high) > 0)) return 2;
    }
    return bisect(0, high, [this](double s) { return (*this)(s) < 0; });
  }
};

template <class Vector>
Crossing first_crossing(double half_pitch, const Vector& y_0, const Vector& y_1, double dt) {
  Crossing first;
  for (int i = 0; i < kWheels; ++i) {
    const auto phi = static_cast<std::size_t>(kPhi + i), dphi = static_cast<std::size_t>(kDphi + i);
    for (const int direction : {+1, -1}) {
      const Progress progress{direction * y_0[phi] - half_pitch, direction * y_1[phi] - half_pitch,
                              direction * dt * y_0[dphi], direction * dt * y_1[dphi]};
      const double s = progress.reached();
      if (s <= 1 && s * dt < first.dt) first = {i, direction, s * dt};
    }
  }
  return first;
}

/// Drives one of odeint's steppers, all of which know nothing of events, from switch to switch: a step in which a wheel
/// comes to an edge is repeated, shortened by Newton's method until phi~ is within `location_tolerance` (rad) of it.
/// After a switch, and where the torque jumps, the step size starts from what served after the last one.
///
/// Stepper:  bool attempt(problem, t, y, dt, y_new)  one try; dt becomes the next to try; false: rejected
///           void repeat(problem, t, y, dt, y_new)   a plain step from the same place
///           void restart()                          what follows has nothing to do with the steps so far
///           bool interpolate(t_0, y_0, t_1, y_1, t, y)  dense output of the last step; false: has none
template <class Problem, class Stepper>
class LocatedRun {
 public:
  using Vector = typename Stepper::Vector;

  LocatedRun(Problem& problem, Stepper& stepper, double first_step, double location_tolerance, const Limits& limits)
      : problem_(problem),
        stepper_(stepper),
        location_tolerance_(location_tolerance),
        limits_(limits),
        dt_(first_step),
        after_switch_{first_step},
        after_jump_{first_step} {}

  std::vector<Numbers> operator()(const std::vector<double>& rows) {
    std::copy(problem_.initial().begin(), problem_.initial().end(), y_.begin());
    rows_ = &rows;
    const double end = rows.back();
    write_rows(0);
    while (t_ < end) {
      const double segment_end = std::min(end, problem_.begin_segment(t_));
      if (t_ > 0) {
        stepper_.restart();
        begin(after_jump_);
      }
      while (t_ < segment_end) step(segment_end);
    }
    return std::move(out_);
  }

 private:
  // Step size that served after the last event of a kind.
  struct Start {
    double dt;
  };

  void begin(Start& start) {
    dt_ = start.dt;
    fresh_ = &start;
  }

  void step(double segment_end) {
    limits_.check(problem_.counts, t_);
    double stop = segment_end;
    if (!Stepper::kDense) stop = std::min(stop, (*rows_)[out_.size()]);
    const double remaining = stop - t_, wanted = dt_;
    const double dt = wanted < 0.99 * remaining ? wanted : remaining;
    dt_ = dt;
    if (!stepper_.attempt(problem_, t_, y_, dt_, y_new_)) {
      ++problem_.counts.rejected;
      if (!(t_ + dt_ > t_)) throw RunFailure("step size vanishes at t = " + std::to_string(t_) + " s");
      return;
    }
    ++problem_.counts.steps;
    if (!std::isfinite(y_new_[kVelocity])) throw RunFailure("not finite at t = " + std::to_string(t_) + " s");
    if (dt < wanted) dt_ = std::max(dt_, wanted);  // cut short for the stop, not for its error
    if (fresh_) fresh_->dt = dt;
    fresh_ = nullptr;

    Crossing crossing = first_crossing(problem_.half_pitch(), y_, y_new_, dt);
    const double taken = crossing.wheel < 0 ? dt : locate(crossing, dt);
    const double t_new = crossing.wheel < 0 && dt == remaining ? stop : t_ + taken;
    write_rows(t_new);
    t_ = t_new;
    std::swap(y_, y_new_);
    if (crossing.wheel >= 0) {
      problem_.hand_over(crossing.wheel, crossing.direction, &y_[0]);
      stepper_.restart();
      begin(after_switch_);
    }
  }

  // Shortens the step of length `high` to end on the first edge; returns its length.
  double locate(Crossing& crossing, double high) {
    const double edge = problem_.half_pitch();
    double low = 0, dt = crossing.dt;
    for (int iteration = 0; iteration < 60; ++iteration) {
      if (!(dt > low && dt < high)) dt = 0.5 * (low + high);
      stepper_.repeat(problem_, t_, y_, dt, y_new_);
      ++problem_.counts.location_steps;
      const Crossing other = first_crossing(edge, y_, y_new_, dt);
      if (other.wheel >= 0 && other.wheel != crossing.wheel && other.dt < dt * (1 - 1e-9)) {
        crossing = other;
        high = dt;
        dt = crossing.dt;
        continue;
      }
      const auto phi = static_cast<std::size_t>(kPhi + crossing.wheel);
      const auto dphi = static_cast<std::size_t>(kDphi + crossing.wheel);
      const double past = crossing.direction * y_new_[phi] - edge;
      if (std::abs(past) <= location_tolerance_) return dt;
      (past > 0 ? high : low) = dt;
      if (high - low <= 1e-15 * (1 + t_)) return dt;
      const double speed = crossing.direction * y_new_[dphi];
      dt = speed > 0 ? dt - past / speed : low;
    }
    return dt;
  }

  void write_rows(double t_new) {
    while (out_.size() < rows_->size() && (*rows_)[out_.size()] <= t_new) {
      const double t = (*rows_)[out_.size()];
      const Vector* y = &y_new_;
      if (t == t_) y = &y_;
      if (t > t_ && t < t_new && stepper_.interpolate(t_, y_, t_new, y_new_, t, y_row_)) y = &y_row_;
      out_.push_back(problem_.row(&(*y)[0]));
    }
  }

  Problem& problem_;
  Stepper& stepper_;
  double location_tolerance_;
  Limits limits_;
  double t_ = 0;
  double dt_;
  Start after_switch_, after_jump_;
  Start* fresh_ = nullptr;
  Vector y_ = Stepper::zero(), y_new_ = Stepper::zero(), y_row_ = Stepper::zero();
  const std::vector<double>* rows_ = nullptr;
  std::vector<Numbers> out_;
};

}  // namespace bench
}  // namespace youbot_base_sim
