#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// A matrix of derivatives by the 24 numbers of a State, row by row in the order of State::Index, wherever it is
/// stored.
using StateJacobian = Eigen::Map<Eigen::Matrix<double, State::kSize, State::kSize, Eigen::RowMajor>>;

}  // namespace youbot_base_sim
