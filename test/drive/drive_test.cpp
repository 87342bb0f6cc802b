// From commands to torques: motors with their limits, velocity loops, dry friction, torque profiles.

#include <gtest/gtest.h>

#include <cmath>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/drive/torque_profiles.h"

namespace youbot_base_sim {
namespace {

constexpr SetPoint torque(double value) { return {DriveMode::kTorque, value}; }
constexpr SetPoint velocity(double value) { return {DriveMode::kVelocity, value}; }

// Expected numbers were worked out by hand from the configuration files of the driver and of the firmware.
TEST(MotorTest, HasTheUnitsOfTheDriver) {
  const Motor motor;
  EXPECT_NEAR(motor.tick(), 6.0794e-5, 1e-9);
  EXPECT_NEAR(motor.rpm(), 4.05295e-3, 1e-8);
  EXPECT_NEAR(motor.milliampere(), 8.6557e-4, 1e-8);
  EXPECT_NEAR(motor.max_torque(), 3.0849, 1e-4);
  EXPECT_NEAR(motor.max_rate(), 16.2118, 1e-4);
}

TEST(MotorTest, TransmissionTruncatesCurrentAndRoundsSpeed) {
  const Motor motor;
  const double mA = motor.milliampere(), rpm = motor.rpm();
  EXPECT_EQ(motor.transmitted(torque(2.9 * mA)).value, 2 * mA);
  EXPECT_EQ(motor.transmitted(torque(-2.9 * mA)).value, -2 * mA);
  EXPECT_EQ(motor.transmitted(torque(motor.max_torque())).value, 3564 * mA);
  EXPECT_EQ(motor.transmitted(velocity(2.6 * rpm)).value, 3 * rpm);
  EXPECT_EQ(motor.transmitted(velocity(-2.4 * rpm)).value, -2 * rpm);
}

TEST(MotorTest, ClampsHugeSetPoints) {
  const Motor motor;
  EXPECT_EQ(motor.transmitted(motor.limited(velocity(1e300))).value, motor.max_rate());
  EXPECT_EQ(motor.limited(torque(-1e300)).value, -motor.max_torque());
  EXPECT_FALSE(motor.can(torque(1e300)));
  EXPECT_TRUE(motor.can(torque(3.0)));
}

TEST(WheelDriveTest, HoldsAndClampsTorques) {
  WheelDrive drive(1e-3);
  drive.command(0, torque(1.5));
  drive.command(1, torque(-1e6));
  const Wheels sampled = drive.sample(Wheels::Zero());
  EXPECT_EQ(sampled[0], 1.5);
  EXPECT_EQ(sampled[1], -Motor().max_torque());
  EXPECT_EQ(sampled[2], 0);  // never commanded: off
}

TEST(WheelDriveTest, VelocityLoopIsAPiController) {
  const VelocityGains gains;
  WheelDrive drive(1e-3);
  drive.command(2, velocity(1));
  const double dphi = 0.5;
  for (int k = 1; k <= 10; ++k) {
    const Wheels sampled = drive.sample(Wheels::Constant(dphi));
    EXPECT_NEAR(sampled[2], gains.proportional * 0.5 + gains.integral * 1e-3 * k * 0.5, 1e-14);
  }
}

TEST(WheelDriveTest, SetPointIsLimitedToTheMotorsSpeed) {
  WheelDrive drive(1e-3);
  drive.command(0, velocity(100));
  EXPECT_NEAR(drive.sample(Wheels::Constant(Motor().max_rate()))[0], 0, 1e-12);
}

// A blocked wheel takes the motor to its limit. The integral then is what the proportional part leaves to the limit,
// not ten seconds of error, which would be 60 N m; and it falls as soon as the wheel is too fast.
TEST(WheelDriveTest, IntegralDoesNotWindUp) {
  const VelocityGains gains;
  const double max = Motor().max_torque(), rate = 5, left = max - gains.proportional * rate;
  for (const double sign : {1.0, -1.0}) {
    WheelDrive drive(1e-3);
    drive.command(0, velocity(sign * rate));
    double torque = 0;
    for (int k = 0; k < 10000; ++k) torque = drive.sample(Wheels::Zero())[0];
    EXPECT_EQ(torque, sign * max);
    EXPECT_NEAR(drive.sample(Wheels::Constant(sign * rate))[0], sign * left, gains.integral * 1e-3 * rate);
    EXPECT_LT(sign * drive.sample(Wheels::Constant(sign * 2 * rate))[0], left - gains.proportional * rate);
  }
}

// What holds a wheel against friction is not lost where another rate is wanted, nor at a stop.
TEST(WheelDriveTest, IntegralOutlivesAChangeOfRate) {
  WheelDrive drive(1e-3);
  drive.command(1, velocity(2));
  double torque = 0;
  for (int k = 0; k < 1000; ++k) torque = drive.sample(Wheels::Constant(1.9))[1];
  const double integral = torque - VelocityGains().proportional * 0.1;
  EXPECT_NEAR(integral, VelocityGains().integral * 0.1, 1e-12);
  drive.command(1, velocity(0));
  EXPECT_NEAR(drive.sample(Wheels::Zero())[1], integral, 1e-12);
}

TEST(WheelDriveTest, IntegralStartsFromZeroWithTheMode) {
  WheelDrive drive(1e-3);
  for (const SetPoint& between : {torque(1), SetPoint()}) {
    drive.command(1, velocity(2));
    for (int k = 0; k < 1000; ++k) drive.sample(Wheels::Constant(1));
    drive.command(1, between);
    drive.sample(Wheels::Constant(1));
    drive.command(1, velocity(2));
    EXPECT_EQ(drive.sample(Wheels::Constant(2))[1], 0);
  }
}

TEST(WheelDriveTest, ObeysItsOwnLimitsAndResolution) {
  MotorSettings settings;
  settings.max_wheel_torque = 2.5;
  settings.max_wheel_rate = 8;
  const Motor motor = settings.limit(Motor());
  EXPECT_NEAR(motor.max_torque(), 2.5, 1e-12);
  EXPECT_NEAR(motor.max_rate(), 8, 1e-12);
  WheelDrive drive(1e-3, motor, settings.gains, true);
  drive.command(0, torque(-3));
  drive.command(1, velocity(9));
  EXPECT_NEAR(drive.set_points()[0].value, -2.5, motor.milliampere());
  EXPECT_EQ(drive.set_points()[0].value, motor.transmitted(torque(-2.5)).value);
  EXPECT_EQ(drive.set_points()[1].value, motor.transmitted(velocity(8)).value);
}

TEST(WheelDriveTest, MotorThatIsOffExertsNoTorque) {
  WheelDrive drive(1e-3);
  drive.command(3, torque(1));
  drive.command(3, {});
  EXPECT_EQ(drive.sample(Wheels::Constant(5))[3], 0);
}

TEST(TorqueProfileTest, SegmentHoldsUntilTheNextIsBegun) {
  TorqueSegment first, second;
  first.constant << 1, 1, 1, 1;
  second.start = 2;
  second.cos << 3, 3, 3, 3;
  second.period = 4;
  PiecewiseTorque torque({first, second});
  EXPECT_EQ(torque.begin_segment(-1), 0);
  EXPECT_EQ(torque.value(0)[0], 0);  // before the first segment
  EXPECT_EQ(torque.begin_segment(0), 2);
  EXPECT_EQ(torque.value(2)[0], 1);
  EXPECT_TRUE(std::isinf(torque.begin_segment(2)));
  EXPECT_NEAR(torque.value(2)[0], -3, 1e-12);  // t counts from zero, not from the segment's start
}

TEST(ReferenceMotionTest, AccelerationIsItsDerivative) {
  const ReferenceMotion motion{5, {0.1, 0.2, 0.3}, {-0.4, 0.5, 0}, {0, 0, 0.7}};
  constexpr double t = 1.234, dt = 1e-5;
  // Central differences err by dt^2 times third derivatives of about 2, and by rounding of 1e-16 / dt.
  EXPECT_LT((motion.acceleration(t) - (motion.velocity(t + dt) - motion.velocity(t - dt)) / (2 * dt)).norm(), 1e-9);
}

}  // namespace
}  // namespace youbot_base_sim
