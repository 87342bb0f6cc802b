// The simulated base as a ROS node.

#include "youbot_base_sim/ros/base_node.h"

#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/program.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  return run_program(
      argc, argv, "base_node", [] { make_base_node({}, ros::NodeHandle("~"), stop_requested())(); },
      "The simulated base with the driver's topics and services: docs/node.md.",
      [] { read_base_settings(Parameters("~"), Parameters("")); });
}
