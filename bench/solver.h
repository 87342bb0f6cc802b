#pragma once

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {
namespace bench {

/// What a solver is asked for: method, tolerance and step are the scene's.
struct Task {
  Scene scene;
  std::vector<double> times;     ///< of the rows, s, increasing from 0
  double max_evaluations = 5e6;  ///< of the right-hand side, after which to give up
  std::uint64_t max_switches = 50000;

  bool is_spent(const IntegrationStatistics& statistics) const {
    return static_cast<double>(statistics.evaluations) > max_evaluations || statistics.switches > max_switches;
  }
};

struct Run {
  std::vector<State> rows;  ///< at the times asked for
  IntegrationStatistics statistics;
  std::uint64_t jacobians = 0;  ///< evaluated; 0: not counted
};

/// Thrown out of a run that cannot go on; says why.
class RunFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Solver = Run (*)(const Task& task);

// CVODE and ARKODE of SUNDIALS 6, each with the analytic Jacobian, its dense linear solver and its own root finding.

/// By their names: cvode, backward differentiation formulas of orders 1 to 5; arkode_4 and arkode_5, diagonally
/// implicit Runge-Kutta methods, of order 4 the best of those it has, of order 5 its default.
std::map<std::string, Solver> sundials_solvers();

}  // namespace bench
}  // namespace youbot_base_sim
