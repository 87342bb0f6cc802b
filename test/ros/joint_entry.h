#pragma once

#include <brics_actuator/JointValue.h>

#include <limits>
#include <string>

namespace youbot_base_sim {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

/// One joint's part of a command.
inline brics_actuator::JointValue entry(const std::string& joint, const std::string& unit, double value) {
  brics_actuator::JointValue entry;
  entry.joint_uri = joint;
  entry.unit = unit;
  entry.value = value;
  return entry;
}

}  // namespace youbot_base_sim
