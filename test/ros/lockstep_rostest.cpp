// Simulated time waits, as fast as it can, for an ordinary node: a loop at 50 Hz that reads the latest odometry,
// commands and sleeps.

#include <ros/rate.h>

#include <algorithm>
#include <vector>

#include "base_client.h"
#include "log.h"

namespace youbot_base_sim {
namespace {

constexpr double kPeriod = 0.02;  // s

/// Where the base was each time that the loop looked, from when it went to 0.27 m ahead.
std::vector<double> drive_ahead(BaseClient& base) {
  ros::NodeHandle node;
  const ros::Publisher commands = node.advertise<geometry_msgs::Twist>(kTwistTopic, 1);
  base.wait_for("the base to listen", [&] { return commands.getNumSubscribers() > 0; });
  std::vector<double> seen;
  ros::Rate rate(1 / kPeriod);
  for (double x = 0; ros::ok() && x < 0.27 && seen.size() < 1000; x = base.odometry.pose.pose.position.x) {
    const double truth = base.truth.pose.pose.position.x;
    if (truth != 0) seen.insert(seen.end(), {x, truth});
    commands.publish(twist(std::min(0.5, 2 * (0.3 - x)), 0, 0));
    rate.sleep();
    ros::spinOnce();
  }
  return seen;
}

TEST(Lockstep, a_closed_loop_is_the_same_to_the_bit_in_ten_runs) {
  const std::vector<double> expected = drive_ahead(BaseClient::fresh());
  EXPECT_GT(expected.size(), 80u);
  EXPECT_LT(expected.size(), 300u) << "a command for each period";
  EXPECT_NEAR(expected.back(), 0.28, 0.02);
  for (int run = 1; run < 10; ++run) EXPECT_EQ(drive_ahead(BaseClient::fresh()), expected) << run;
}

TEST(Lockstep, clock_goes_on_before_the_first_command_and_the_base_does_not) {
  BaseClient& base = BaseClient::fresh();
  base.wait_for("the clock to go on", [&] { return base.time() > 2 * kPeriod; });
  base.settle();
  EXPECT_EQ(base.truth.header.stamp, base.clock());
  base.send(torque_message({1, 1, 1, 1}, {}));
  const ros::Time sent = base.clock();
  base.wait_for("the base to go", [&] { return base.truth.twist.twist.linear.x > 0; });
  base.settle();
  // v < a t, with the torques on 30 kg or more.
  EXPECT_LT(base.truth.twist.twist.linear.x, 4 / 0.05 / 30 * ((base.clock() - sent).toSec() + kPeriod));
}

// The command is forgotten with all else: a reset that comes while the node waits for its followers to rest does not
// begin the simulation with it.
TEST(Lockstep, reset_forgets_a_command_that_has_just_come) {
  BaseClient& base = BaseClient::fresh();
  for (int k = 0; k < 5; ++k) {
    base.send(torque_message({1, 1, 1, 1}, {}));
    base.reset();
  }
  base.wait_for("the clock to go on", [&] { return base.time() > 2 * kPeriod; });
  base.pause();
  Step step;
  EXPECT_TRUE(ros::service::call("base_node/step", step));
  EXPECT_EQ(step.response.t, 0) << "nothing was simulated";
  base.unpause();
}

TEST(Lockstep, continues_by_the_wall_clock_without_commands_and_says_so) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  base.command(twist(0.1, 0, 0));
  const ros::Time commanded = base.clock();
  base.wait_for("time to go on", [&] { return base.clock() > commanded + ros::Duration(5 * kPeriod); });
  log.expect(base, rosgraph_msgs::Log::WARN, {"lockstep: no command for 1 s", "time goes on"});
  base.settle();
  EXPECT_GT(base.truth.twist.twist.linear.x, 0.01) << "the last command holds";
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
