// The scene's motors are the node's, but for what a parameter tells.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(MotorSettings, are_the_scenes_unless_a_parameter_is_given) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(2), base.clock()));
  base.idle(49);
  base.settle();
  EXPECT_NEAR(base.joints.effort[0], 0, 1e-3) << "the parameter's delay is longer than the scene's";
  base.idle(1);
  base.settle();
  EXPECT_NEAR(base.joints.effort[0], 0.8, 1e-12) << "the scene's limit";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
