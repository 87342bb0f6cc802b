// By default the node goes by the wall clock, as the robot does.

#include <ros/master.h>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(WallClock, paces_and_stamps) {
  ros::NodeHandle node;
  std::vector<ros::Time> stamps;
  double max_offset = 0;
  const auto take = [&](const nav_msgs::Odometry::ConstPtr& message) {
    stamps.push_back(message->header.stamp);
    max_offset = std::max(max_offset, std::abs((ros::Time::now() - message->header.stamp).toSec()));
  };
  const ros::Subscriber subscriber = node.subscribe<nav_msgs::Odometry>("odom", 1000, take);
  const auto limit = ros::WallTime::now() + ros::WallDuration(30);
  ros::WallTime start;
  while (stamps.size() < 101 && ros::ok() && ros::WallTime::now() < limit) {
    ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
    if (stamps.size() == 1 && start.isZero()) start = ros::WallTime::now();
  }
  const double wall = (ros::WallTime::now() - start).toSec();
  ASSERT_GE(stamps.size(), 101u);
  // 50 Hz; the bounds leave room for a busy machine, on which the loop may also catch up with a second at most.
  EXPECT_GT(wall, 1.0);
  EXPECT_LT(wall, 20.0);
  EXPECT_NEAR((stamps[100] - stamps[0]).toSec(), wall, 5.0);
  EXPECT_LT(max_offset, 5.0) << "stamps are wall time";
  for (std::size_t k = 1; k < stamps.size(); ++k) EXPECT_GT(stamps[k], stamps[k - 1]);
}

TEST(WallClock, leaves_time_alone) {
  ros::master::V_TopicInfo topics;
  ASSERT_TRUE(ros::master::getTopics(topics));
  for (const auto& topic : topics) EXPECT_NE(topic.name, "/clock");
  EXPECT_FALSE(ros::service::exists("base_node/pause", false));
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
