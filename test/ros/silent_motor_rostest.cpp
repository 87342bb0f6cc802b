// A motor that does not answer stands still in the joint states and drags; the driver goes on with the others.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(SilentMotor, drags_while_the_driver_goes_on) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.4, 0, 0));
  base.idle(499);
  base.settle();
  const double position = base.joints.position[1];
  SetFaults::Request faults;
  faults.silent[1] = true;
  base.set_faults(faults);
  base.command(twist(0, 0, 0));  // does not reach it
  base.idle(999);
  base.settle();
  EXPECT_NEAR(base.joints.position[1], position, 0.02);
  EXPECT_GT(base.joints.velocity[1], 5) << "of before";
  EXPECT_NEAR(base.joints.velocity[0], 0, 0.1);
  base.set_faults({});
  base.idle(500);
  base.settle();
  EXPECT_NEAR(base.joints.velocity[1], 0, 0.1) << "what it was told last";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
