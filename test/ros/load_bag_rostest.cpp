// What comes by ~wrench, ~set_loads and ~set_state is in the node's bag, under the names that the node has in its
// namespace.

#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include "base_process.h"
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

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
