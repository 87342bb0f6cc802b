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

  /// Where it rises through zero, in [0, high]; it must be positive at `high`.
  double root(double high) const {
    return where([this](double s) { return (*this)(s); }, high);
  }

  /// Where it has its local maximum; not a number if it has none.
  double maximum() const {
    const double rise = end - start, a = 3 * (start_slope + end_slope - 2 * rise);
    const double half_b = 3 * rise - 2 * start_slope - end_slope;  // the slope is a s^2 + 2 half_b s + start_slope
    const double root = std::sqrt(half_b * half_b - a * start_slope);
    return half_b < 0 ? start_slope / (root - half_b) : -(half_b + root) / a;
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

}  // namespace youbot_base_sim
