// Runs controllers of ros_control on the simulated base. The node is the clock of the system: it publishes /clock, and
// ground_truth (nav_msgs/Odometry), once a period of the controllers.
//
// Parameters: ~scene, a scene file (the measured robot if left out); ~control_rate, Hz, of the controllers; and
// ~real_time_factor, 0 for as fast as possible.

#include <controller_manager/controller_manager.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <cmath>
#include <stdexcept>

#include "youbot_robot_hw/youbot_hw.h"

namespace {

using youbot_base_sim::Scene;
using youbot_base_sim::SceneUse;
using youbot_base_sim::State;

Scene read_scene(const ros::NodeHandle& parameters) {
  const auto file = parameters.param<std::string>("scene", "");
  if (!file.empty()) return youbot_base_sim::load_scene(file, {}, SceneUse::kCommands);
  return youbot_base_sim::default_scene({{"robot.profile", "measured"}}, SceneUse::kCommands);
}

/// A parameter that must be a number from `least` on.
double number(const ros::NodeHandle& parameters, const std::string& name, double value, double least) {
  value = parameters.param(name, value);
  if (std::isfinite(value) && value >= least) return value;
  throw std::invalid_argument("~" + name + " is " + std::to_string(value) + ", allowed is " + std::to_string(least) +
                              " or more");
}

nav_msgs::Odometry ground_truth(const ros::Time& stamp, const State& state) {
  nav_msgs::Odometry message;
  message.header.stamp = stamp;
  message.header.frame_id = "world";
  message.child_frame_id = "base_link";
  message.pose.pose.position.x = state.x();
  message.pose.pose.position.y = state.y();
  message.pose.pose.orientation.z = std::sin(state.psi() / 2);
  message.pose.pose.orientation.w = std::cos(state.psi() / 2);
  message.twist.twist.linear.x = state.V_X();
  message.twist.twist.linear.y = state.V_Y();
  message.twist.twist.angular.z = state.velocity()[2];
  return message;
}

void run() {
  ros::NodeHandle node, parameters("~");
  if (!ros::Time::isSimTime()) throw std::runtime_error("/use_sim_time must be true: this node publishes /clock");
  const ros::Duration period(1 / number(parameters, "control_rate", 100, 1));
  const double factor = number(parameters, "real_time_factor", 1, 0);

  youbot_robot_hw::YoubotHW hardware(read_scene(parameters));
  controller_manager::ControllerManager controllers(&hardware, node);
  ros::Publisher clock = node.advertise<rosgraph_msgs::Clock>("/clock", 10);
  ros::Publisher truth = node.advertise<nav_msgs::Odometry>("ground_truth", 10);
  ros::AsyncSpinner services(1);  // of the controllers' manager
  services.start();

  ros::WallRate rate(factor > 0 ? factor / period.toSec() : 1);
  // Time zero means "no time yet" in ROS.
  for (ros::Time time(period.toSec()); ros::ok(); time += period) {
    rosgraph_msgs::Clock message;
    message.clock = time;
    clock.publish(message);
    hardware.read(time, period);
    truth.publish(ground_truth(time, hardware.base().state()));
    controllers.update(time, period);
    hardware.write(time, period);
    if (factor > 0) rate.sleep();
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "youbot_robot_hw");
  try {
    run();
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
}
