// The driver and its motors without ROS: commands, switching on and off, time-outs and faults.

#include "youbot_base_sim/drive/base_driver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "youbot_base_sim/sensors/motor_sensors.h"

namespace youbot_base_sim {
namespace {

constexpr double kPeriod = 1e-3;

DriveCommand all(DriveMode mode, double value) {
  DriveCommand command;
  command.fill(SetPoint{mode, value});
  return command;
}

DriveCommand one(int i, DriveMode mode, double value) {
  DriveCommand command;
  command[i] = SetPoint{mode, value};
  return command;
}

BaseDriver::Settings exact() {
  BaseDriver::Settings settings;
  settings.motors.quantized = false;
  return settings;
}

/// Samples a driver once a control period, with wheels at rest.
class BaseDriverTest : public ::testing::Test {
 protected:
  /// Advances to time t and returns the torque of the last control period.
  Wheels run_to(double t) {
    Wheels torque = Wheels::Zero();
    for (; periods_ * kPeriod < t - 1e-9; ++periods_) torque = driver_.sample(periods_ * kPeriod, dphi_);
    return torque;
  }
  double now() const { return periods_ * kPeriod; }

  void expect_torque(double expected) {
    const Wheels torque = run_to(now() + kPeriod);
    for (int i = 0; i < kWheels; ++i) EXPECT_EQ(torque[i], expected) << i;
  }

  /// The encoders and current sensors of its motors.
  const MotorReadings& read(const Wheels& phi, const Wheels& dphi) {
    return sensors_.read(phi, dphi, driver_.torque(), driver_.faults());
  }

  BaseDriver driver_{exact()};
  MotorSensors sensors_{Motor(), false, Wheels::Zero()};
  Wheels dphi_ = Wheels::Zero();
  int periods_ = 0;
};

TEST_F(BaseDriverTest, HoldsTheWheelsAtRestAtFirst) {
  EXPECT_TRUE(driver_.present());
  EXPECT_TRUE(driver_.motors_on());
  expect_torque(0);
  dphi_ = Wheels::Constant(1);
  const VelocityGains gains;
  EXPECT_NEAR(run_to(0.1).maxCoeff(), -(gains.proportional + gains.integral * 0.099), 1e-12) << "pushes back";
}

TEST_F(BaseDriverTest, HoldsACommandForever) {
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(100);
  expect_torque(1);
}

TEST_F(BaseDriverTest, LastCommandForAWheelHolds) {
  driver_.command(0, all(DriveMode::kVelocity, 3));
  driver_.command(0, all(DriveMode::kTorque, 1));
  driver_.command(0, one(2, DriveMode::kTorque, 2));
  const Wheels torque = run_to(kPeriod);
  EXPECT_TRUE((torque == Wheels(1, 1, 2, 1)).all());
}

TEST_F(BaseDriverTest, MotorsOffExertNothingUntilTheNextCommand) {
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(0.01);
  EXPECT_TRUE(driver_.switch_off());
  dphi_ = Wheels::Constant(3);
  expect_torque(0);
  EXPECT_FALSE(driver_.motors_on());

  driver_.command(now(), all(DriveMode::kTorque, 0.5));
  expect_torque(0.5);
  EXPECT_FALSE(driver_.motors_on()) << "only the services change the flag, as in the driver";

  EXPECT_TRUE(driver_.switch_on());
  EXPECT_TRUE(driver_.motors_on());
  EXPECT_LT(run_to(now() + 0.01).maxCoeff(), -1) << "holds the wheels at rest";
}

TEST_F(BaseDriverTest, StopsWithoutCommandsOnlyWithATimeout) {
  BaseDriver::Settings settings = exact();
  settings.command_timeout = 0.5;
  driver_ = BaseDriver(settings);
  run_to(1);
  EXPECT_FALSE(driver_.timed_out()) << "nothing to stop before the first command";
  driver_.command(now(), all(DriveMode::kTorque, 1));
  EXPECT_EQ(run_to(1.499)[0], 1);
  EXPECT_FALSE(driver_.timed_out());
  run_to(1.501);
  EXPECT_TRUE(driver_.timed_out());
  expect_torque(0);
  EXPECT_EQ(driver_.set_points()[0].mode, DriveMode::kVelocity) << "held at rest";
  driver_.command(now(), all(DriveMode::kTorque, 1));
  expect_torque(1);
  EXPECT_FALSE(driver_.timed_out());
}

TEST_F(BaseDriverTest, TimeoutEndsWhatIsStillOnItsWay) {
  BaseDriver::Settings settings = exact();
  settings.command_timeout = 0.2;
  settings.motors.command_delay = 0.3;
  driver_ = BaseDriver(settings);
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(1);
  EXPECT_TRUE(driver_.timed_out());
  EXPECT_EQ(driver_.set_points()[0].mode, DriveMode::kVelocity) << "held at rest";
}

TEST_F(BaseDriverTest, TimeoutLeavesMotorsOff) {
  BaseDriver::Settings settings = exact();
  settings.command_timeout = 0.5;
  driver_ = BaseDriver(settings);
  driver_.command(0, all(DriveMode::kTorque, 1));
  driver_.switch_off();
  run_to(2);
  EXPECT_EQ(driver_.set_points()[0].mode, DriveMode::kOff);
}

TEST_F(BaseDriverTest, LosesTheBaseAHundredCyclesAfterEthercat) {
  driver_.command(0, all(DriveMode::kTorque, 1));
  read(Wheels::Constant(5), Wheels::Constant(2));
  run_to(1);
  Faults faults;
  faults.ethercat_lost = true;
  driver_.set_faults(now(), faults);
  EXPECT_EQ(run_to(1.05)[0], 1) << "the motors carry on until their time-out";
  driver_.command(now(), all(DriveMode::kTorque, 2));
  EXPECT_EQ(run_to(1.1)[0], 1) << "commands do not reach the motors";
  EXPECT_TRUE(driver_.present());
  EXPECT_EQ(read(Wheels::Constant(9), Wheels::Constant(3)).phi[0], 5) << "readings do not come through";

  run_to(1.102);
  EXPECT_FALSE(driver_.present());
  expect_torque(0);
  EXPECT_FALSE(driver_.switch_on());
  EXPECT_FALSE(driver_.switch_off());
  EXPECT_FALSE(driver_.reconnect()) << "the cable is still unplugged";

  driver_.set_faults(now(), Faults());
  driver_.command(now(), all(DriveMode::kTorque, 1));
  expect_torque(0);
  EXPECT_FALSE(driver_.present()) << "needs a reconnect";
  EXPECT_TRUE(driver_.reconnect());
  EXPECT_TRUE(driver_.present());
  EXPECT_TRUE(driver_.motors_on());
  expect_torque(0);
  EXPECT_EQ(driver_.set_points()[0].mode, DriveMode::kVelocity) << "held at rest";
  EXPECT_EQ(read(Wheels::Constant(9), Wheels::Constant(3)).phi[0], 9) << "encoders keep their counts";
}

TEST_F(BaseDriverTest, ShortInterruptionIsNotNoticed) {
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(1);
  Faults faults;
  faults.ethercat_lost = true;
  driver_.set_faults(now(), faults);
  run_to(1.05);
  driver_.set_faults(now(), Faults());
  run_to(2);
  EXPECT_TRUE(driver_.present());
  expect_torque(1);
}

TEST_F(BaseDriverTest, SilentMotorSwitchesOffAndItsReadingsFreeze) {
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(1);
  read(Wheels::Constant(5), Wheels::Constant(2));
  Faults faults;
  faults.silent[3] = true;
  driver_.set_faults(now(), faults);
  EXPECT_TRUE((run_to(1.1) == Wheels(1, 1, 1, 1)).all());
  EXPECT_TRUE((run_to(1.102) == Wheels(1, 1, 1, 0)).all());
  const MotorReadings& readings = read(Wheels::Constant(6), Wheels::Constant(4));
  EXPECT_TRUE((readings.phi == Wheels(6, 6, 6, 5)).all());
  EXPECT_TRUE((readings.dphi == Wheels(4, 4, 4, 2)).all());
  EXPECT_TRUE(driver_.present());
  // The driver repeats the last set point in every cycle.
  driver_.set_faults(now(), Faults());
  expect_torque(1);
}

TEST_F(BaseDriverTest, DelayedCommandsTakeEffectInOrder) {
  Faults faults;
  faults.command_delay = 0.02;
  driver_.set_faults(0, faults);
  driver_.command(0, all(DriveMode::kTorque, 1));
  run_to(0.01);
  driver_.command(now(), all(DriveMode::kTorque, 2));
  EXPECT_EQ(run_to(0.02)[0], 0);
  EXPECT_EQ(run_to(0.021)[0], 1);
  EXPECT_EQ(run_to(0.03)[0], 1);
  EXPECT_EQ(run_to(0.031)[0], 2);
}

TEST_F(BaseDriverTest, DelayOfItsOwnAddsToThatOfAFault) {
  BaseDriver::Settings settings = exact();
  settings.motors.command_delay = 0.05;
  driver_ = BaseDriver(settings);
  driver_.command(0, all(DriveMode::kTorque, 1));
  EXPECT_EQ(run_to(0.05)[0], 0);
  EXPECT_EQ(run_to(0.051)[0], 1);
  Faults faults;
  faults.command_delay = 0.02;
  driver_.set_faults(now(), faults);
  driver_.command(now(), all(DriveMode::kTorque, 2));
  EXPECT_EQ(run_to(0.121)[0], 1);
  EXPECT_EQ(run_to(0.122)[0], 2);
}

TEST_F(BaseDriverTest, EthercatQuantizesSetPointsAndReadings) {
  driver_ = BaseDriver(BaseDriver::Settings());
  sensors_ = MotorSensors(Motor(), true, Wheels::Zero());
  const Motor motor;
  driver_.command(0, all(DriveMode::kTorque, 1));
  const double torque = run_to(kPeriod)[0];
  EXPECT_EQ(torque, std::trunc(1 / motor.milliampere()) * motor.milliampere());
  const MotorReadings& readings = read(Wheels::Constant(1), Wheels::Constant(-1));
  EXPECT_NEAR(readings.phi[0] / motor.tick(), 16449, 1e-6);  // 16448.96 ticks
  EXPECT_NEAR(readings.dphi[0] / motor.rpm(), -247, 1e-9);   // 246.7 rpm
  EXPECT_NEAR(readings.torque[0] / motor.milliampere(), 1155, 1e-9);
}

TEST(MotorSensorsTest, SlippingEncoderMissesItsShare) {
  MotorSensors sensors(Motor(), false, Wheels::Constant(1));
  Faults faults;
  faults.encoder_slip[1] = 0.25;
  EXPECT_EQ(sensors.read(Wheels::Constant(1), Wheels::Zero(), Wheels::Zero(), faults).phi[1], 1);
  const MotorReadings slipped = sensors.read(Wheels::Constant(5), Wheels::Constant(8), Wheels::Zero(), faults);
  EXPECT_NEAR(slipped.phi[0], 5, 1e-15);
  EXPECT_NEAR(slipped.phi[1], 4, 1e-15);
  EXPECT_NEAR(slipped.dphi[1], 6, 1e-15);
  const MotorReadings& repaired = sensors.read(Wheels::Constant(6), Wheels::Constant(8), Wheels::Zero());
  EXPECT_NEAR(repaired.phi[1], 5, 1e-15) << "the angle that was missed stays missed";
  EXPECT_EQ(repaired.dphi[1], 8);
}

TEST(MotorSensorsTest, NoiseHasItsStandardDeviation) {
  constexpr int kReadings = 4000;
  MotorSensors sensors(Motor(), false, Wheels::Zero());
  Faults faults;
  faults.encoder_noise = 1e-3;
  double sum = 0, squares = 0;
  for (int k = 0; k < kReadings; ++k) {
    const double phi = sensors.read(Wheels::Zero(), Wheels::Zero(), Wheels::Zero(), faults).phi[2];
    sum += phi;
    squares += phi * phi;
  }
  // Within five standard errors of the mean and of the standard deviation.
  EXPECT_NEAR(sum / kReadings, 0, 5 * 1e-3 / std::sqrt(kReadings));
  EXPECT_NEAR(std::sqrt(squares / kReadings), 1e-3, 5 * 1e-3 / std::sqrt(2.0 * kReadings));
}

}  // namespace
}  // namespace youbot_base_sim
