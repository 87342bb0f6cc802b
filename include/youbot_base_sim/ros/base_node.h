#pragma once

#include <ros/node_handle.h>

#include <atomic>
#include <memory>

namespace youbot_base_sim {

/// The simulated base in ROS, with the driver's topics and services: the loop of the program base_node.
class BaseNode {
 public:
  virtual ~BaseNode() = default;

  /// Runs until ROS shuts down, `stop` is set or the simulation has ended. Throws std::runtime_error if what would be
  /// published is not finite, or if a required bag cannot be written.
  virtual void run() = 0;
};

/// Reads the parameters (base_settings.h), private ones from `private_node`, and advertises. `run` ends once `stop` is
/// set, which must outlive the node. Throws ParameterError, also if the bag cannot be opened.
std::unique_ptr<BaseNode> make_base_node(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                         const std::atomic<bool>& stop);

}  // namespace youbot_base_sim
