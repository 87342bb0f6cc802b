// The node's bag has all that it publishes, also by another node's clock, under the names that it has in its namespace;
// and what comes by ~wrench, ~set_loads and ~set_state.

#include <geometry_msgs/Twist.h>
#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include "base_process.h"
#include "frame_tree.h"
#include "rostest_main.h"

namespace youbot_base_sim {
namespace {

template <class Message>
std::vector<Message> read(const rosbag::Bag& bag, const std::string& topic) {
  std::vector<Message> messages;
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, rosbag::TopicQuery(topic))) {
    messages.push_back(*instance.instantiate<Message>());
  }
  return messages;
}

TEST(LoadBag, has_what_pushed_the_base_and_what_it_carried) {
  const TemporaryFolder folder;
  BaseProcess base("pushed", {"_publish_clock:=true", "_tf_prefix:=robot", "_bag:=" + folder.path("x.bag")});
  base.expect_instants(2);
  ros::NodeHandle node;
  ros::Publisher pusher = node.advertise<geometry_msgs::WrenchStamped>("/pushed/base/wrench", 10);
  wait_for("the node to listen", [&] { return pusher.getNumSubscribers() == 1; });
  geometry_msgs::WrenchStamped push;
  push.wrench.force.y = 30;
  push.wrench.torque.z = 2;
  pusher.publish(push);
  SetLoads service;
  service.request.loads.resize(1);
  service.request.loads[0].mass = 7;
  service.request.loads[0].position.x = 0.1;
  ASSERT_TRUE(ros::service::call("/pushed/base/set_loads", service) && service.response.success);
  service.request.loads[0].mass = -7;
  ASSERT_TRUE(ros::service::call("/pushed/base/set_loads", service));
  ASSERT_FALSE(service.response.success);
  base.expect_simulated(0.1);
  service.request.loads.clear();
  ASSERT_TRUE(ros::service::call("/pushed/base/set_loads", service) && service.response.success);
  base.expect_simulated(0.1);
  SetState state;
  state.request.pose.position.x = 4;
  ASSERT_TRUE(ros::service::call("/pushed/base/set_state", state) && state.response.success);
  base.expect_simulated(0.1);
  Program reset("/usr/bin/env", {"rosservice", "call", "/pushed/base/reset"});
  EXPECT_NE(reset.wait(), 0);
  EXPECT_NE(reset.err().find("rejected while ~bag is written"), std::string::npos) << reset.err();
  base.send(SIGINT);
  base.expect_end(0);

  const rosbag::Bag bag(folder.path("x.bag"));
  const auto wrenches = read<geometry_msgs::WrenchStamped>(bag, "/pushed/applied_wrench");
  ASSERT_GT(wrenches.size(), 5u);  // at each instant
  EXPECT_EQ(wrenches.front().header.frame_id, "robot/base_link");
  EXPECT_EQ(wrenches.back().wrench.force.y, 30);
  EXPECT_EQ(wrenches.back().wrench.torque.z, 2);
  EXPECT_NEAR(wrenches.back().wrench.torque.x, 0, 1e-12) << "it acts at the origin of base_link";
  const auto loads = read<LoadsStamped>(bag, "/pushed/loads");
  ASSERT_EQ(loads.size(), 2u);
  ASSERT_EQ(loads[0].loads.size(), 1u);
  EXPECT_EQ(loads[0].loads[0].mass, 7);
  EXPECT_EQ(loads[0].loads[0].position.x, 0.1);
  EXPECT_NEAR(loads[0].loads[0].position.z, 0, 1e-12);
  EXPECT_TRUE(loads[1].loads.empty());
  EXPECT_GT(loads[1].header.stamp, loads[0].header.stamp);
  const auto states = read<nav_msgs::Odometry>(bag, "/pushed/state_set");
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].pose.pose.position.x, 4);
  EXPECT_GT(states[0].header.stamp, loads[1].header.stamp);
  const auto transforms = read<tf2_msgs::TFMessage>(bag, "/tf");
  ASSERT_FALSE(transforms.empty());
  EXPECT_EQ(transforms[0].transforms.at(0).child_frame_id, "robot/base_footprint");
}

/// Expects odometry of each fiftieth of a second up to `end`, topics and frames of its own, and x at the end. Adds its
/// frames.
void expect_complete(const rosbag::Bag& bag, const std::string& name, const ros::Time& end, double x,
                     FrameTree& frames) {
  const auto odometry = read<nav_msgs::Odometry>(bag, "/" + name + "/odom");
  ASSERT_GT(odometry.size(), 20u);
  for (std::size_t k = 1; k < odometry.size(); ++k)
    EXPECT_NEAR((odometry[k].header.stamp - odometry[k - 1].header.stamp).toSec(), 0.02, 1e-8);
  EXPECT_GE(odometry.back().header.stamp, end);
  EXPECT_EQ(odometry.back().header.frame_id, name + "/odom");
  EXPECT_NEAR(odometry.back().pose.pose.position.x, x, 0.1 * x) << name;
  EXPECT_EQ(read<nav_msgs::Odometry>(bag, "/" + name + "/ground_truth").size(), odometry.size());
  for (const rosbag::ConnectionInfo* topic : rosbag::View(bag).getConnections()) {
    EXPECT_TRUE(topic->topic.rfind("/" + name + "/", 0) == 0 || topic->topic.rfind("/tf", 0) == 0) << topic->topic;
  }
  for (const std::string topic : {"/tf", "/tf_static"}) {
    const auto messages = read<tf2_msgs::TFMessage>(bag, topic);
    EXPECT_EQ(messages.size(), topic == "/tf" ? odometry.size() : 1u);
    for (const tf2_msgs::TFMessage& message : messages) frames.add(message);
  }
}

TEST(LoadBag, two_robots_have_one_each_by_one_clock) {
  const TemporaryFolder folder;
  ros::param::set("/use_sim_time", true);
  const auto parameters = [&](const std::string& name) {
    return std::vector<std::string>{"_tf_prefix:=" + name, "_world_tf:=true", "_bag:=" + folder.path(name)};
  };
  std::vector<std::string> master = parameters("one");
  master.insert(master.end(), {"_publish_clock:=true", "_real_time_factor:=0.5"});
  BaseProcess first("one", master), second("two", parameters("two"));
  first.expect_instants(1);
  second.expect_instants(1);
  ros::NodeHandle node;
  ros::Publisher commands = node.advertise<geometry_msgs::Twist>("/two/cmd_vel", 10);
  wait_for("the node to listen", [&] { return commands.getNumSubscribers() == 1; });
  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  commands.publish(twist);
  second.expect_simulated(1);
  twist.linear.x = 0;
  commands.publish(twist);
  second.expect_simulated(0.1);
  const ros::Time end = second.stamps().back();
  for (BaseProcess* base : {&second, &first}) {
    base->send(SIGINT);
    base->expect_end(0);
  }
  ros::param::del("/use_sim_time");

  FrameTree frames;
  expect_complete(rosbag::Bag(folder.path("one")), "one", end, 0, frames);
  expect_complete(rosbag::Bag(folder.path("two")), "two", end, 0.2, frames);
  for (const std::string name : {"one/base_footprint", "two/base_footprint"}) EXPECT_TRUE(frames.has(name));
  frames.expect_whole("world");
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
