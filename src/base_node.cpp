// The simulated base as a ROS node.

#include "youbot_base_sim/ros/base_node.h"

#include <ros/ros.h>

#include "youbot_base_sim/ros/parameters.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  ros::init(argc, argv, "base_node");
  if (argc > 1) {
    ROS_FATAL("unexpected argument %s: base_node takes ROS parameters, as _scene:=FILE, and remappings only", argv[1]);
    return 2;
  }
  const ros::NodeHandle keep_alive;  // ROS shuts down, its log included, with the last handle
  try {
    BaseNode(read_base_settings()).run();
  } catch (const ParameterError& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}
