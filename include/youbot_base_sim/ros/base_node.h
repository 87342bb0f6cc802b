#pragma once

namespace youbot_base_sim {

/// The simulated base as a ROS node, which needs ros::init: reads its parameters, and simulates until ROS shuts down.
/// Throws ParameterError for wrong ones, and std::runtime_error where anything that would be published is not finite,
/// or where a required bag cannot be written.
void run_base_node();

}  // namespace youbot_base_sim
