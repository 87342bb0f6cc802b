#pragma once

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

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

}  // namespace youbot_base_sim
