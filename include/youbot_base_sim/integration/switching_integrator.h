#pragma once

#include <cstdint>

#include "youbot_base_sim/integration/rosenbrock.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// One roller taking over from another.
struct RollerSwitch {
  double t;         ///< s
  int wheel;        ///< 0..3: fl, fr, bl, br
  int roller_from;  ///< 0..n-1
  int roller_to;    ///< 0..n-1
  double phi;       ///< wheel angle, on the far side of the edge, rad
  int direction;    ///< +1 or -1: sign of the wheel's rotation
};

/// What an integration did so far.
struct IntegrationStatistics {
  std::uint64_t steps = 0;              ///< accepted
  std::uint64_t rejected_steps = 0;     ///< for their error
  std::uint64_t location_steps = 0;     ///< to find where in a step an edge is reached
  std::uint64_t switches = 0;           ///< located
  std::uint64_t safe_steps = 0;         ///< of the safe stepper, where the accurate one gave up
  std::uint64_t endless_switching = 0;  ///< times that it gave up because a wheel rocked over an edge without end
  std::uint64_t exhausted = 0;          ///< times that it gave up because its bound of work was spent
};

/// Integrates a SlipSystem from switch to switch: a step ends where a wheel reaches the edge of its roller, located to
/// 1e-12 s (or to the resolution of phi, for a wheel that hardly turns), with phi on the far side, and the next one
/// starts afresh.
///
/// A wheel exactly on an edge stands on the roller that (2.1) names, unless its motion leaves that roller at once; a
/// wheel that touches the edge and turns back does not switch.
template <class Tableau, class System>
class SwitchingIntegrator {
 public:
  using State = typename System::State;

  /// `rollers` is their number on a wheel.
  SwitchingIntegrator(const Tolerance& tolerance, int rollers)
      : tolerance_(tolerance), rollers_(rollers), control_(Tableau::error_order) {}

  enum class Outcome {
    kReached,           ///< t is t_end
    kEndlessSwitching,  ///< a wheel rocks over an edge, with ever more switches in ever less time
    kExhausted          ///< more steps than kMostAttempts within kWindow, or step sizes that vanish
  };

  /// Advances (x, t) to t_end (s), within which the torque must be smooth. `on_switch(RollerSwitch, State&)` is called
  /// at each switch and may change velocities and gamma. Where it gives up, (x, t) is where it has come to.
  template <class OnSwitch>
  Outcome advance(System& system, State& x, double& t, double t_end, OnSwitch&& on_switch) {
    linearized_ = false;
    settle(system, x, t, on_switch);
    while (t < t_end) {
      if (t > window_start_ + kWindow || t < window_start_) open_window(t);
      if (++attempts_ > kMostAttempts) return give_up(t, statistics_.exhausted, Outcome::kExhausted);
      if (rocking_ > kMostReversals) return give_up(t, statistics_.endless_switching, Outcome::kEndlessSwitching);
      if (!attempt(system, x, t, t_end)) {
        if (t + dt_ <= t) return give_up(t, statistics_.exhausted, Outcome::kExhausted);
        continue;
      }
      ++statistics_.steps;
      settle(system, x, t, on_switch);
    }
    return Outcome::kReached;
  }

  /// Forgets the step sizes of the past, as for a new initial state.
  void restart() {
    control_.restart();
    dt_ = dt_after_switch_ = kFirstStep;
    window_start_ = std::numeric_limits<double>::infinity();
    last_direction_.fill(0);
  }

  const IntegrationStatistics& statistics() const { return statistics_; }
  IntegrationStatistics& statistics() { return statistics_; }

 private:
  static constexpr double kFirstStep = 1e-6;        // s
  static constexpr double kTimeResolution = 1e-13;  // s; the promised 1e-12 with room for what sums
  // Work is bounded per window of simulated time, so that no control period can take for ever.
  static constexpr double kWindow = 1e-3;  // s
  static constexpr int kMostAttempts = 20000;
  static constexpr int kMostReversals = 8;

  struct Crossing {
    int wheel = -1;
    int direction = 0;
    double edge = 0;
    double dt = std::numeric_limits<double>::infinity();  // after the start of the step
  };

  void open_window(double t) {
    window_start_ = t;
    attempts_ = 0;
    rocking_ = 0;
  }

  Outcome give_up(double t, std::uint64_t& counter, Outcome outcome) {
    ++counter;
    open_window(t);
    restart();
    return outcome;
  }

  static double resolution(const State& x, int i) {
    return std::max(kTimeResolution * std::abs(x.dphi()[i]),
                    4 * std::numeric_limits<double>::epsilon() * std::max(1.0, std::abs(x.phi()[i])));
  }

  // One try at a step towards t_end, cut short at the first edge that is reached. True if (x, t) moved on.
  bool attempt(const System& system, State& x, double& t, double t_end) {
    if (!linearized_) {
      stepper_.linearize(system, x, t);
      linearized_ = true;
    }
    const double remaining = t_end - t;
    const double wanted = dt_;
    // A step that would leave a sliver goes to the end.
    const double dt = wanted < 0.99 * remaining ? wanted : remaining;
    State x_new, error;
    stepper_.step(system, dt, x_new, error);
    const double norm = system.error_norm(x, x_new, error, tolerance_.relative, tolerance_.absolute);
    dt_ = control_.next(dt, norm);
    if (!(norm <= 1)) {
      ++statistics_.rejected_steps;
      return false;
    }
    if (dt < wanted) dt_ = std::max(dt_, wanted);  // cut short by t_end, not for its error

    const Crossing crossing = first_crossing(system, x, x_new, dt);
    double taken = dt;
    if (crossing.wheel >= 0) taken = locate(system, x, crossing, dt, x_new);
    t = taken == remaining ? t_end : t + taken;
    x = x_new;
    linearized_ = false;
    if (after_switch_) {
      dt_after_switch_ = dt;
      after_switch_ = false;
    }
    return true;
  }

  // First edge that a wheel reaches between x_0 and x_1, dt later, by the cubic through phi and dphi at both.
  static Crossing first_crossing(const System& system, const State& x_0, const State& x_1, double dt) {
    Crossing first;
    for (int i = 0; i < kWheels; ++i) {
      for (const int direction : {+1, -1}) {
        const double edge = direction > 0 ? system.upper_edge(i) : system.lower_edge(i);
        // Progress towards the edge, beyond it at >= 0 (a roller's range holds its lower edge, not its upper one).
        const Cubic progress{direction * (x_0.phi()[i] - edge), direction * (x_1.phi()[i] - edge),
                             direction * x_0.dphi()[i] * dt, direction * x_1.dphi()[i] * dt};
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

  // Shortens a step of length dt_1, that ends in x_1, so that it ends on the edge that is reached first. Returns the
  // length and sets x_1. Newton's method on the step itself, kept in the bracket that is known.
  double locate(const System& system, const State& x_0, Crossing crossing, double dt_1, State& x_1) {
    double low = 0, high = dt_1;
    double dt = crossing.dt;
    State error;
    for (int iteration = 0; iteration < 100; ++iteration) {
      if (!(dt > low && dt < high)) dt = 0.5 * (low + high);
      stepper_.step(system, dt, x_1, error);
      ++statistics_.location_steps;
      ++attempts_;
      const Crossing other = first_crossing(system, x_0, x_1, dt);
      if (other.wheel >= 0 && other.wheel != crossing.wheel && beyond(x_1, other)) {
        crossing = other;
        high = dt;
        dt = crossing.dt;
        continue;
      }
      const int i = crossing.wheel;
      const double past = crossing.direction * (x_1.phi()[i] - crossing.edge);
      if (std::abs(past) <= resolution(x_1, i)) return dt;
      (past > 0 ? high : low) = dt;
      if (high - low <= std::numeric_limits<double>::epsilon() * high) return dt;
      const double speed = crossing.direction * x_1.dphi()[i];
      dt = speed > 0 ? dt - past / speed : low;  // low: bisect
    }
    return dt;
  }

  static bool beyond(const State& x, const Crossing& crossing) {
    const int i = crossing.wheel;
    return crossing.direction * (x.phi()[i] - crossing.edge) > resolution(x, i);
  }

  // Hands over the wheels that stand on an edge and move across it.
  template <class OnSwitch>
  void settle(System& system, State& x, double t, OnSwitch&& on_switch) {
    for (int i = 0; i < kWheels; ++i) {
      const double phi = x.phi()[i];
      int direction = 0;
      if (phi >= system.upper_edge(i) - resolution(x, i)) direction = +1;
      if (phi <= system.lower_edge(i) + resolution(x, i)) direction = -1;
      if (direction == 0) continue;
      if (moves(system, x, t, i, direction)) {
        hand_over(system, x, t, i, direction, on_switch);
      } else {
        keep_inside(system, x, i);
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

  template <class OnSwitch>
  void hand_over(System& system, State& x, double t, int i, int direction, OnSwitch&& on_switch) {
    const double edge = direction > 0 ? system.upper_edge(i) : system.lower_edge(i);
    const int from = system.roller(i);
    system.put(i, from + direction);
    x.phi()[i] = direction > 0 ? edge : std::nextafter(edge, -std::numeric_limits<double>::infinity());
    if (direction == -last_direction_[i]) ++rocking_;
    last_direction_[i] = direction;
    ++statistics_.switches;
    on_switch(RollerSwitch{t, i, wrapped(from), wrapped(from + direction), x.phi()[i], direction}, x);
    control_.restart();
    dt_ = dt_after_switch_;
    after_switch_ = true;
    linearized_ = false;
  }

  static void keep_inside(const System& system, State& x, int i) {
    const double below = std::nextafter(system.upper_edge(i), -std::numeric_limits<double>::infinity());
    x.phi()[i] = std::min(std::max(x.phi()[i], system.lower_edge(i)), below);
  }

  int wrapped(int roller) const { return ((roller % rollers_) + rollers_) % rollers_; }

  Tolerance tolerance_;
  int rollers_;
  StepSizeController control_;
  Rosenbrock<Tableau, System> stepper_;
  bool linearized_ = false;
  double dt_ = kFirstStep;
  double dt_after_switch_ = kFirstStep;
  bool after_switch_ = false;
  double window_start_ = std::numeric_limits<double>::infinity();
  int attempts_ = 0;
  int rocking_ = 0;
  std::array<int, kWheels> last_direction_{};
  IntegrationStatistics statistics_;
};

}  // namespace youbot_base_sim
