#pragma once

#include <string>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// For messages.
constexpr char kTableColumns[] = "the columns t,fl,fr,bl,br";

/// Reads a CSV file with the columns t (increasing), fl, fr, bl and br, whose first line names them in any order.
/// Throws UnreadableFile, and SceneError with the file, the line, the value and what is allowed.
WheelTable read_wheel_table(const std::string& path, const Range& time, const Range& values);

}  // namespace youbot_base_sim
