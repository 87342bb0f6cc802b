// The inertial unit.

#include "youbot_base_sim/sensors/imu.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "youbot_base_sim/sensors/normal_noise.h"

namespace youbot_base_sim {
namespace {

const ImuSettings kExact{{}, {}, {0, 0, 0}};

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
  settings.rate.bias = settings.acceleration.bias = 0;
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
  settings.rate.bias = 0.01;
  Imu biased(settings, FloorParameters(), 0, State());
  for (int k = 1; k <= 1000; ++k) biased.update(0.02 * k, State());
  EXPECT_NEAR(biased.heading(), 0.2, 0.01);
  EXPECT_GT(std::sqrt(biased.heading_variance()), 0.2);
}

// The same unit read twenty times as often has noisier readings, and a heading as certain.
TEST(ImuTest, NoiseOfADensityDependsOnTheInterval) {
  for (const double interval : {0.05, 0.0025}) {
    ImuSettings settings = kExact;
    settings.rate.density = 1e-3;
    settings.acceleration.density = 0.01;
    const int readings = static_cast<int>(std::lround(100 / interval));
    Imu imu(settings, FloorParameters(), 0, State());
    double rate = 0, acceleration = 0;
    for (int k = 1; k <= readings; ++k) {
      imu.update(interval * k, State());
      rate += imu.rate() * imu.rate() / readings;
      acceleration += imu.acceleration()[1] * imu.acceleration()[1] / readings;
    }
    EXPECT_NEAR(rate * interval / 1e-6, 1, 0.1);
    EXPECT_NEAR(acceleration * interval / 1e-4, 1, 0.1);
    EXPECT_NEAR(imu.heading_variance(), 1e-6 * 100, 1e-12);  // that of a random walk: density^2 t
  }
}

// Over many units: the bias has the variance walk^2 t, and the heading walk^2 t^3 / 3. Each unit has a fixed seed, so
// one long walk is cut into pieces.
TEST(ImuTest, BiasesWalk) {
  ImuSettings settings = kExact;
  settings.rate.walk = 1e-3;
  Imu imu(settings, FloorParameters(), 0, State());
  constexpr int kPieces = 2000, kReadings = 50;
  constexpr double kInterval = 0.1, kPiece = kReadings * kInterval;
  double bias = 0, heading = 0;
  for (int k = 0; k < kPieces; ++k) {
    const double heading_before = imu.heading();
    imu.update(kInterval * (k * kReadings + 1), State());
    const double rate_before = imu.rate();
    for (int j = 1; j < kReadings; ++j) imu.update(kInterval * (k * kReadings + j + 1), State());
    bias += std::pow(imu.rate() - rate_before, 2) / kPieces;
    heading += std::pow(imu.heading() - heading_before - rate_before * kPiece, 2) / kPieces;
  }
  EXPECT_NEAR(bias / (1e-6 * (kPiece - kInterval)), 1, 0.1);
  EXPECT_NEAR(heading / (1e-6 * std::pow(kPiece, 3) / 3), 1, 0.1);
  EXPECT_NEAR(imu.rate_variance(), 1e-6 * kPieces * kPiece, 1e-9);
}

// Behind the centre of a turn on the spot it reads the pull away from it; a turn that speeds up, the pull along.
TEST(ImuTest, ReadsTheAccelerationOfItsPlace) {
  ImuSettings settings = kExact;
  settings.position = {0.3, -0.1, 0.2};
  constexpr double kAlpha = 0.5;  // rad/s^2
  const auto turning = [](double t) {
    State state;
    state.psi() = 0.5 * kAlpha * t * t;
    state.Omega() = kAlpha * t;
    return state;
  };
  Imu imu(settings, FloorParameters(), 0, turning(0));
  imu.update(1.999, turning(1.999));
  imu.update(2.001, turning(2.001));
  const double Omega = 2 * kAlpha;  // in the middle
  EXPECT_NEAR(imu.acceleration()[0], -Omega * Omega * 0.3 + kAlpha * 0.1, 1e-6);
  EXPECT_NEAR(imu.acceleration()[1], Omega * Omega * 0.1 + kAlpha * 0.3, 1e-6);
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
