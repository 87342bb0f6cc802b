// With a time-out, which the driver does not have, the wheels are stopped when commands stay away.

#include "base_client.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

TEST(CommandTimeout, stops_the_base_and_says_so) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  base.reset();
  base.command(twist(0.4, 0, 0));
  base.idle(499);  // which name no wheel: they do not count
  base.settle();
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3);
  base.idle(501);
  base.settle();
  EXPECT_NEAR(base.odometry.twist.twist.linear.x, 0, 0.02);
  log.expect(base, rosgraph_msgs::Log::WARN, {"no command for 0.5 s", "stopped"});

  base.command(twist(0.4, 0, 0));
  base.idle(400);
  base.settle();
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3) << "the next command moves it again";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
