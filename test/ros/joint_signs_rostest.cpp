// With the driver's own signs, rates and efforts of the wheels on the left are those of their motors, the opposite of
// their positions' rates.

#include "base_client.h"

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

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
