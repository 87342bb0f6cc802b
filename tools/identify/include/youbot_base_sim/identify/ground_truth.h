#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Prepares the ground truth of an inspected record. That of a marker is moved onto the base and to the clock of the
/// wheels: both offsets follow by robust least squares from the motion that the wheels roll. Gaps are not bridged.
/// Returns a line on each finding, also where an offset cannot be determined and the ground truth is left out. Throws
/// UnusableRecord where the base is not one of the robot's sizes, by ground truth or by the bag's odometry.
std::vector<std::string> prepare_ground_truth(DriveRecord& record, const RobotParameters& robot);

}  // namespace youbot_base_sim
