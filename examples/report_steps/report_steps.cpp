// A filter for which time waits by ~wait_for: one odometry message comes in each step, and after its own message the
// filter reports the step's time on step_done.

#include <nav_msgs/Odometry.h>
#include <ros/ros.h>
#include <std_msgs/Time.h>

int main(int argc, char** argv) {
  ros::init(argc, argv, "report_steps");
  ros::NodeHandle node;
  nav_msgs::Odometry filtered;
  const ros::Publisher out = node.advertise<nav_msgs::Odometry>("filtered", 10);
  const ros::Publisher done = node.advertise<std_msgs::Time>("step_done", 10);
  const auto filter = [&](const nav_msgs::Odometry::ConstPtr& odometry) {
    double& x = filtered.pose.pose.position.x;
    x += 0.5 * (odometry->pose.pose.position.x - x);
    filtered.header = odometry->header;
    out.publish(filtered);
    std_msgs::Time step;
    step.data = odometry->header.stamp;
    done.publish(step);
  };
  const auto no_delay = ros::TransportHints().tcpNoDelay();  // else messages may wait 40 ms
  const ros::Subscriber in = node.subscribe<nav_msgs::Odometry>("odom", 10, filter, {}, no_delay);
  ros::spin();
}
