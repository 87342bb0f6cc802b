// When EtherCAT is lost, the base is gone until it is reconnected, as with the driver.

#include "base_client.h"
#include "log.h"
#include "program.h"

namespace youbot_base_sim {
namespace {

TEST(EthercatLoss, takes_the_base_away_until_reconnect) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  base.reset();
  base.command(twist(0.4, 0, 0));
  base.idle(499);
  base.settle();
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.1);

  SetFaults::Request lost;
  lost.ethercat_lost = true;
  base.set_faults(lost);
  base.idle(200);
  base.settle_truth();
  log.expect(base, rosgraph_msgs::Log::WARN, {"EtherCAT is lost"});
  // What the driver publishes ends with the hundredth cycle; ground truth does not.
  EXPECT_NEAR(time_of(base.odometry.header.stamp), 0.6, 0.0021);
  EXPECT_NEAR(time_of(base.joints.header.stamp), 0.6, 0.0021);
  EXPECT_NEAR(time_of(base.tf.header.stamp), 0.6, 0.0021);
  EXPECT_EQ(base.time(), 0.7);
  // The wheels turn freely.
  const double v = base.truth.twist.twist.linear.x;
  EXPECT_GT(v, 0.1);

  base.command(twist(-0.4, 0, 0));
  log.expect(base, rosgraph_msgs::Log::ERROR, {"No base initialized!"});
  EXPECT_FALSE(base.call("base/switchOnMotors"));
  EXPECT_FALSE(base.call("base/switchOffMotors"));
  Program call("/usr/bin/env", {"rosservice", "call", "/base/switchOnMotors"});
  EXPECT_NE(call.wait(), 0);
  EXPECT_NE(call.err().find("No base initialized!"), std::string::npos) << "the caller: " << call.err();

  EXPECT_TRUE(base.call("reconnect")) << "answers true in any case";
  log.expect(base, rosgraph_msgs::Log::ERROR, {"could not be initialized"});
  base.set_faults({});
  base.idle(10);
  base.settle_truth();
  EXPECT_LT(time_of(base.odometry.header.stamp), 0.61) << "it takes a reconnect";

  EXPECT_TRUE(base.call("reconnect"));
  base.idle(1);
  base.settle();
  EXPECT_NEAR(base.odometry.pose.pose.position.x, 0, 1e-3) << "odometry starts again";
  EXPECT_GT(base.joints.position[0], 2.0) << "encoders do not";
  base.idle(500);
  base.settle();
  EXPECT_NEAR(base.truth.twist.twist.linear.x, 0, 0.02) << "the wheels are kept at rest";
  base.command(twist(0.4, 0, 0));
  base.idle(300);
  base.settle();
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
