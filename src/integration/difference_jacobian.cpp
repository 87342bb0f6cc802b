#include "youbot_base_sim/integration/difference_jacobian.h"

namespace youbot_base_sim {

DifferenceJacobian difference_jacobian(const SmoothSystem& system, const State& x, double t) {
  const auto difference = [&](const State& below, const State& above, double t_below, double t_above, double width) {
    State low, high;
    system(below, low, t_below);
    system(above, high, t_above);
    high.values = (high.values - low.values) / width;
    return high;
  };
  DifferenceJacobian J;
  const State increments = system.increments();
  for (int column = 0; column < State::kSize; ++column) {
    State below = x, above = x, slope;
    below.begin()[column] -= increments.begin()[column];
    above.begin()[column] += increments.begin()[column];
    const double width = above.begin()[column] - below.begin()[column];
    if (width > 0) slope = difference(below, above, t, t, width);
    for (int row = 0; row < State::kSize; ++row) J.by_state(row, column) = slope.begin()[row];
  }
  // The torque is one smooth function of time beyond the ends of its segment too.
  constexpr double kTime = 1e-6;  // s
  J.by_time = difference(x, x, t - kTime, t + kTime, 2 * kTime);
  return J;
}

}  // namespace youbot_base_sim
