// Commands in masses, from two publishers, of all kinds, mixed and mad: the last one for a wheel counts, the log stays
// readable, and the state stays finite.

#include "base_client.h"
#include "joint_entry.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

constexpr int kFlood = 3000;  // three queues full

TEST(Floods, leave_the_last_command) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  ros::NodeHandle node;
  ros::Publisher second = node.advertise<brics_actuator::JointTorques>(kTorqueTopic, kFlood);
  base.wait_for("the second publisher's connection", [&] { return second.getNumSubscribers() > 0; });
  for (int k = 0; k < kFlood; ++k) {
    brics_actuator::JointTorques message;
    message.torques = {entry("wheel_joint_fl", kTorqueUnit, k % 2 == 0 ? 1e6 : kNan),
                       entry("wheel_joint_fr", "furlong", 1), entry("wheel_joint_bl", kTorqueUnit, -1e300)};
    second.publish(message);
    if (k % 10 == 0) base.send(torque_message(Wheels::Constant(1e6), {}));
  }
  // In lockstep each message is a control period; it ends when all that was not dropped has been played.
  base.wait_for("the flood to be over", [&] { return base.time() > 1.0; });
  base.command(torque_message(Wheels::Zero(), {}));
  base.wait_for("the last command", [&] {
    base.command(torque_message(Wheels(0.1, 0.2, 0.3, 0.4), {}));
    base.settle();
    return base.joints.effort[0] == 0.1;
  });
  for (const double number : {base.truth.pose.pose.position.x, base.truth.pose.pose.position.y,
                              base.truth.twist.twist.linear.x, base.odometry.pose.pose.position.x}) {
    EXPECT_TRUE(std::isfinite(number)) << number;
  }
  log.expect(base, rosgraph_msgs::Log::WARN, {"torques_command", "wheel_joint_fr", "furlong"});
  EXPECT_LT(log.count(rosgraph_msgs::Log::WARN, "furlong"), 30u) << "one a second at most";
}

TEST(Floods, kinds_may_be_mixed_wheel_by_wheel) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.2, 0, 0));
  brics_actuator::JointTorques torque;
  torque.torques = {entry("wheel_joint_fl", kTorqueUnit, 0.5)};
  base.command(torque);
  base.idle(300);
  base.settle();
  EXPECT_EQ(base.joints.effort[0], 0.5) << "by torque";
  EXPECT_NEAR(base.joints.velocity[3], 0.2 / 0.0475, 0.3) << "by velocity still";
  base.command(twist(0, 0, 0));
  base.idle(1000);
  base.settle();
  EXPECT_NEAR(base.joints.velocity[0], 0, 0.05) << "by velocity again";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
