// TF says what the topics say.

#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

void expect_same(const geometry_msgs::Transform& transform, const geometry_msgs::Pose& pose, double tolerance) {
  EXPECT_NEAR(transform.translation.x, pose.position.x, tolerance);
  EXPECT_NEAR(transform.translation.y, pose.position.y, tolerance);
  EXPECT_NEAR(transform.translation.z, pose.position.z, tolerance);
  EXPECT_NEAR(std::remainder(heading(transform.rotation) - heading(pose.orientation), 2 * M_PI), 0, tolerance);
}

TEST(Transforms, agree_with_the_topics) {
  tf2_ros::Buffer buffer;
  tf2_ros::TransformListener listener(buffer);
  BaseClient& base = BaseClient::fresh();
  const auto lookup = [&](const std::string& frame) {
    base.wait_for("the transform", [&] { return buffer.canTransform(frame, "base_footprint", base.clock()); });
    return buffer.lookupTransform(frame, "base_footprint", base.clock()).transform;
  };

  // At the start odometry lies over ground truth.
  expect_same(lookup("world"), base.truth.pose.pose, 1e-12);
  expect_same(lookup("odom"), base.odometry.pose.pose, 1e-12);
  EXPECT_EQ(base.odometry.pose.pose.position.x, 0);
  EXPECT_EQ(base.truth.pose.pose.position.x, 2.5);

  geometry_msgs::Twist twist;
  twist.linear.x = 0.2;
  twist.linear.y = -0.1;
  twist.angular.z = 0.4;
  for (int k = 0; k < 300; ++k) {
    base.command(twist);
    if (k % 30 != 29) continue;
    base.settle();
    expect_same(lookup("odom"), base.odometry.pose.pose, 1e-12);
    base.wait_for("the truth",
                  [&] { return buffer.canTransform("world", "ground_truth/base_footprint", base.clock()); });
    expect_same(buffer.lookupTransform("world", "ground_truth/base_footprint", base.clock()).transform,
                base.truth.pose.pose, 1e-12);
  }
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.02);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
