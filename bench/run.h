#pragma once

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {
namespace bench {

/// A row of a run:
///
///   0..2    x, y (m), psi (rad)
///   3..5    V_X, V_Y (m/s), Omega (rad/s)
///   6..9    phi (rad)
///   10..13  dphi (rad/s)
///   14..17  dgamma (rad/s)
constexpr int kSize = 18;
enum Index { kPose = 0, kVelocity = 3, kPhi = 6, kDphi = 10, kDgamma = 14 };
using Numbers = std::array<double, kSize>;

/// Numbers that a State holds, in the order above.
inline Numbers numbers_of(const State& x) {
  Numbers y;
  for (int column = 0; column < 2; ++column) {
    for (int k = 0; k < 3; ++k) y[static_cast<std::size_t>(3 * column + k)] = x.values(k, column);
  }
  for (int column = 2; column < 5; ++column) {
    for (int i = 0; i < kWheels; ++i) y[static_cast<std::size_t>(kPhi + 4 * (column - 2) + i)] = x.values(i, column);
  }
  return y;
}

/// What a run cost, as far as the solver tells. Negative: it does not.
struct Counts {
  std::int64_t steps = 0;           ///< accepted
  std::int64_t rejected = 0;        ///< for their error, or for want of convergence
  std::int64_t location_steps = 0;  ///< steps repeated to end on an edge
  std::int64_t evaluations = 0;     ///< of the right-hand side
  std::int64_t jacobians = 0;
  std::int64_t factorizations = 0;
  std::int64_t switches = 0;
};

struct Run {
  std::vector<Numbers> rows;  ///< at the times asked for
  Counts counts;
};

/// Thrown out of a run that cannot go on; says why.
class RunFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// When to give a solver up.
struct Limits {
  double max_evaluations = 5e6;  ///< of the right-hand side
  std::int64_t max_switches = 50000;

  bool spent(const Counts& counts) const { return static_cast<double>(counts.evaluations) > max_evaluations; }

  void check(const Counts& counts, double t) const {
    const auto give_up = [t](double limit, const char* what) {
      throw RunFailure("more than " + std::to_string(std::int64_t(limit)) + " " + what +
                       " by t = " + std::to_string(t) + " s");
    };
    if (spent(counts)) give_up(max_evaluations, "evaluations");
    if (counts.switches > max_switches) give_up(static_cast<double>(max_switches), "switches");
  }
};

/// What a solver is asked for.
struct Task {
  Scene scene;
  double setting;             ///< relative tolerance, or the step of a method with fixed steps, s
  std::vector<double> times;  ///< of the rows, s, increasing from 0
  Limits limits;
};

}  // namespace bench
}  // namespace youbot_base_sim
