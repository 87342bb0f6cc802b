// The node is the master of time: it stands, goes by steps, runs, and starts again, as its services say.

#include <string>
#include <thread>

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(TimeServices, step_and_run_and_reset) {
  BaseClient& base = BaseClient::fresh();
  EXPECT_EQ(base.time(), 0) << "starts paused";

  // Steps, to the period.
  EXPECT_TRUE(base.step(10).success);
  EXPECT_EQ(base.time(), 0.01);
  EXPECT_EQ(base.step(0).t, 0.01);

  // Runs when it is let go, and then refuses steps.
  base.unpause();
  base.wait_for("time to go on", [&] { return base.time() > 0.1; });
  const Step::Response refused = base.step(1);
  EXPECT_FALSE(refused.success);
  EXPECT_NE(refused.message.find("pause"), std::string::npos) << refused.message;

  // Stands when it is told to.
  base.pause();
  const double t = base.step(0).t;
  EXPECT_GT(t, 0.1);
  EXPECT_EQ(base.step(0).t, t);
  EXPECT_NEAR(base.step(1).t, t + 1e-3, 1e-9);

  base.reset();
  EXPECT_EQ(base.step(0).t, 0) << "paused as before";
}

TEST(TimeServices, step_of_any_length_leaves_all_else_served) {
  BaseClient& base = BaseClient::fresh();
  for (const char* ended_by : {"~pause", "~unpause", "~reset"}) {
    Step service;
    service.request.periods = 4000000000;
    std::thread step([&service] { EXPECT_TRUE(ros::service::call("base_node/step", service)); });
    base.wait_for("the step", [&] { return base.time() > 1; });
    EXPECT_TRUE(base.call("base/switchOnMotors"));
    EXPECT_TRUE(base.call("base_node" + std::string(ended_by).replace(0, 1, "/")));
    step.join();
    EXPECT_FALSE(service.response.success);
    EXPECT_EQ(service.response.message, std::string("ended by ") + ended_by);
    EXPECT_GT(service.response.t, 1);
    base.pause();
    base.reset();
  }
}

TEST(TimeServices, reset_forgets_commands_and_odometry) {
  BaseClient& base = BaseClient::fresh();
  base.send(torque_message({1, 1, 1, 1}, {}));
  // Nothing tells when a command has arrived but what it does.
  base.wait_for("the command to act", [&] {
    base.step(100);
    return base.joints.effort[0] == 1;
  });
  base.step(1000);
  EXPECT_GT(base.truth.pose.pose.position.x, 0.01);
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.01);

  base.reset();
  EXPECT_EQ(base.truth.pose.pose.position.x, 0);
  EXPECT_EQ(base.odometry.pose.pose.position.x, 0);
  base.step(100);
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.effort[i], 0, 1e-12) << kWheelNames[i];
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
