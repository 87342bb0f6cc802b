#include "youbot_base_sim/ros/program.h"

#include <ros/ros.h>

#include <exception>

#include "youbot_base_sim/ros/parameters.h"

namespace youbot_base_sim {

int run_program(int argc, char** argv, const char* name, const std::function<void()>& body) {
  ros::init(argc, argv, name);
  if (argc > 1) {
    ROS_FATAL("unexpected argument %s: %s takes ROS parameters, as _scene:=FILE, and remappings only", argv[1], name);
    return 2;
  }
  const ros::NodeHandle keep_alive;  // ROS shuts down, its log included, with the last handle
  try {
    body();
  } catch (const ParameterError& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
  return 0;
}

}  // namespace youbot_base_sim
