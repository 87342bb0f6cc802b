// ~dry_friction, that of the drives, holds the base against torques below it and lets it go above.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

// Friction of T N m, smoothed over the rate r, carries M N m at the rate r M / sqrt(T^2 - M^2).
TEST(DryFriction, holds_but_for_creep_and_lets_go) {
  const RobotParameters robot;
  const double T = 0.5, M = 0.4, creep = robot.dry_friction_rate * M / std::sqrt(T * T - M * M);
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(M), {}));
  base.idle(999);
  base.settle();
  EXPECT_NEAR(base.joints.velocity[0], creep, 0.02 * creep);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, robot.R * creep, 0.02 * robot.R * creep);
  EXPECT_EQ(base.joints.effort[0], M) << "the motor's torque, as its current tells";

  base.command(torque_message(Wheels::Constant(0.8), {}));
  base.idle(999);
  base.settle();
  EXPECT_GT(base.truth.twist.twist.linear.x, 0.1);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
