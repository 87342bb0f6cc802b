#pragma once

#include "run.h"

// CVODE and ARKODE of SUNDIALS 6, each with the analytic Jacobian, its dense linear solver and its own root finding.
// What they leave to the user was chosen by trial, for most accuracy in the time.

namespace youbot_base_sim {
namespace bench {

/// CVODE: backward differentiation formulas of orders 1 to 5.
Run run_cvode(const Task& task);

/// ARKODE's diagonally implicit Runge-Kutta methods: of order 4 the best of those it has, of order 5 its default.
Run run_arkode_4(const Task& task);
Run run_arkode_5(const Task& task);

std::string sundials_version();

}  // namespace bench
}  // namespace youbot_base_sim
