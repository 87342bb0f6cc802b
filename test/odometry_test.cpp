// The driver's kinematics and odometry.

#include <gtest/gtest.h>

#include <cmath>

#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/physics/no_slip_model.h"

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
  RobotParameters robot;
  robot.R = DriverKinematics().wheel_radius;
  robot.R_d = 0.7 * robot.R;
  const Eigen::Vector3d velocity(0.3, -0.2, 0.7);
  const Wheels expected = NoSlipModel(robot).dphi(velocity);
  EXPECT_TRUE(DriverKinematics().wheel_rates(velocity).isApprox(expected, 1e-14));
}

TEST(DriverKinematics, reads_back_what_it_commands) {
  const DriverKinematics kinematics;
  const Eigen::Vector3d velocity(0.3, -0.2, 0.7);
  EXPECT_TRUE(kinematics.velocity(kinematics.wheel_rates(velocity)).isApprox(velocity, 1e-14));
}

TEST(DriverKinematics, sees_no_motion_in_wheels_that_work_against_each_other) {
  EXPECT_LT(DriverKinematics().velocity({1, 1, -1, -1}).norm(), 1e-16);
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

TEST(WheelOdometry, starts_again) {
  WheelOdometry odometry({}, Wheels::Zero());
  odometry.update({1, 1, 1, 1});
  odometry.reset({1, 1, 1, 1});
  EXPECT_EQ(odometry.pose(), Eigen::Vector3d::Zero());
  odometry.update({2, 2, 2, 2});
  EXPECT_NEAR(odometry.pose()[0], DriverKinematics().wheel_radius, 1e-16);
}

}  // namespace
}  // namespace youbot_base_sim
