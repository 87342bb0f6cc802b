// Twists drive the base the right way, and both odometry and ground truth say so.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

// The driver takes the wheels for 5 % smaller than they are.
constexpr double kRadiusRatio = 0.05 / 0.0475;

class CmdVel : public ::testing::Test {
 protected:
  void drive(double v_x, double v_y, double omega) {
    geometry_msgs::Twist twist;
    twist.linear.x = v_x;
    twist.linear.y = v_y;
    twist.angular.z = omega;
    twist.linear.z = twist.angular.x = twist.angular.y = std::nan("");  // ignored
    for (int k = 0; k < 1000; ++k) base_.command(twist);
    base_.settle();
    EXPECT_EQ(base_.time(), 1.0);
  }

  /// What is commanded, less what is lost while the base gathers speed and, for the ground truth, in slip.
  static void expect_pose(const nav_msgs::Odometry& message, double x, double y, double psi) {
    const double tolerance = 0.15 * (std::abs(x) + std::abs(y) + std::abs(psi));
    EXPECT_NEAR(message.pose.pose.position.x, x, tolerance) << message.header.frame_id;
    EXPECT_NEAR(message.pose.pose.position.y, y, tolerance) << message.header.frame_id;
    EXPECT_NEAR(heading(message.pose.pose.orientation), psi, tolerance) << message.header.frame_id;
  }

  BaseClient& base_ = BaseClient::fresh();
};

TEST_F(CmdVel, drives_forward) {
  drive(0.4, 0, 0);
  expect_pose(base_.odometry, 0.4, 0, 0);
  expect_pose(base_.truth, 0.4 * kRadiusRatio, 0, 0);
}

TEST_F(CmdVel, drives_to_the_left) {
  drive(0, 0.4, 0);
  expect_pose(base_.odometry, 0, 0.4, 0);
  expect_pose(base_.truth, 0, 0.4 * kRadiusRatio, 0);
}

TEST_F(CmdVel, turns_counter_clockwise) {
  drive(0, 0, 1);
  expect_pose(base_.odometry, 0, 0, 1);
  expect_pose(base_.truth, 0, 0, kRadiusRatio);
}

TEST_F(CmdVel, tells_the_velocity_in_the_frame_of_the_base) {
  drive(0.2, 0, 1);
  for (const nav_msgs::Odometry& message : {base_.odometry, base_.truth}) {
    EXPECT_NEAR(message.twist.twist.linear.x, 0.2, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.linear.y, 0, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.angular.z, 1, 0.2) << message.header.frame_id;
  }
}

TEST_F(CmdVel, holds_without_a_word) {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.4;
  base_.command(twist);
  // Any command makes time go on; one without a wheel changes nothing.
  for (int k = 0; k < 999; ++k) base_.command(brics_actuator::JointTorques());
  base_.settle();
  expect_pose(base_.odometry, 0.4, 0, 0);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
