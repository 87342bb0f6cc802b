// What goes over EtherCAT counts in encoder ticks, motor rpm and mA, and odometry is made of nothing else.

#include "base_client.h"

namespace youbot_base_sim {
namespace {

// Worked out from the driver's configuration file: 4000 ticks a turn, gear 364/9405, 0.0335 N m/A.
constexpr double kGear = 364.0 / 9405;
constexpr double kTick = 2 * M_PI * kGear / 4000;
constexpr double kRpm = 2 * M_PI * kGear / 60;
constexpr double kMilliampere = 1e-3 * 0.0335 / kGear;

void expect_whole(double value, double unit, const char* what) {
  EXPECT_NEAR(value / unit, std::round(value / unit), 1e-6) << what << " " << value;
}

TEST(Quantized, readings_are_whole_numbers) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.3, 0.1, 0.2));
  double x = 0;
  std::size_t moved = 0;
  for (int k = 0; k < 300; ++k) {
    base.idle(1);
    base.settle();
    for (int i = 0; i < kWheels; ++i) {
      expect_whole(base.joints.position[i], kTick, "position");
      expect_whole(base.joints.velocity[i], kRpm, "velocity");
      expect_whole(base.joints.effort[i], kMilliampere, "effort");
    }
    double sum = 0;
    for (int i = 0; i < kWheels; ++i) sum += base.joints.velocity[i];
    EXPECT_NEAR(base.odometry.twist.twist.linear.x, 0.0475 / 4 * sum, 1e-12) << "from the measured rates";
    moved += base.odometry.pose.pose.position.x != x;
    x = base.odometry.pose.pose.position.x;
  }
  EXPECT_GT(moved, 200u);
  EXPECT_GT(x, 0.03);
}

TEST(Quantized, torques_arrive_in_milliamperes) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message({1, -1, 0.0005, 1155 * kMilliampere}, {}));
  base.settle();
  // 1 N m is 1155.3 mA, 0.0005 N m is 0.6 mA, and the driver cuts.
  const double expected[] = {1155, -1155, 0, 1155};
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.effort[i], expected[i] * kMilliampere, 1e-12) << i;
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
