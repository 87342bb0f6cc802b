#pragma once

#include <string>

#include "youbot_base_sim/identify/drive_record.h"

namespace youbot_base_sim {

/// Reads a drive from a bag: joint_states, commands (cmd_vel, base/base_controller/velocity_command) and, if
/// there is any, ground_truth, in any namespace. Twists become rates of the wheels by the lengths with which the bag's
/// odom was computed, else by the driver's own. Positions, rates and efforts are as the bag has them. Throws
/// UnusableRecord for a bag that cannot be read or lacks what is needed.
DriveRecord read_drive_bag(const std::string& path);

}  // namespace youbot_base_sim
