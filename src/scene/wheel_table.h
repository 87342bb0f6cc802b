#pragma once

#include <string>

#include "youbot_base_sim/drive/torque_profiles.h"

namespace youbot_base_sim {

/// Reads a CSV file with the columns t (s, increasing), fl, fr, bl, br, in any order, named in its first line. Throws
/// SceneError, which names the file, the line, the value and what is allowed.
WheelTable read_wheel_table(const std::string& path);

}  // namespace youbot_base_sim
