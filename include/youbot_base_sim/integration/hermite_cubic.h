#pragma once

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
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

}  // namespace youbot_base_sim
