// By default the node goes by the wall clock, as the robot does.

#include <ros/master.h>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(WallClock, paces_and_stamps) {
  ros::NodeHandle node;
  std::vector<ros::Time> stamps;
  double max_lead = 0, max_lag = 0;  // of stamps, against the wall clock, s
  const auto take = [&](const nav_msgs::Odometry::ConstPtr& message) {
    stamps.push_back(message->header.stamp);
    const double lag = (ros::Time::now() - message->header.stamp).toSec();
    max_lag = std::max(max_lag, lag);
    max_lead = std::max(max_lead, -lag);
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
  // 50 Hz; the bounds leave room for a busy machine, which may be late with anything but not early.
  EXPECT_LT(max_lead, 0.05) << "time goes faster than the wall clock";
  EXPECT_LT(max_lag, 5.0) << "stamps are wall time";
  EXPECT_LT(wall, 20.0);
  EXPECT_NEAR((stamps[100] - stamps[0]).toSec(), wall, 5.0);
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
