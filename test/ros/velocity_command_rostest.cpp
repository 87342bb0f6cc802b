// Wheel rates commanded over the topic are kept by the wheels' velocity loop.

#include "base_client.h"
#include "youbot_base_sim/drive/wheel_drive.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {
namespace {

brics_actuator::JointVelocities velocity_of(int i, double rate) {
  brics_actuator::JointVelocities message = velocity_message(Wheels::Constant(rate), {});
  message.velocities = {message.velocities[i]};
  return message;
}

TEST(VelocityCommand, tracks) {
  BaseClient& base = BaseClient::fresh();
  // Rates that the base can roll with, one for each wheel.
  const Wheels rates = NoSlipModel(RobotParameters()).dphi({0.3, 0.1, 0.2});
  Wheels mean = Wheels::Zero();
  for (int k = 0; k < 1000; ++k) {
    base.command(velocity_message(rates, base.clock()));
    base.settle();
    for (int i = 0; i < kWheels; ++i) {
      EXPECT_LE(std::abs(base.joints.effort[i]), Motor().max_torque());
      if (k >= 500) mean[i] += base.joints.velocity[i] / 500;
    }
  }
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(mean[i], rates[i], 0.01 * std::abs(rates[i])) << kWheelNames[i];
}

TEST(VelocityCommand, for_one_wheel_leaves_the_others) {
  BaseClient& base = BaseClient::fresh();
  const Wheels forward = Wheels::Constant(4);
  base.command(velocity_message(forward, base.clock()));
  for (int k = 0; k < 500; ++k) base.command(velocity_of(1, 4));
  base.settle();
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.velocity[i], 4, 0.2) << kWheelNames[i];
}

TEST(VelocityCommand, is_limited_by_the_motor) {
  BaseClient& base = BaseClient::fresh();
  const Wheels too_fast = Wheels::Constant(100);
  for (int k = 0; k < 20; ++k) base.command(velocity_message(too_fast, base.clock()));
  base.settle();
  for (int i = 0; i < kWheels; ++i) EXPECT_EQ(base.joints.effort[i], Motor().max_torque()) << kWheelNames[i];
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
