#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Sets J(row, column), in the order of State::Index, to the derivative of dx/dt by x and dfdt to that by t (s), by
/// central differences of `system.increments()` to either side; 0 for an entry that has no effect.
template <class System, class Matrix>
void difference_jacobian(const System& system, const State& x, double t, Matrix& J, State& dfdt) {
  const auto difference = [&](const State& below, const State& above, double t_below, double t_above, double width) {
    State low, high;
    system(below, low, t_below);
    system(above, high, t_above);
    high.values = (high.values - low.values) / width;
    return high;
  };
  const State increments = system.increments();
  for (int column = 0; column < State::kSize; ++column) {
    State below = x, above = x, slope;
    below.begin()[column] -= increments.begin()[column];
    above.begin()[column] += increments.begin()[column];
    const double width = above.begin()[column] - below.begin()[column];
    if (width > 0) slope = difference(below, above, t, t, width);
    for (int row = 0; row < State::kSize; ++row) J(row, column) = slope.begin()[row];
  }
  // The torque is one smooth function of time beyond the ends of its segment too.
  constexpr double kTime = 1e-6;  // s
  dfdt = difference(x, x, t - kTime, t + kTime, 2 * kTime);
}

}  // namespace youbot_base_sim
