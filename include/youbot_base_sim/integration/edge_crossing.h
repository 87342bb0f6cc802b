#pragma once

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The cubic on [0, 1] with given values and slopes at both ends (Hermite's).
struct HermiteCubic {
  double start, end, start_slope, end_slope;

  double operator()(double s) const {
    const double rise = end - start;
    return start +
           s * (start_slope + s * (3 * rise - 2 * start_slope - end_slope + s * (start_slope + end_slope - 2 * rise)));
  }

  double slope(double s) const {
    const double rise = end - start;
    return start_slope +
           s * (2 * (3 * rise - 2 * start_slope - end_slope) + s * 3 * (start_slope + end_slope - 2 * rise));
  }

  /// Where it rises through zero, in [0, high]; it must be positive at `high`.
  double root(double high) const {
    return where([this](double s) { return (*this)(s); }, high);
  }

  /// Where it is largest, if its slope is positive at 0 and negative at 1.
  double maximum() const {
    return where([this](double s) { return -slope(s); }, 1);
  }

 private:
  // The point in [0, high] where f becomes positive. Rounding may leave f(high) slightly negative; f(0) counts as
  // negative, because a wheel that starts on an edge may leave it and come back.
  template <class Function>
  static double where(const Function& f, double high) {
    constexpr double kTiny = std::numeric_limits<double>::min();
    std::uintmax_t iterations = 40;
    const auto [low, up] =
        boost::math::tools::toms748_solve(f, 0.0, high, std::min(f(0), -kTiny), std::max(f(high), kTiny),
                                          boost::math::tools::eps_tolerance<double>(50), iterations);
    return 0.5 * (low + up);
  }
};

/// A wheel reaches an edge of the roller on which it stands.
struct EdgeCrossing {
  int wheel = -1;                                       ///< none: -1
  int direction = 0;                                    ///< +1: the upper edge, -1: the lower one
  double edge = 0;                                      ///< rad
  double dt = std::numeric_limits<double>::infinity();  ///< after the start of the step, s

  explicit operator bool() const { return wheel >= 0; }

  /// How far `phi` is past the edge, rad.
  double past(const State& x) const { return direction * (x.phi()[wheel] - edge); }
  /// At what rate the wheel moves across it, rad/s.
  double speed(const State& x) const { return direction * x.dphi()[wheel]; }
};

/// Whether all wheels are further than `margin` (rad) from the edges of their contacts.
inline bool inside_edges(const ContactModes& modes, const State& x, double margin) {
  const Wheels phi = x.phi();
  return (phi - modes.lower_edge()).min(modes.upper_edge() - phi).minCoeff() > margin;
}

/// Whether no wheel turns back between two states.
inline bool keep_direction(const State& start, const State& end) { return (start.dphi() * end.dphi()).minCoeff() >= 0; }

/// The first crossing in a step of length dt (s) from `start` to `end`, by the cubics through phi and dphi at both
/// ends. A roller's range contains its lower edge, not its upper one.
inline EdgeCrossing first_crossing(const ContactModes& modes, const State& start, const State& end, double dt) {
  EdgeCrossing first;
  if (inside_edges(modes, end, 0) && keep_direction(start, end)) return first;
  const Wheels phi = end.phi();
  for (int i = 0; i < kWheels; ++i) {
    for (const int direction : {+1, -1}) {
      const double edge = direction > 0 ? modes.upper_edge()[i] : modes.lower_edge()[i];
      if (!std::isfinite(edge)) continue;
      const HermiteCubic progress{direction * (start.phi()[i] - edge), direction * (phi[i] - edge),
                                  direction * start.dphi()[i] * dt, direction * end.dphi()[i] * dt};
      const bool beyond = direction > 0 ? progress.end >= 0 : progress.end > 0;
      double high = 1;
      if (!beyond) {  // it may have been there and back
        if (!(progress.start_slope > 0 && progress.end_slope < 0)) continue;
        high = progress.maximum();
        if (!(progress(high) > 0)) continue;
      }
      const double at = dt * progress.root(high);
      if (at < first.dt) first = {i, direction, edge, at};
    }
  }
  return first;
}

}  // namespace youbot_base_sim
