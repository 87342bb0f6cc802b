// With the driver's command rate, commands take effect at its cycles of 20 ms, as they do in the driver's loop.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(CommandRate, commands_wait_for_the_drivers_cycle) {
  BaseClient& base = BaseClient::fresh();
  for (int k = 1; k <= 10; ++k) {
    const double torque = 0.1 * k;
    base.send(torque_message(Wheels::Constant(torque), {}));
    sensor_msgs::JointState first;
    base.wait_for("the command to act", [&] {
      first = base.joints;
      return first.effort.at(0) == torque;
    });
    // It acts over the control period that begins with a cycle and is told at the period's end.
    const double cycles = (time_of(first.header.stamp) - 1e-3) / 0.02;
    EXPECT_NEAR(cycles, std::round(cycles), 1e-6) << "at " << first.header.stamp;
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
