// Commands that are delayed take effect later, all of them, in order.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(DelayedCommands, take_effect_later) {
  BaseClient& base = BaseClient::fresh();
  SetFaults::Request faults;
  faults.command_delay = 0.05;
  base.set_faults(faults);
  // The command for the period that begins at k ms acts in the one that begins at k + 50 ms.
  for (int k = 0; k < 100; ++k) {
    base.command(torque_message(Wheels::Constant(0.01 * (k + 1)), {}));
    base.settle();
    if (k < 50) {
      EXPECT_NEAR(base.joints.effort[0], 0, 1e-12) << k;
    } else {
      EXPECT_EQ(base.joints.effort[0], 0.01 * (k - 50 + 1)) << k;
    }
  }
}

TEST(DelayedCommands, delay_that_makes_no_sense_is_refused) {
  BaseClient& base = BaseClient::fresh();
  SetFaults service;
  service.request.command_delay = -1;
  ASSERT_TRUE(ros::service::call("base_node/set_faults", service));
  EXPECT_FALSE(service.response.success);
  EXPECT_NE(service.response.message.find("command_delay = -1"), std::string::npos) << service.response.message;
  base.command(torque_message(Wheels::Constant(1), {}));
  base.settle();
  EXPECT_EQ(base.joints.effort[0], 1) << "no delay";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
