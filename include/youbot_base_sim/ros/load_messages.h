#pragma once

#include <geometry_msgs/WrenchStamped.h>
#include <ros/time.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/SetLoads.h>

#include <string>
#include <vector>

#include "youbot_base_sim/physics/applied_loads.h"

/// Conversions between loads and wrenches of the simulation and messages, as pure functions. Their points are given
/// from O at the height of the axles, those of messages in base_link.
namespace youbot_base_sim {

/// A wrench message as the simulation has it. Frames base_link, base_footprint and none are the platform's; in `world`
/// and `odom` the force keeps its direction in the fixed frame, and acts at the base all the same. The point is the
/// origin of base_link. `complaint` says why it cannot be taken; empty: it can.
Wrench wrench_of(const geometry_msgs::WrenchStamped& message, std::string& complaint);

/// Loads of a request. `complaint` as above.
std::vector<Load> loads_of(const SetLoads::Request& request, std::string& complaint);

/// The sum of wrenches on a base at heading psi (rad): force and torque in base_link, about its origin.
geometry_msgs::WrenchStamped wrench_message(const std::vector<Wrench>& wrenches, double psi, const ros::Time& stamp);

LoadsStamped loads_message(const std::vector<Load>& loads, const ros::Time& stamp);

/// The force of a wrench on a base at heading psi (rad) in the platform's frame, N.
Eigen::Vector3d platform_force(const Wrench& wrench, double psi);

}  // namespace youbot_base_sim
