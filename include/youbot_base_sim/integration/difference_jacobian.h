#pragma once

#include <Eigen/Core>

#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Derivatives of dx/dt, in the order of State::Index.
struct DifferenceJacobian {
  Eigen::Matrix<double, State::kSize, State::kSize, Eigen::DontAlign> by_state;  ///< by x; 0 without effect
  State by_time;                                                                 ///< by t, s
};

/// They are by central differences of `system.increments()` to either side.
DifferenceJacobian difference_jacobian(const SmoothSystem& system, const State& x, double t);

}  // namespace youbot_base_sim
