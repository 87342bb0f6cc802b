// The simulated base as a ROS node.

#include "youbot_base_sim/ros/base_node.h"

#include "youbot_base_sim/ros/program.h"

int main(int argc, char** argv) {
  return youbot_base_sim::run_program(argc, argv, "base_node", youbot_base_sim::run_base_node);
}
