#pragma once

#include <string>

#include "youbot_base_sim/drive/torque_profiles.h"

namespace youbot_base_sim {

/// Reads a CSV file with the columns t (s, increasing), fl, fr, bl and br. Its first line names them, in any order.
/// Throws SceneError, which names the file, the line, the value and what is allowed.
WheelTable read_wheel_table(const std::string& path);

}  // namespace youbot_base_sim
