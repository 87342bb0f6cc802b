// Dry friction in the drives holds the base against torques below it and lets it go above.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(DryFriction, holds_and_lets_go) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(0.4), {}));
  base.idle(999);
  base.settle();
  EXPECT_NEAR(base.truth.pose.pose.position.x, 0, 1e-3);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, 0, 1e-6);
  EXPECT_EQ(base.joints.effort[0], 0.4) << "the motor's torque, as its current tells";

  base.command(torque_message(Wheels::Constant(0.8), {}));
  base.idle(999);
  base.settle();
  EXPECT_GT(base.truth.twist.twist.linear.x, 0.1);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
