// Encoders that slip or are noisy mislead odometry and joint states, and not ground truth.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

TEST(EncoderFaults, slipping_encoder_bends_the_odometry) {
  BaseClient& base = BaseClient::fresh();
  SetFaults::Request faults;
  faults.encoder_slip[0] = faults.encoder_slip[2] = 0.2;  // on the left
  base.set_faults(faults);
  base.command(twist(0.4, 0, 0));
  base.idle(999);
  base.settle();
  EXPECT_NEAR(heading(base.truth.pose.pose.orientation), 0, 0.05);
  EXPECT_NEAR(base.joints.position[0], 0.8 * base.joints.position[1], 0.05 * base.joints.position[1]);
  // A fifth of what the left wheels rolled, over the width that the driver reckons with.
  const double rolled = 0.0475 * base.joints.position[1];
  EXPECT_NEAR(heading(base.odometry.pose.pose.orientation), 0.2 * rolled / (2 * 0.385), 0.1 * rolled);
}

TEST(EncoderFaults, noise_is_on_readings_alone) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Zero(), {}));
  SetFaults::Request faults;
  faults.encoder_noise = 0.01;
  base.set_faults(faults);
  double most = 0;
  for (int k = 0; k < 100; ++k) {
    base.idle(1);
    base.settle();
    most = std::max(most, std::abs(base.joints.position[3]));
  }
  // The largest of 100 normal deviates is between 1.5 and 5 deviations, but for once in 10^4 runs; and each run has the
  // same.
  EXPECT_GT(most, 0.015);
  EXPECT_LT(most, 0.05);
  EXPECT_NEAR(base.truth.pose.pose.position.x, 0, 1e-9);
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
