// Drives one metre forward by odometry and ends. It works alike with the real and the simulated base.

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/ros.h>

#include <algorithm>
#include <cmath>

namespace {

constexpr double kGoal = 1.0;         // m
constexpr double kTolerance = 0.005;  // m
constexpr double kGain = 2.0;         // 1/s
constexpr double kMaxSpeed = 0.5;     // m/s

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "drive_ahead");
  ros::NodeHandle node;
  bool known = false;
  double x = 0;
  const ros::Publisher commands = node.advertise<geometry_msgs::Twist>("cmd_vel", 1);
  const ros::Subscriber odometry = node.subscribe<nav_msgs::Odometry>("odom", 1, [&](const auto& message) {
    known = true;
    x = message->pose.pose.position.x;
  });
  ros::Rate rate(50);
  const auto sleep = [&rate] {
    rate.sleep();
    ros::spinOnce();
  };
  while (ros::ok() && !known) sleep();
  while (ros::ok() && std::abs(kGoal - x) > kTolerance) {
    geometry_msgs::Twist command;
    command.linear.x = std::clamp(kGain * (kGoal - x), -kMaxSpeed, kMaxSpeed);
    commands.publish(command);
    sleep();
  }
  commands.publish(geometry_msgs::Twist());
  sleep();
}
