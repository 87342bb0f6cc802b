// Twists drive the base the right way and as fast as a real one, and both odometry and ground truth say so.

#include "base_client.h"
#include "step_response.h"
#include "youbot_base_sim/drive/motor.h"

namespace youbot_base_sim {
namespace {

// The driver takes the wheels for 5 % smaller than they are.
constexpr double kRadiusRatio = 0.05 / 0.0475;

class CmdVel : public ::testing::Test {
 protected:
  void drive(double v_x, double v_y, double omega) {
    geometry_msgs::Twist command = twist(v_x, v_y, omega);
    command.linear.z = command.angular.x = command.angular.y = std::nan("");  // ignored
    for (int k = 0; k < 1000; ++k) base_.command(command);
    base_.settle();
    EXPECT_EQ(base_.time(), 1.0);
    expect_pose({v_x, v_y, omega});
  }

  /// The velocity times the time, less what the wheels have fallen behind: as far as it takes for the velocity loops to
  /// gather the torque that they exert. The ground truth is also off by slip.
  void expect_pose(const Eigen::Vector3d& velocity) {
    const DriverKinematics kinematics;
    const Wheels rates = kinematics.wheel_rates(velocity);
    const VelocityGains gains;
    Wheels behind;
    for (int i = 0; i < kWheels; ++i) {
      const double error = rates[i] - base_.joints.velocity[i];
      behind[i] = (base_.joints.effort[i] - gains.proportional * error) / gains.integral;
    }
    const Eigen::Vector3d way = velocity * base_.time(), pose = way - kinematics.velocity(behind);
    EXPECT_GT(pose.norm(), 0.6 * way.norm());
    EXPECT_LT((pose_of(base_.odometry) - pose).norm(), 0.01 * way.norm());
    EXPECT_LT((pose_of(base_.truth) - kRadiusRatio * pose).norm(), 0.1 * way.norm());
  }

  static Eigen::Vector3d pose_of(const nav_msgs::Odometry& message) {
    const auto& pose = message.pose.pose;
    return {pose.position.x, pose.position.y, heading(pose.orientation)};
  }

  /// Commands a velocity to the base at rest, and expects of its wheels what those of a real base did.
  void expect_like_a_real_base(const geometry_msgs::Twist& command, double rise) {
    const Wheels rates = DriverKinematics().wheel_rates({command.linear.x, command.linear.y, command.angular.z});
    base_.command(command);
    RateStep step;
    for (int k = 0; k < 300; ++k) {
      base_.idle(10);
      base_.settle();
      double share = 0;
      for (int i = 0; i < kWheels; ++i) share += base_.joints.velocity[i] / rates[i] / kWheels;
      step.add(base_.time(), share);
    }
    youbot_base_sim::expect_like_a_real_base(step.rise(), step.overshoot(), step.settled(), rise, "");
  }

  BaseClient& base_ = BaseClient::fresh();
};

TEST_F(CmdVel, drives_forward) { drive(0.2, 0, 0); }
TEST_F(CmdVel, drives_to_the_left) { drive(0, 0.2, 0); }
TEST_F(CmdVel, turns_counter_clockwise) { drive(0, 0, 0.5); }

TEST_F(CmdVel, is_followed_ahead) { expect_like_a_real_base(twist(records::speed, 0, 0), records::rise_ahead); }
TEST_F(CmdVel, is_followed_sideways) { expect_like_a_real_base(twist(0, records::speed, 0), records::rise_sideways); }
TEST_F(CmdVel, is_followed_turning) { expect_like_a_real_base(twist(0, 0, records::turn), records::rise_turning); }

TEST_F(CmdVel, tells_the_velocity_in_the_frame_of_the_base) {
  base_.command(twist(0.2, 0, 1));
  base_.idle(2000);
  base_.settle();
  for (const nav_msgs::Odometry& message : {base_.odometry, base_.truth}) {
    EXPECT_NEAR(message.twist.twist.linear.x, 0.2, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.linear.y, 0, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.angular.z, 1, 0.2) << message.header.frame_id;
  }
}

TEST_F(CmdVel, holds_without_a_word) {
  base_.command(twist(0.2, 0, 0));
  // Any command makes time go on; one without a wheel changes nothing.
  base_.idle(999);
  base_.settle();
  expect_pose({0.2, 0, 0});
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
