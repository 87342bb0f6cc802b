// base/switchOffMotors lets the wheels turn freely, the next command energises them, base/switchOnMotors keeps them at
// rest.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

class MotorServices : public ::testing::Test {
 protected:
  void SetUp() override {
    base_.command(twist(0.4, 0, 0));
    base_.idle(499);
    base_.settle();
    EXPECT_GT(base_.truth.twist.twist.linear.x, 0.35);
  }

  BaseClient& base_ = BaseClient::fresh();
};

TEST_F(MotorServices, off_means_free_wheels) {
  EXPECT_TRUE(base_.call("base/switchOffMotors"));
  base_.idle(200);
  base_.settle();
  for (int i = 0; i < kWheels; ++i) EXPECT_EQ(base_.joints.effort[i], 0) << kWheelNames[i];
  // Bearings alone, 0.11 N m s/rad a wheel, brake 36 kg with a time constant of 0.2 s: exp(-1).
  EXPECT_GT(base_.truth.twist.twist.linear.x, 0.1);
}

TEST_F(MotorServices, next_command_energises) {
  EXPECT_TRUE(base_.call("base/switchOffMotors"));
  base_.idle(200);
  base_.command(twist(0.4, 0, 0));
  base_.idle(500);
  base_.settle();
  EXPECT_GT(base_.truth.twist.twist.linear.x, 0.35);
}

TEST_F(MotorServices, on_means_at_rest) {
  EXPECT_TRUE(base_.call("base/switchOnMotors"));
  base_.idle(500);
  base_.settle();
  EXPECT_NEAR(base_.truth.twist.twist.linear.x, 0, 0.01);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
