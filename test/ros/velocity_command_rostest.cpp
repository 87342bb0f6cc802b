// Wheel rates commanded over the topic are kept by the wheels' velocity loop.

#include "base_client.h"
#include "youbot_base_sim/drive/motor.h"
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
  constexpr int kLooks = 400, kSettled = 200, kPeriods = 10;
  Wheels mean = Wheels::Zero();
  for (int k = 0; k < kLooks; ++k) {
    for (int period = 0; period < kPeriods; ++period) base.command(velocity_message(rates, base.clock()));
    base.settle();
    for (int i = 0; i < kWheels; ++i) {
      EXPECT_LE(std::abs(base.joints.effort[i]), Motor().max_torque());
      if (k >= kSettled) mean[i] += base.joints.velocity[i] / (kLooks - kSettled);
    }
  }
  // While rollers pass, the torque that it takes goes up and down by some 0.3 N m, and the integral with it.
  const double tolerance = 0.3 / VelocityGains().integral / (1e-3 * kPeriods * (kLooks - kSettled));
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(mean[i], rates[i], tolerance) << kWheelNames[i];
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
