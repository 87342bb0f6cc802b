// Of a bad command the good part takes effect, the bad part is named in the log, and the state stays finite.

#include "base_client.h"
#include "joint_entry.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

class BadCommands : public ::testing::Test {
 protected:
  BadCommands() { base_.command(torque_message(kBefore, {})); }

  void command(const std::vector<brics_actuator::JointValue>& torques) {
    brics_actuator::JointTorques message;
    message.torques = torques;
    base_.command(message);
  }

  void expect_torques(const Wheels& expected) {
    base_.settle();
    for (int i = 0; i < kWheels; ++i) EXPECT_EQ(base_.joints.effort[i], expected[i]) << kWheelNames[i];
    EXPECT_TRUE(std::isfinite(base_.truth.pose.pose.position.x));
  }

  void expect_warning(const std::vector<std::string>& words) { log_.expect(base_, rosgraph_msgs::Log::WARN, words); }

  const Wheels kBefore{0.1, 0.2, 0.3, 0.4};
  BaseClient& base_ = BaseClient::fresh();
  Log& log_ = Log::of(base_);
};

TEST_F(BadCommands, entry_with_a_wrong_unit_is_skipped) {
  command({entry("wheel_joint_fl", kTorqueUnit, 1), entry("wheel_joint_fr", "N m", 1), entry("wheel_joint_bl", "", 1),
           entry("wheel_joint_br", kTorqueUnit, 1)});
  expect_torques({1, 0.2, 0.3, 1});
  expect_warning({"torques_command", "wheel_joint_fr", "\"N m\"", kTorqueUnit});
  expect_warning({"torques_command", "wheel_joint_bl", "\"\"", kTorqueUnit});
}

TEST_F(BadCommands, number_that_is_none_is_refused) {
  command({entry("wheel_joint_fl", kTorqueUnit, kNan), entry("wheel_joint_fr", kTorqueUnit, kInf),
           entry("wheel_joint_bl", kTorqueUnit, -kInf), entry("wheel_joint_br", kTorqueUnit, 1)});
  expect_torques({0.1, 0.2, 0.3, 1});
  expect_warning({"torques_command", "wheel_joint_fl", "nan"});
  expect_warning({"torques_command", "wheel_joint_fr", "inf"});
  expect_warning({"torques_command", "wheel_joint_bl", "-inf"});
}

TEST_F(BadCommands, unknown_joint_is_ignored) {
  command({entry("arm_joint_1", "rad", 1), entry("wheel_joint_xx", kTorqueUnit, 1),
           entry("wheel_joint_br", kTorqueUnit, 1)});
  expect_torques({0.1, 0.2, 0.3, 1});
}

TEST_F(BadCommands, first_of_two_counts) {
  command({entry("wheel_joint_fl", kTorqueUnit, 1), entry("wheel_joint_fl", kTorqueUnit, 2)});
  expect_torques({1, 0.2, 0.3, 0.4});
}

TEST_F(BadCommands, empty_command_changes_nothing) {
  command({});
  expect_torques(kBefore);
  expect_warning({"torques_command", "no joint"});
}

TEST_F(BadCommands, torque_beyond_the_motor_is_clipped) {
  command({entry("wheel_joint_fl", kTorqueUnit, 1e6), entry("wheel_joint_br", kTorqueUnit, -1e300)});
  expect_torques({Motor().max_torque(), 0.2, 0.3, -Motor().max_torque()});
  expect_warning({"torques_command", "wheel_joint_fl", "1000000 N m", "limit", "clipped to 3.0849 N m"});
  expect_warning({"torques_command", "wheel_joint_br", "-1e+300 N m", "limit", "clipped to -3.0849 N m"});
}

TEST_F(BadCommands, velocity_beyond_the_motor_is_clipped) {
  base_.command(velocity_message({20, 1, 1, 1}, {}));
  expect_warning({"velocity_command", "wheel_joint_fl", "20 rad/s", "limit", "clipped to 16.212 rad/s"});
  base_.command(twist(1, 0, 0));
  expect_warning({"cmd_vel", "wheel_joint_br", "21.05263 rad/s", "limit", "clipped to 16.212 rad/s"});
}

TEST_F(BadCommands, twist_that_is_none_is_refused) {
  geometry_msgs::Twist twist;
  twist.angular.z = kNan;
  base_.command(twist);
  expect_torques(kBefore);
  expect_warning({"cmd_vel", "nan"});
}

TEST_F(BadCommands, velocity_with_a_wrong_unit_is_skipped) {
  brics_actuator::JointVelocities message;
  message.velocities = {entry("wheel_joint_fl", kTorqueUnit, 1), entry("wheel_joint_fr", "rad/s", 1)};
  base_.command(message);
  expect_torques(kBefore);
  expect_warning({"velocity_command", "wheel_joint_fr", "\"rad/s\"", kVelocityUnit});
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
