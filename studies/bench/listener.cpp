// A node that listens to the base and commands it, for so many seconds. With "manager" as the first argument the base
// is a nodelet in this process; with "empty" it has none of that. Prints the share of a core that the process takes, %.

#include <fmt/format.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <nodelet/loader.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "youbot_base_sim/RollerSwitchStamped.h"

int main(int argc, char** argv) {
  ros::init(argc, argv, "listener", ros::init_options::AnonymousName);
  if (argc != 3) return 2;
  const std::string part = argv[1];
  const double seconds = std::atof(argv[2]);
  ros::NodeHandle node;
  nodelet::Loader loader(false);
  if (part == "manager" && !loader.load("/base_node", "youbot_base_sim/Base", {}, {})) return 1;
  std::vector<ros::Subscriber> subscribers;
  std::size_t heard = 0;
  const auto listen = [&](const char* topic, auto message) {
    using Message = decltype(message);
    subscribers.push_back(node.subscribe<Message>(
        topic, 1000, [&heard](const boost::shared_ptr<const Message>&) { ++heard; }, {},
        ros::TransportHints().tcpNoDelay()));
  };
  ros::Publisher commands;
  ros::WallTimer timer;
  if (part != "empty") {
    listen("/odom", nav_msgs::Odometry());
    listen("/ground_truth", nav_msgs::Odometry());
    listen("/base/joint_states", sensor_msgs::JointState());
    listen("/tf", tf2_msgs::TFMessage());
    listen("/base/roller_switches", youbot_base_sim::RollerSwitchStamped());
    commands = node.advertise<geometry_msgs::Twist>("/cmd_vel", 1);
  }
  timer = node.createWallTimer(ros::WallDuration(part == "empty" ? 0.02 : 0.1), [&](const ros::WallTimerEvent&) {
    geometry_msgs::Twist twist;
    twist.linear.x = 0.3;
    twist.angular.z = 0.5;
    if (commands) commands.publish(twist);
  });
  const auto spin = [](double duration) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(duration);
    while (ros::WallTime::now() < end) ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.1));
  };
  spin(3);
  const std::clock_t before = std::clock();
  heard = 0;
  spin(seconds);
  fmt::print("{:.1f} {:.0f}\n", 100 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / seconds,
             static_cast<double>(heard) / seconds);
  std::fflush(stdout);
  loader.unload("/base_node");
  return 0;
}
