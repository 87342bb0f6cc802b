#pragma once

#include <array>
#include <optional>
#include <string>

#include "youbot_base_sim/identify/drive_record.h"

namespace youbot_base_sim {

/// What in a bag is the base's.
struct BagNames {
  std::array<std::string, kWheels> joints;  ///< of the wheels in joint_states; empty: the youBot's
  Wheels units = Wheels::Ones();            ///< rad forward for one unit of a joint's position
  std::string truth_topic;                  ///< empty: ground_truth, base_pose_ground_truth or pose, in any namespace
  std::array<std::string, 2> truth_frames;  ///< unless empty, transforms from the first to the second are ground truth
  std::optional<bool> truth_of_marker;      ///< rather than of the base at the bag's clock; by default by its type
  bool angles_alone = false;                ///< no command counts, so that those of torques do no harm
};

/// Reads a drive from a bag: joint_states, commands (cmd_vel, base/base_controller/velocity_command) and, if
/// there is any, ground truth, in any namespace. Ground truth is nav_msgs/Odometry of the base, or geometry_msgs
/// PoseStamped, PoseWithCovarianceStamped or TransformStamped of a marker on it. Twists become rates of the wheels by
/// the lengths with which the bag's odom was computed, else by the driver's own. Rates and efforts are as the bag has
/// them; without rates, they are differences of the positions. Throws UnusableRecord for a bag that cannot be read or
/// lacks what is needed.
DriveRecord read_drive_bag(const std::string& path, const BagNames& names = {});

}  // namespace youbot_base_sim
