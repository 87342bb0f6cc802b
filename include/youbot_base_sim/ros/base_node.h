#pragma once

#include <ros/node_handle.h>

#include <atomic>
#include <functional>

namespace youbot_base_sim {

/// The simulated base in ROS, with the driver's topics and services: reads the parameters (base_settings.h), private
/// ones from `private_node`, and advertises. Throws ParameterError, also if the bag cannot be opened. The function that
/// it returns owns the base. It runs until ROS shuts down, `stop` is set, which must outlive it, or the simulation has
/// ended. It throws std::runtime_error if what would be published is not finite, or if a required bag cannot be
/// written.
std::function<void()> make_base_node(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                     const std::atomic<bool>& stop);

}  // namespace youbot_base_sim
