// launch/youbot_driver.launch puts the node where the real driver's launch file puts the driver: same names, same
// types, same rates.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/Twist.h>
#include <gtest/gtest.h>
#include <nav_msgs/Odometry.h>
#include <ros/callback_queue.h>
#include <ros/master.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Empty.h>
#include <tf2_msgs/TFMessage.h>

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

class DriverLaunch : public ::testing::Test {
 protected:
  template <class Message>
  boost::shared_ptr<const Message> receive(const std::string& topic) {
    const auto message = ros::topic::waitForMessage<Message>(topic, ros::Duration(20));
    if (!message) throw std::runtime_error("nothing on " + topic);
    return message;
  }

  ros::NodeHandle node_;
};

TEST_F(DriverLaunch, node_and_services_have_the_drivers_names) {
  receive<nav_msgs::Odometry>("/odom");
  std::vector<std::string> nodes;
  ASSERT_TRUE(ros::master::getNodes(nodes));
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), "/youbot_driver"), 1);
  EXPECT_EQ(std::count(nodes.begin(), nodes.end(), "/robot_state_publisher"), 1);
  for (const char* service : {"/base/switchOffMotors", "/base/switchOnMotors", "/reconnect"}) {
    EXPECT_TRUE(ros::service::exists(service, true)) << service;
    std_srvs::Empty call;
    EXPECT_TRUE(ros::service::call(service, call)) << service;
  }
}

TEST_F(DriverLaunch, parameters_are_those_of_the_drivers_launch_file) {
  double frequency = 0;
  bool has_base = false;
  std::string name, text;
  EXPECT_TRUE(ros::param::get("/youBotDriverCycleFrequencyInHz", frequency));
  EXPECT_EQ(frequency, 40);
  EXPECT_TRUE(ros::param::get("/youBotHasBase", has_base));
  EXPECT_TRUE(has_base);
  EXPECT_TRUE(ros::param::get("/youBotBaseName", name));
  EXPECT_EQ(name, "youbot-base");
  for (const char* parameter :
       {"/youBotHasArms", "/youBotConfigurationFilePath", "/robot_description", "/trajectoryActionServerEnable",
        "/trajectoryPositionGain", "/trajectoryVelocityGain"}) {
    EXPECT_TRUE(ros::param::has(parameter)) << parameter;
  }
}

TEST_F(DriverLaunch, joint_states_are_the_drivers) {
  const auto joints = receive<sensor_msgs::JointState>("/joint_states");
  const std::vector<std::string> names = {"wheel_joint_fl",  "wheel_joint_fr",  "wheel_joint_bl",  "wheel_joint_br",
                                          "caster_joint_fl", "caster_joint_fr", "caster_joint_bl", "caster_joint_br"};
  EXPECT_EQ(joints->name, names);
  EXPECT_EQ(joints->position.size(), 8u);
  EXPECT_EQ(joints->velocity.size(), 8u);
  EXPECT_EQ(joints->header.frame_id, "");
}

TEST_F(DriverLaunch, odometry_and_transform_are_of_one_instant) {
  std::map<ros::Time, nav_msgs::Odometry> odometry;
  std::map<ros::Time, geometry_msgs::TransformStamped> transforms;
  const ros::Subscriber odom = node_.subscribe<nav_msgs::Odometry>(
      "/odom", 1000, [&](const auto& message) { odometry[message->header.stamp] = *message; });
  const ros::Subscriber tf = node_.subscribe<tf2_msgs::TFMessage>("/tf", 1000, [&](const auto& message) {
    for (const auto& transform : message->transforms) {
      if (transform.child_frame_id == "base_footprint") transforms[transform.header.stamp] = transform;
    }
  });
  const auto limit = ros::WallTime::now() + ros::WallDuration(20);
  while ((odometry.size() < 52 || transforms.size() < 52) && ros::WallTime::now() < limit) {
    ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
  }
  ASSERT_GE(odometry.size(), 52u);
  // 40 Hz by their stamps, which go by simulated instants on the wall clock; time that is lost to a busy machine counts
  // once for each message at most.
  std::vector<double> gaps;
  for (auto next = std::next(odometry.begin()); next != odometry.end(); ++next) {
    gaps.push_back((next->first - std::prev(next)->first).toSec());
  }
  std::sort(gaps.begin(), gaps.end());
  EXPECT_NEAR(gaps[gaps.size() / 2], 0.025, 1e-6);
  int both = 0;
  for (const auto& [stamp, transform] : transforms) {
    const auto found = odometry.find(stamp);
    if (found == odometry.end()) continue;
    ++both;
    EXPECT_EQ(transform.header.frame_id, "odom");
    EXPECT_EQ(found->second.header.frame_id, "odom");
    EXPECT_EQ(found->second.child_frame_id, "base_footprint");
    EXPECT_EQ(transform.transform.translation.x, found->second.pose.pose.position.x);
    for (const double covariance : found->second.pose.covariance) EXPECT_EQ(covariance, 0);
  }
  EXPECT_GT(both, 40);
}

TEST_F(DriverLaunch, robot_state_publisher_knows_the_wheels) {
  std::set<std::string> frames;
  const auto take = [&](const tf2_msgs::TFMessage::ConstPtr& message) {
    for (const auto& transform : message->transforms) frames.insert(transform.child_frame_id);
  };
  const ros::Subscriber tf = node_.subscribe<tf2_msgs::TFMessage>("/tf", 1000, take);
  const auto limit = ros::WallTime::now() + ros::WallDuration(20);
  while (!frames.count("wheel_link_br") && ros::WallTime::now() < limit) {
    ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
  }
  for (const char* wheel : kWheelNames) EXPECT_EQ(frames.count(std::string("wheel_link_") + wheel), 1u) << wheel;
}

TEST_F(DriverLaunch, wheels_on_the_left_have_the_drivers_velocity_sign) {
  ros::Publisher commands = node_.advertise<geometry_msgs::Twist>("/cmd_vel", 1);
  geometry_msgs::Twist forward = twist(0.3, 0, 0);
  sensor_msgs::JointState joints;
  const ros::Subscriber subscriber =
      node_.subscribe<sensor_msgs::JointState>("/joint_states", 1, [&](const auto& message) { joints = *message; });
  const auto limit = ros::WallTime::now() + ros::WallDuration(20);
  while ((joints.velocity.empty() || joints.velocity[1] < 5) && ros::WallTime::now() < limit) {
    commands.publish(forward);
    ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
  }
  ASSERT_EQ(joints.velocity.size(), 8u);
  EXPECT_LT(joints.velocity[0], -4);
  EXPECT_GT(joints.velocity[1], 4);
  EXPECT_LT(joints.velocity[2], -4);
  EXPECT_GT(joints.velocity[3], 4);
  EXPECT_GT(joints.position[0], 0);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
