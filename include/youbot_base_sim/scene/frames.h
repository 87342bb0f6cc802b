#pragma once

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Height of the wheels' axles in base_link and base_footprint, m, as in the youBot's official description. In these
/// frames the floor is at z = kAxleHeight - R.
constexpr double kAxleHeight = -0.034;
inline double floor_height(const RobotParameters& robot) { return kAxleHeight - robot.R; }

}  // namespace youbot_base_sim
