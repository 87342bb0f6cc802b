// Commands to torque: the wheels' motors, their loops and limits, and the torque programmes.

#include <gtest/gtest.h>

#include <cmath>

#include "youbot_base_sim/drive/torque_programmes.h"
#include "youbot_base_sim/drive/wheel_drive.h"

namespace youbot_base_sim {
namespace {

TEST(WheelDriveTest, HoldsAndClipsTorques) {
  WheelDrive drive(1e-3);
  EXPECT_TRUE(drive.command_torque(0, 1.5));
  EXPECT_FALSE(drive.command_torque(1, -1e6));
  const Wheels torque = drive.sample(Wheels::Zero());
  EXPECT_EQ(torque[0], 1.5);
  EXPECT_EQ(torque[1], -MotorLimits().torque);
  EXPECT_EQ(torque[2], 0);  // never commanded: released
}

TEST(WheelDriveTest, VelocityLoopIsThePiThatItSays) {
  const VelocityGains gains;
  WheelDrive drive(1e-3);
  drive.command_velocity(2, 1);
  const double dphi = 0.5;
  for (int k = 1; k <= 10; ++k) {
    const Wheels torque = drive.sample(Wheels::Constant(dphi));
    EXPECT_NEAR(torque[2], gains.proportional * 0.5 + gains.integral * 1e-3 * k * 0.5, 1e-14);
  }
}

TEST(WheelDriveTest, SetPointIsLimitedToTheMotorsSpeed) {
  WheelDrive drive(1e-3);
  EXPECT_FALSE(drive.command_velocity(0, 100));
  EXPECT_NEAR(drive.sample(Wheels::Constant(MotorLimits().rate))[0], 0, 1e-12);
}

TEST(WheelDriveTest, IntegralDoesNotWindUp) {
  WheelDrive drive(1e-3);
  drive.command_velocity(0, 10);
  for (int k = 0; k < 10000; ++k) EXPECT_LE(drive.sample(Wheels::Zero())[0], MotorLimits().torque);  // a blocked wheel
  // Freed and too fast, it is braked within a few periods, not after ten seconds' worth of integral.
  EXPECT_LT(drive.sample(Wheels::Constant(14))[0], 0);
}

TEST(WheelDriveTest, ReleasedWheelHasNoTorque) {
  WheelDrive drive(1e-3);
  drive.command_torque(3, 1);
  drive.release(3);
  EXPECT_EQ(drive.sample(Wheels::Constant(5))[3], 0);
}

TEST(TorqueProgrammesTest, PieceHoldsToItsEndAndBeyond) {
  TorquePiece first, second;
  first.constant << 1, 1, 1, 1;
  second.start = 2;
  second.cos << 3, 3, 3, 3;
  second.period = 4;
  PiecewiseTorque torque({first, second});
  EXPECT_EQ(torque.enter(-1), 0);
  EXPECT_EQ(torque.at(0)[0], 0);  // before the first piece
  EXPECT_EQ(torque.enter(0), 2);
  EXPECT_EQ(torque.at(2)[0], 1);
  EXPECT_TRUE(std::isinf(torque.enter(2)));
  EXPECT_NEAR(torque.at(2)[0], -3, 1e-12);  // t counts from zero, not from the piece's start
  EXPECT_NEAR(torque.rate(3)[0], 3 * M_PI / 2, 1e-12);
}

TEST(TorqueProgrammesTest, ReferenceMotionsDerivativesAreItsOwn) {
  const ReferenceMotion motion{5, {0.1, 0.2, 0.3}, {-0.4, 0.5, 0}, {0, 0, 0.7}};
  constexpr double t = 1.234, dt = 1e-5;
  // Central differences: their error is dt^2 times third derivatives of about 2, and rounding of 1e-16 / dt.
  EXPECT_LT((motion.acceleration(t) - (motion.velocity(t + dt) - motion.velocity(t - dt)) / (2 * dt)).norm(), 1e-9);
  EXPECT_LT((motion.jerk(t) - (motion.acceleration(t + dt) - motion.acceleration(t - dt)) / (2 * dt)).norm(), 1e-9);
}

}  // namespace
}  // namespace youbot_base_sim
