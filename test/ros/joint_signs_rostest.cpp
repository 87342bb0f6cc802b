// With the driver's own signs, rates and efforts of the wheels on the left are those of their motors, the opposite of
// their positions' rates.

#include "base_client.h"
#include "joint_entry.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

TEST(JointSigns, are_the_drivers) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(0.5), {}));
  base.idle(499);
  base.settle();
  for (int i = 0; i < kWheels; ++i) {
    const double sign = i % 2 == 0 ? -1 : 1;  // fl and bl
    EXPECT_GT(base.joints.position[i], 0.1) << kWheelNames[i];
    EXPECT_GT(sign * base.joints.velocity[i], 0.1) << kWheelNames[i];
    EXPECT_EQ(base.joints.effort[i], sign * 0.5) << kWheelNames[i];
  }
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.05) << "odometry is what it is";
  EXPECT_NEAR(base.odometry.twist.twist.angular.z, 0, 0.1);
}

// Commands have one sign for all wheels, so that a loop closed over both would have positive feedback.
TEST(JointSigns, are_warned_of_once_beside_velocity_commands) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  brics_actuator::JointVelocities right;
  right.velocities = {entry("wheel_joint_fr", kVelocityUnit, 1), entry("wheel_joint_br", kVelocityUnit, 1)};
  base.command(right);
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "positive feedback"), 0u) << "the wheels on the right have one sign";
  for (int k = 0; k < 3; ++k) base.command(velocity_message(Wheels::Constant(1), {}));
  log.expect(base, rosgraph_msgs::Log::WARN, {"positive feedback", "velocity_command", "wheel_joint_fl and _bl"});
  base.command(torque_message({1e6, 0, 0, 0}, {}));
  log.expect(base, rosgraph_msgs::Log::WARN, {"torques_command", "limit"});
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "positive feedback"), 1u);
}

// A wheel at rest has no -0 with either sign.
TEST(JointSigns, of_zero_are_positive) {
  BaseClient& base = BaseClient::fresh();
  base.settle();
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_EQ(base.joints.velocity[i], 0) << kWheelNames[i];
    EXPECT_FALSE(std::signbit(base.joints.velocity[i])) << kWheelNames[i];
    EXPECT_FALSE(std::signbit(base.joints.effort[i])) << kWheelNames[i];
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
