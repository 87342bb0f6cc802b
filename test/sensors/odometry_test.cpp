// The driver's kinematics and odometry.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/sensors/wheel_odometry.h"

namespace youbot_base_sim {
namespace {

TEST(DriverKinematics, has_the_signs_of_the_urdf) {
  const DriverKinematics kinematics;
  const auto signs = [&](double v_x, double v_y, double omega) {
    return Wheels(kinematics.wheel_rates({v_x, v_y, omega}).sign());
  };
  EXPECT_TRUE((signs(1, 0, 0) == Wheels(1, 1, 1, 1)).all());
  EXPECT_TRUE((signs(0, 1, 0) == Wheels(-1, 1, 1, -1)).all());
  EXPECT_TRUE((signs(0, 0, 1) == Wheels(-1, 1, -1, 1)).all());
}

TEST(DriverKinematics, is_the_no_slip_model_with_another_radius) {
  const DriverKinematics kinematics;
  RobotParameters robot;
  robot.R = kinematics.wheel_radius;
  robot.R_d = 0.7 * robot.R;
  const Eigen::Vector3d velocity(0.3, -0.2, 0.7);
  const Wheels expected = NoSlipModel(robot).dphi(velocity);
  EXPECT_TRUE(kinematics.wheel_rates(velocity).isApprox(expected, 1e-14));
  EXPECT_TRUE(kinematics.velocity(expected).isApprox(velocity, 1e-14));
  EXPECT_LT(kinematics.velocity({1, 1, -1, -1}).norm(), 1e-16) << "wheels that work against each other";
}

TEST(WheelOdometry, starts_at_zero_wherever_the_wheels_stand) {
  const Wheels phi(1, 2, 3, 4);
  WheelOdometry odometry({}, phi);
  odometry.update(phi);
  EXPECT_EQ(odometry.pose(), Eigen::Vector3d::Zero());
}

TEST(WheelOdometry, turns_by_the_new_heading) {
  const DriverKinematics kinematics;
  WheelOdometry odometry(kinematics, Wheels::Zero());
  odometry.update(kinematics.wheel_rates({0.1, 0.2, 0.5}));
  const double c = std::cos(0.5), s = std::sin(0.5);
  EXPECT_NEAR(odometry.pose()[0], 0.1 * c - 0.2 * s, 1e-15);
  EXPECT_NEAR(odometry.pose()[1], 0.1 * s + 0.2 * c, 1e-15);
  EXPECT_NEAR(odometry.pose()[2], 0.5, 1e-15);
}

TEST(WheelOdometry, keeps_count_of_full_turns) {
  const DriverKinematics kinematics;
  WheelOdometry odometry(kinematics, Wheels::Zero());
  for (int k = 1; k <= 100; ++k) odometry.update(k * kinematics.wheel_rates({0, 0, 0.1}));
  EXPECT_NEAR(odometry.pose()[2], 10, 1e-12);
}

// The sine and cosine of the heading go on by small turns: they must stay those of the heading.
TEST(WheelOdometry, small_steps_add_up_to_the_last_digits) {
  const DriverKinematics kinematics;
  WheelOdometry odometry(kinematics, Wheels::Zero());
  Wheels phi = Wheels::Zero();
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();
  double path = 0;
  for (int k = 0; k < 300000; ++k) {
    const double rate = std::sin(1e-3 * k);
    const Wheels before = phi;
    phi += kinematics.wheel_rates({1e-3, 3e-4 * rate, 2e-3 * rate + (k % 1000 == 0 ? 0.5 : 0)});
    const Eigen::Vector3d moved = kinematics.velocity(phi - before);
    odometry.update(phi);
    expected[2] += moved[2];
    expected[0] += std::cos(expected[2]) * moved[0] - std::sin(expected[2]) * moved[1];
    expected[1] += std::sin(expected[2]) * moved[0] + std::cos(expected[2]) * moved[1];
    path += moved.head<2>().norm();
  }
  EXPECT_EQ(odometry.pose()[2], expected[2]);
  EXPECT_LT((odometry.pose() - expected).norm(), 1e-14 * path) << "after " << path << " m";
}

TEST(WheelOdometry, starts_again) {
  WheelOdometry odometry({}, Wheels::Zero());
  odometry.update({1, 1, 1, 1});
  odometry.reset({1, 1, 1, 1});
  EXPECT_EQ(odometry.pose(), Eigen::Vector3d::Zero());
  odometry.update({2, 2, 2, 2});
  EXPECT_NEAR(odometry.pose()[0], DriverKinematics().wheel_radius, 1e-16);
}

TEST(WheelOdometry, has_no_covariance_like_the_driver) {
  WheelOdometry odometry({}, Wheels::Zero());
  odometry.update({1, 2, 3, 4});
  EXPECT_EQ(odometry.pose_covariance(), Eigen::Matrix3d::Zero());
  EXPECT_EQ(odometry.velocity_covariance({1, 2, 3, 4}), Eigen::Matrix3d::Zero());
}

// The covariance is that of many bases whose wheels turn by a factor 1 + a + b, where a is constant for each wheel and
// b is drawn for each turn.
TEST(WheelOdometry, covariance_is_that_of_wheels_with_relative_errors) {
  constexpr double kError = 1e-3;
  constexpr int kBases = 4000, kTurns = 20;
  const Wheels turn = 2 * M_PI * Wheels(1, 0.4, 0.6, 1.2);  // a curve
  std::mt19937 random;
  std::normal_distribution<double> draw(0, kError);
  const auto errors = [&] { return Wheels(draw(random), draw(random), draw(random), draw(random)); };
  WheelOdometry odometry({}, Wheels::Zero(), kError);
  for (int k = 1; k <= 100 * kTurns; ++k) odometry.update(k * turn / 100);
  Eigen::Matrix3d sampled = Eigen::Matrix3d::Zero();
  for (int base = 0; base < kBases; ++base) {
    WheelOdometry other({}, Wheels::Zero());
    const Wheels constant = errors();
    Wheels phi = Wheels::Zero();
    for (int k = 0; k < kTurns; ++k) {
      // The mean of b over n turns of a wheel has a standard deviation of kError / sqrt(n).
      const Wheels changing = errors() / (turn / (2 * M_PI)).sqrt();
      for (int part = 0; part < 10; ++part) {
        phi += (1 + constant + changing) * turn / 10;
        other.update(phi);
      }
    }
    const Eigen::Vector3d d = other.pose() - odometry.pose();
    sampled += d * d.transpose() / kBases;
  }
  // Steps of 36 degrees rather than 3.6 shift the pose by 0.1 %. The variance of 4000 samples has a standard error of
  // 2.2 %.
  const Eigen::Matrix3d predicted = odometry.pose_covariance();
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(predicted(i, i), sampled(i, i), 0.1 * sampled(i, i)) << predicted << "\n" << sampled;
  EXPECT_TRUE(predicted.isApprox(sampled, 0.1)) << predicted << "\n" << sampled;
}

TEST(WheelOdometry, covariance_of_the_velocity_at_rest_is_the_resolution) {
  const WheelOdometry odometry({}, Wheels::Zero(), 0.05);
  const Eigen::Matrix3d covariance = odometry.velocity_covariance(Wheels::Zero());
  // An rpm of the motor, rounded, in each of four wheels: R/4 * rpm * sqrt(4 / 12).
  const double sigma = 0.0475 / 4 * (364.0 / 9405 * 2 * M_PI / 60) / std::sqrt(3.0);
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), sigma, 1e-9);
  EXPECT_NEAR(std::sqrt(covariance(1, 1)), sigma, 1e-9);
  EXPECT_NEAR(std::sqrt(covariance(2, 2)), sigma / 0.385, 1e-9);
  EXPECT_NEAR(covariance(0, 1), 0, 1e-12);
}

}  // namespace
}  // namespace youbot_base_sim
