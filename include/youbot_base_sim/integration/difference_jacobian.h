#pragma once

#include <Eigen/Core>

#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Derivatives of dx/dt by the state and by time, in the order of State::Index, SI units.
struct DifferenceJacobian {
  Eigen::Matrix<double, State::kSize, State::kSize, Eigen::DontAlign> by_state;  ///< column: entry of x
  State by_time;
};

/// Differentiates at state x and time t, s, by central differences of `system.increments()` to either side. The column
/// of an entry without an increment is 0.
DifferenceJacobian difference_jacobian(const SmoothSystem& system, const State& x, double t);

}  // namespace youbot_base_sim
