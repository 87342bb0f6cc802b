// The inertial unit.

#include "youbot_base_sim/drive/imu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "youbot_base_sim/drive/normal_noise.h"

namespace youbot_base_sim {
namespace {

constexpr ImuSettings kExact{0, 0, 0, 0};

/// A state on a circle of 2 m, 0.5 m/s ahead.
State on_circle(double t) {
  State state;
  state.Omega() = 0.25;
  state.psi() = state.Omega() * t;
  state.V_X() = 0.5;
  return state;
}

TEST(ImuTest, ReadsGravityAtRest) {
  EXPECT_TRUE(Imu(kExact, FloorParameters(), 0, State()).acceleration().isApprox(Eigen::Vector3d(0, 0, 9.81)));
  FloorParameters slope;
  slope.slope = 0.1;
  slope.uphill = M_PI / 2;  // to the left: what holds the base pushes it to the left too
  EXPECT_TRUE(Imu(kExact, slope, 0, State())
                  .acceleration()
                  .isApprox(Eigen::Vector3d(0, 9.81 * std::sin(0.1), 9.81 * std::cos(0.1))));
}

TEST(ImuTest, ReadsRateAndCentripetalAccelerationOnACircle) {
  Imu imu(kExact, FloorParameters(), 0, on_circle(0));
  for (int k = 1; k <= 100; ++k) imu.update(0.01 * k, on_circle(0.01 * k));
  EXPECT_NEAR(imu.rate(), 0.25, 1e-12);
  EXPECT_NEAR(imu.heading(), 0.25, 1e-12);
  EXPECT_NEAR(imu.acceleration()[0], 0, 1e-12) << "no acceleration forward, however long the interval";
  EXPECT_NEAR(imu.acceleration()[1], 0.125, 1e-6);
  EXPECT_EQ(imu.heading_variance(), 0);
}

TEST(ImuTest, CountsAKickBetweenTwoReadingsInFull) {
  Imu imu(kExact, FloorParameters(), 0, State());
  State kicked;
  kicked.V_Y() = 0.002;  // within microseconds
  imu.update(0.02, kicked);
  EXPECT_NEAR(imu.acceleration()[1] * 0.02, 0.002, 1e-12);
}

TEST(ImuTest, ErrorsHaveTheirVariances) {
  ImuSettings settings;
  settings.rate_bias = settings.acceleration_bias = 0;
  Imu imu(settings, FloorParameters(), 0, State());
  double rate = 0, acceleration = 0;
  constexpr int kReadings = 10000;
  for (int k = 1; k <= kReadings; ++k) {
    imu.update(0.02 * k, State());
    rate += imu.rate() * imu.rate() / kReadings;
    acceleration += imu.acceleration()[0] * imu.acceleration()[0] / kReadings;
  }
  EXPECT_NEAR(rate / imu.rate_variance(), 1, 0.05);
  EXPECT_NEAR(acceleration / imu.acceleration_variance(), 1, 0.05);
  EXPECT_LT(std::abs(imu.heading()), 3 * std::sqrt(imu.heading_variance()));
  settings.rate_bias = 0.01;
  Imu biased(settings, FloorParameters(), 0, State());
  for (int k = 1; k <= 1000; ++k) biased.update(0.02 * k, State());
  EXPECT_NEAR(biased.heading(), 0.2, 0.01);
  EXPECT_GT(std::sqrt(biased.heading_variance()), 0.2);
}

#ifdef __GLIBCXX__
TEST(NormalNoiseTest, IsThatOfTheStandardLibraryButForRounding) {
  std::mt19937_64 random, same;
  for (int k = 0; k < 10000; ++k) {
    std::normal_distribution<double> expected;
    const Wheels noise = normal_noise(random);
    for (int i = 0; i < kWheels; ++i) ASSERT_NEAR(noise[i], expected(same), 1e-14);
  }
}
#endif

}  // namespace
}  // namespace youbot_base_sim
