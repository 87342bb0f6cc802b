#pragma once

#include <string>

#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/text/number.h"

namespace youbot_base_sim {

/// What a table must have, for messages.
constexpr char kTableColumns[] = "the columns t,fl,fr,bl,br";

/// Reads a CSV file with the columns t (increasing), fl, fr, bl and br, whose numbers are in the ranges. Its first line
/// names them, in any order. Throws SceneError, which names the file, the line, the value and what is allowed, and
/// UnreadableFile.
WheelTable read_wheel_table(const std::string& path, const Range& time, const Range& values);

}  // namespace youbot_base_sim
