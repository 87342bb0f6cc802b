#pragma once

#include <ros/node_handle.h>

#include <atomic>
#include <memory>

namespace youbot_base_sim {

/// The simulated base in ROS, with the driver's topics and services: the loop of the program base_node.
class BaseNode {
 public:
  /// Reads the parameters (base_settings.h), private ones from `private_node`, and advertises. `run` ends once `stop`
  /// is set, which must outlive this. Throws ParameterError, also if the bag cannot be opened.
  BaseNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::atomic<bool>& stop);
  ~BaseNode();
  BaseNode(const BaseNode&) = delete;
  BaseNode& operator=(const BaseNode&) = delete;

  /// Runs until ROS shuts down, `stop` is set or the simulation has ended. Throws std::runtime_error if what would be
  /// published is not finite, or if a required bag cannot be written.
  void run();

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace youbot_base_sim
