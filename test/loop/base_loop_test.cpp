// The node's control loop: requests act in order where control periods begin, and what comes out does not depend on
// how often the sensors are read.

#include "youbot_base_sim/loop/base_loop.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {
namespace {

constexpr double kPeriod = 1e-3;

LoopSettings settings() {
  LoopSettings settings;
  settings.scene.solver.control_period = kPeriod;
  settings.scene.solver.relative_tolerance = 1e-5;
  settings.scene.solver.absolute_tolerance = 1e-8;
  settings.driver.motors.quantized = false;
  return settings;
}

DriveCommand torques(double torque) {
  DriveCommand command;
  command.fill(SetPoint{DriveMode::kTorque, torque});
  return command;
}

DriveCommand rates(const Eigen::Vector3d& velocity) {
  return drive_command(DriveMode::kVelocity, DriverKinematics().wheel_rates(velocity));
}

Faults cable_out() {
  Faults faults;
  faults.ethercat_lost = true;
  return faults;
}

/// Torque of the first wheel in each of the next n control periods.
std::vector<double> play(BaseLoop& loop, int n) {
  std::vector<double> torque;
  for (int k = 0; k < n; ++k) {
    loop.advance_periods(1);
    torque.push_back(loop.simulation().torque()[0]);
  }
  return torque;
}

TEST(BaseLoopTest, RequestsActFromThePeriodThatBeginsAtTheirArrivalOrLater) {
  BaseLoop loop(settings());
  loop.push(0.0, torques(1));
  loop.push(0.0021, torques(2));
  loop.push(0.004, torques(3));
  EXPECT_EQ(play(loop, 6), (std::vector<double>{1, 1, 1, 2, 3, 3}));
}

Wrench push_sideways(double force) {
  Wrench wrench;
  wrench.force = {0, force, 0};
  return wrench;
}

// A base that is hardly held by its floor gets the push's momentum.
TEST(BaseLoopTest, AWrenchHoldsFromThePeriodThatBeginsAtItsArrivalUntilTheNext) {
  LoopSettings slippery = settings();
  slippery.scene.floor.f.setZero();
  slippery.scene.robot.a_X = slippery.scene.robot.a_Y = 0;
  BaseLoop loop(slippery);
  loop.push(0.0021, push_sideways(5));
  loop.push(0.0021, push_sideways(7));  // in place of the one before
  loop.push(0.0101, push_sideways(0));
  loop.advance_periods(20);
  EXPECT_NEAR(loop.simulation().state().V_Y(), 7 * 0.008 / slippery.scene.robot.m_s(), 1e-12);
  EXPECT_NE(loop.refusal({{1000, {2, 0, 0}, 0}}), "");
  EXPECT_EQ(loop.refusal({{10, {0.1, 0, 0}, 0}}), "");
}

// A load that is replaced goes with its momentum, and the one put on at rest in its place takes its share of what is
// left.
TEST(BaseLoopTest, ALoadInPlaceOfAnotherSlowsTheBaseOnceMore) {
  LoopSettings slippery = settings();
  slippery.scene.floor.f.setZero();
  slippery.scene.robot.a_X = slippery.scene.robot.a_Y = 0;
  slippery.scene.initial.V_Y() = 0.5;
  BaseLoop loop(slippery);
  const double m_s = slippery.scene.robot.m_s(), share = m_s / (m_s + 10);
  loop.push(0, LoadsRequest{{{10, {0, 0, 0.1}, 0}}, true});
  loop.advance_periods(2);
  EXPECT_NEAR(loop.simulation().state().V_Y(), 0.5 * share, 1e-12);
  loop.push(loop.time(), LoadsRequest{{{10, {0, 0, 0.2}, 0}}, true});
  loop.advance_periods(2);
  EXPECT_NEAR(loop.simulation().state().V_Y(), 0.5 * share * share, 1e-12);
}

// A motion that begins with a request is that of a scene that begins there.
TEST(BaseLoopTest, AStateThatIsSetIsAStart) {
  for (const Model model : {Model::kNoSlip, Model::kViscous, Model::kCoulomb}) {
    LoopSettings there = settings(), elsewhere = settings();
    there.scene.model = elsewhere.scene.model = model;
    const Eigen::Vector3d pose{1, -2, 2.5}, velocity{0.3, -0.2, 0.4};
    const Wheels phi{0.1, 0.5, -0.4, 0.9};
    State& start = there.scene.initial;
    start.values.col(0).head<3>() = pose;
    start.values.col(1).head<3>() = velocity;
    start.phi() = phi;
    NoSlipModel(there.scene.robot).constrain(start);
    BaseLoop begun(there), put(elsewhere);
    put.push(0, torques(2));
    put.push(0.0105, torques(1));
    put.push(0.0105, StateRequest{pose, velocity, phi});
    put.advance_periods(111);
    begun.push(0, torques(1));
    begun.advance_periods(100);
    const auto apart = (put.simulation().state().values - begun.simulation().state().values).abs();
    EXPECT_LT(apart.block(0, 0, 3, 2).maxCoeff(), 1e-9) << name_of(model);
    EXPECT_LT(apart.block(0, 2, 4, 4).maxCoeff(), 1e-8) << name_of(model);
    EXPECT_GT((begun.simulation().state().velocity() - velocity).norm(), 0.01) << "it does move";
    EXPECT_LT(put.simulation().energy_balance_error(), 1e-4);
    const std::vector<StateChange> changes = put.take_events().state_changes;
    ASSERT_EQ(changes.size(), 1u);
    EXPECT_EQ(changes[0].t, 0.011);
    EXPECT_EQ(changes[0].state.psi(), 2.5);
  }
}

TEST(BaseLoopTest, RequestsActAtTheSameTimesWhereManyPeriodsGoAtOnce) {
  LoopSettings sensing = settings();
  sensing.driver.motors.quantized = true;
  sensing.sensors.imu.emplace();
  BaseLoop one(sensing), many(sensing);
  for (BaseLoop* loop : {&one, &many}) {
    loop->push(0.0, torques(1));
    loop->push(0.0103, SwitchOff());
    loop->push(0.0103, push_sideways(100));
    loop->push(0.0201, rates({0.3, 0.1, 0.5}));
    loop->push(0.0201, LoadsRequest{{{10, {0.1, 0, 0.1}, 0.1}}, true});
    loop->push(0.0503, push_sideways(0));
    loop->push(0.1, StateRequest{{5, 6, 2}, {0.1, 0, 0}, Wheels(1, 2, 3, 4)});  // at an instant of publishing
    loop->push(0.1505, StateRequest{{7, 8, 3}, {0, 0, 0}, std::nullopt});
  }
  for (int k = 0; k < 200; ++k) {
    one.advance_periods(1);
    one.meet_instant();
  }
  many.advance_periods(199);
  many.advance_periods(1);
  many.meet_instant();
  EXPECT_TRUE((one.simulation().state().values == many.simulation().state().values).all());
  EXPECT_EQ(one.sensors().odometry().pose(), many.sensors().odometry().pose());
  EXPECT_EQ(one.sensors().imu()->heading(), many.sensors().imu()->heading());
  EXPECT_EQ(one.sensors().imu()->acceleration(), many.sensors().imu()->acceleration());
}

// As a base that is carried by hand does not know, but its encoders show the wheels as they are.
TEST(BaseLoopTest, NeitherOdometryNorTheInertialUnitNoticesASetState) {
  LoopSettings sensing = settings();
  sensing.driver.motors.quantized = true;
  sensing.sensors.imu = ImuSettings{{}, {}, {0, 0, 0}};
  sensing.scene.initial.phi() = Wheels(0.1, 0.2, 0.3, 0.4);
  BaseLoop loop(sensing);
  Faults slipping;
  slipping.encoder_slip.setConstant(0.5);
  slipping.silent[3] = true;
  loop.push(0, slipping);
  loop.push(0.101, StateRequest{{5, 6, -2}, {0, 0, 0}, Wheels(10, 20, 30, 40)});
  loop.advance_periods(200);
  EXPECT_LT(loop.sensors().odometry().pose().norm(), 1e-12);
  EXPECT_EQ(loop.sensors().imu()->heading(), 0);
  EXPECT_LT((loop.sensors().imu()->acceleration() - Eigen::Vector3d(0, 0, sensing.scene.floor.g)).norm(), 1e-12);
  EXPECT_EQ(loop.simulation().state().x(), 5);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(loop.sensors().readings().phi[i], 10 * (i + 1), 1e-4) << kWheelNames[i];
}

TEST(BaseLoopTest, OdometryAndTheInertialUnitGoOnWhereAMovingBaseIsPut) {
  LoopSettings sensing = settings();
  sensing.sensors.imu = ImuSettings{{}, {}, {0, 0, 0}};
  BaseLoop stays(sensing), put(sensing);
  for (BaseLoop* loop : {&stays, &put}) {
    loop->push(0, rates({0.3, 0.1, 0.5}));
    loop->advance_periods(2011);
  }
  put.push(put.time(), StateRequest{{5, 6, -2}, put.simulation().state().velocity(), std::nullopt});
  for (BaseLoop* loop : {&stays, &put}) loop->advance_periods(10);  // to the next instant
  EXPECT_NEAR(put.sensors().imu()->rate(), stays.sensors().imu()->rate(), 0.05);
  EXPECT_LT((put.sensors().imu()->acceleration() - stays.sensors().imu()->acceleration()).norm(), 1);
  for (BaseLoop* loop : {&stays, &put}) loop->advance_periods(500);
  EXPECT_LT((put.sensors().odometry().pose() - stays.sensors().odometry().pose()).norm(), 0.005);
  EXPECT_NEAR(put.sensors().imu()->heading(), stays.sensors().imu()->heading(), 0.005);
}

TEST(BaseLoopTest, ALoadedBaseKeepsItsLoadsWhereItIsPut) {
  LoopSettings slippery = settings();
  slippery.scene.floor.f.setZero();
  slippery.scene.robot.a_X = slippery.scene.robot.a_Y = 0;
  BaseLoop loop(slippery);
  const double m_s = slippery.scene.robot.m_s();
  loop.push(0, LoadsRequest{{{10, {0, 0, 0.1}, 0}}, false});
  loop.push(0.01, StateRequest{{1, 0, 0}, {0, 0.5, 0}, std::nullopt});
  loop.push(0.02, push_sideways(40));
  loop.advance_periods(120);
  EXPECT_NEAR(loop.simulation().state().V_Y(), 0.5 + 40 * 0.1 / (m_s + 10), 1e-9);
  EXPECT_LT(loop.simulation().energy_balance_error(), 1e-6);
}

TEST(BaseLoopTest, CommandsAndServicesKeepTheirOrder) {
  BaseLoop loop(settings());
  loop.push(0, torques(1));
  loop.push(0, SwitchOff());
  EXPECT_EQ(play(loop, 1), std::vector<double>{0}) << "off after the command";
  EXPECT_FALSE(loop.driver().motors_on());
  loop.push(loop.time(), SwitchOff());
  loop.push(loop.time(), torques(2));
  EXPECT_EQ(play(loop, 1), std::vector<double>{2}) << "energised by the command after it";
  loop.push(loop.time(), torques(3));
  loop.push(loop.time(), SwitchOff());
  loop.push(loop.time(), torques(2.5));
  EXPECT_EQ(play(loop, 1), std::vector<double>{2.5}) << "off between two commands";
  loop.push(loop.time(), SwitchOn());
  EXPECT_EQ(loop.driver().set_points()[0].mode, DriveMode::kTorque) << "nothing happens before the period begins";
  play(loop, 1);
  EXPECT_EQ(loop.driver().set_points()[0].mode, DriveMode::kVelocity);
  EXPECT_TRUE(loop.driver().motors_on());
}

TEST(BaseLoopTest, ArrivalsNeverGoBack) {
  BaseLoop loop(settings());
  loop.push(0.002, torques(1));
  loop.push(0.001, torques(2));
  EXPECT_EQ(play(loop, 3).back(), 2) << "waits for the one before it";
}

TEST(BaseLoopTest, DelayCountsFromArrival) {
  BaseLoop loop(settings());
  Faults delay;
  delay.command_delay = 0.003;
  loop.push(0, torques(1));
  loop.push(0.0015, delay);
  loop.push(0.0018, torques(2));
  loop.push(0.0045, SwitchOn());
  loop.push(0.0046, torques(3));
  // The second is due at 4.8 ms, after the motors were switched on; the third at 7.6 ms.
  const std::vector<double> torque = play(loop, 9);
  EXPECT_EQ(torque[4], 1);
  EXPECT_EQ(torque[5], 2);
  EXPECT_EQ(torque[7], 2);
  EXPECT_EQ(torque[8], 3);
}

TEST(BaseLoopTest, SwitchingOffForgetsDelayedCommands) {
  BaseLoop loop(settings());
  Faults delay;
  delay.command_delay = 0.003;
  loop.push(0, delay);
  loop.push(0, torques(1));
  loop.push(0.001, SwitchOff());
  for (const double torque : play(loop, 10)) EXPECT_EQ(torque, 0);
}

TEST(BaseLoopTest, CommandsOfOnePeriodAreOne) {
  BaseLoop loop(settings());
  DriveCommand first_wheel;
  first_wheel[0] = SetPoint{DriveMode::kTorque, 2};
  for (int k = 0; k < 100000; ++k) loop.push(0, torques(1e-5 * k));
  loop.push(0, first_wheel);
  EXPECT_EQ(loop.waiting(), 1u);
  EXPECT_EQ(play(loop, 1), std::vector<double>{2});
  EXPECT_EQ(loop.simulation().torque()[1], 1e-5 * 99999) << "the last for this wheel";
}

TEST(BaseLoopTest, CommandsOfSeparatePeriodsAreNotMerged) {
  BaseLoop loop(settings());
  for (int k = 0; k < 40; ++k) loop.push(0.0025 + 0.0001 * k, torques(0.0625 * k));
  EXPECT_EQ(loop.waiting(), 5u);
  EXPECT_EQ(play(loop, 7), (std::vector<double>{0, 0, 0, 0.0625 * 5, 0.0625 * 15, 0.0625 * 25, 0.0625 * 35}));
}

TEST(BaseLoopTest, RequestsThatWaitAreBounded) {
  BaseLoop loop(settings());
  int taken = 0;
  for (int k = 0; k < 100000; ++k) {
    loop.push(0, torques(1));
    taken += loop.push(0, SwitchOff());
  }
  EXPECT_EQ(taken, static_cast<int>(BaseRequests::kMaxWaiting));
  EXPECT_LE(loop.waiting(), 2 * BaseRequests::kMaxWaiting + 1);
  EXPECT_EQ(play(loop, 1), std::vector<double>{1}) << "commands are never refused";
  EXPECT_TRUE(loop.push(loop.time(), SwitchOff())) << "room again";
}

TEST(BaseLoopTest, AnswersForRequestsThatStillWait) {
  BaseLoop loop(settings());
  EXPECT_TRUE(loop.present(0));
  loop.push(0.01, cable_out());
  EXPECT_TRUE(loop.present(0.109));
  EXPECT_FALSE(loop.present(0.111)) << "the loop will have lost it by then";
  loop.push(0.12, Reconnect());
  EXPECT_FALSE(loop.present(0.12)) << "the cable is out";
  loop.push(0.13, Faults());
  EXPECT_FALSE(loop.present(0.13)) << "it takes a reconnect";
  loop.push(0.14, Reconnect());
  EXPECT_TRUE(loop.present(0.14));
  EXPECT_EQ(loop.time(), 0);

  loop.advance_periods(115);
  EXPECT_FALSE(loop.driver().present());
  EXPECT_TRUE(loop.take_driver_events().base_lost);
  EXPECT_TRUE(loop.present(0.14)) << "as before";
  loop.advance_periods(30);
  EXPECT_TRUE(loop.driver().present());
  EXPECT_FALSE(loop.take_driver_events().base_lost) << "told once";
}

TEST(BaseLoopTest, LosesAndFindsTheBaseWithinOneCall) {
  BaseLoop loop(settings());
  loop.push(0, rates({0.3, 0, 0}));
  loop.push(0.5, cable_out());
  loop.push(0.7, Faults());
  loop.push(0.8, Reconnect());
  loop.advance_periods(1000);
  EXPECT_TRUE(loop.driver().present());
  EXPECT_TRUE(loop.take_driver_events().base_lost);
  EXPECT_NEAR(loop.sensors().odometry().pose().x(), 0, 0.02) << "odometry starts again";
  EXPECT_GT(loop.simulation().state().x(), 0.1);
}

TEST(BaseLoopTest, TellsOfATimeOut) {
  LoopSettings stopping = settings();
  stopping.driver.command_timeout = 0.05;
  BaseLoop loop(stopping);
  loop.push(0.0007, torques(1));
  loop.advance_periods(50);
  EXPECT_FALSE(loop.take_driver_events().timed_out);
  loop.advance_periods(2);
  EXPECT_TRUE(loop.take_driver_events().timed_out);
  EXPECT_FALSE(loop.take_driver_events().timed_out);
}

TEST(BaseLoopTest, TakesRequestsAtTheCommandRate) {
  LoopSettings driver_like = settings();
  driver_like.command_rate = 50;
  BaseLoop loop(driver_like);
  loop.push(0, torques(1));
  loop.push(0.0003, torques(2));
  loop.push(0.021, torques(3));
  const std::vector<double> torque = play(loop, 50);
  EXPECT_EQ(torque[0], 1);
  EXPECT_EQ(torque[19], 1);
  EXPECT_EQ(torque[20], 2);
  EXPECT_EQ(torque[39], 2);
  EXPECT_EQ(torque[40], 3);
}

// As where a stack commands and pushes at once while time is paused.
TEST(BaseLoopTest, CommandsAndWrenchesOfOnePeriodAreOneEach) {
  LoopSettings slippery = settings();
  slippery.scene.floor.f.setZero();
  slippery.scene.robot.a_X = slippery.scene.robot.a_Y = 0;
  BaseLoop loop(slippery);
  for (int k = 0; k < 100000; ++k) {
    ASSERT_TRUE(loop.push(0, torques(1e-5 * k)));
    ASSERT_TRUE(loop.push(0, push_sideways(k)));
  }
  EXPECT_EQ(loop.waiting(), 2u);
  EXPECT_EQ(play(loop, 1), std::vector<double>{1e-5 * 99999});
  EXPECT_NEAR(loop.simulation().state().V_Y(), 99999 * 0.001 / slippery.scene.robot.m_s(), 1e-9);
}

// The driver's cycle is no matter of what pushes its base.
TEST(BaseLoopTest, WrenchesDoNotWaitForTheCommandRate) {
  LoopSettings driver_like = settings();
  driver_like.command_rate = 50;
  BaseLoop loop(driver_like);
  loop.advance_periods(1);
  loop.push(0.001, torques(1));
  loop.push(0.001, push_sideways(200));
  loop.push(0.001, LoadsRequest{{{10, {0, 0, 0.1}, 0}}, false});
  loop.advance_periods(1);
  EXPECT_EQ(loop.simulation().torque()[0], 0) << "waits for 20 ms";
  EXPECT_GT(loop.simulation().state().V_Y(), 0);
  EXPECT_EQ(loop.simulation().applied_loads().loads.size(), 1u);
  EXPECT_EQ(loop.waiting(), 1u);
  EXPECT_EQ(play(loop, 19).back(), 1);
}

TEST(BaseLoopTest, SetBackAgainstTheWallClockObeysAtOnceWhatHasArrived) {
  BaseLoop loop(settings());
  loop.push(3.0, torques(1));
  loop.bring_requests_forward();
  EXPECT_EQ(play(loop, 1), std::vector<double>{1});
}

TEST(BaseLoopTest, ResetForgetsEverything) {
  BaseLoop loop(settings());
  loop.push(0, rates({0.3, 0, 0}));
  loop.advance_periods(500);
  loop.push(loop.time(), torques(2));
  loop.reset();
  EXPECT_EQ(loop.time(), 0);
  EXPECT_TRUE(loop.meet_instant());
  loop.advance_periods(100);
  EXPECT_EQ(loop.simulation().state().x(), 0);
  EXPECT_EQ(loop.sensors().odometry().pose().x(), 0);
}

// As the driver's configuration file may have it: ticks and rpm of the odometry's covariances are those of its motor.
TEST(BaseLoopTest, OdometryIsThatOfTheDriversMotor) {
  LoopSettings coarse = settings();
  coarse.driver.motor.encoder_ticks = 40;
  coarse.driver.motor.gear_ratio *= 10;
  coarse.sensors.wheel_error = 1e-6;
  BaseLoop loop(coarse);
  const double tick = 2 * M_PI * 10 * Motor().gear_ratio / 40, R = DriverKinematics().wheel_radius;
  for (int run = 0; run < 2; ++run) {
    const double expected = R * R / 4 * tick * tick / 12;  // of x, the mean of four wheels
    EXPECT_NEAR(loop.sensors().odometry().pose_covariance()(0, 0) / expected, 1, 1e-6) << run;
    loop.reset();
  }
}

/// What the sensors say after two seconds of driving with noisy encoders, if they are read every n control periods.
std::vector<double> sensors_after_reading_every(int n, double publish_rate) {
  LoopSettings noisy = settings();
  noisy.publish_rate = publish_rate;
  noisy.driver.motors.quantized = true;
  noisy.sensors.wheel_error = 0.05;
  BaseLoop loop(noisy);
  Faults noise;
  noise.encoder_noise = 1e-3;
  noise.encoder_slip[2] = 0.1;
  loop.push(0, noise);
  loop.push(0, rates({0.3, 0.1, 0.8}));
  loop.push(1.0004, Faults());
  loop.push(1.5, SwitchOff());
  for (int k = 0; k < 2000; k += n) {
    loop.advance_periods(n);
    if (n > 1 || k % 2 == 0) loop.meet_instant();
  }
  loop.meet_instant();
  std::vector<double> numbers;
  const auto add = [&](const auto& matrix) {
    numbers.insert(numbers.end(), matrix.data(), matrix.data() + matrix.size());
  };
  const WheelOdometry& odometry = loop.sensors().odometry();
  const MotorReadings& readings = loop.sensors().readings();
  add(odometry.pose());
  add(odometry.pose_covariance());
  add(odometry.velocity_covariance(readings.dphi));
  for (const Wheels& column : {readings.phi, readings.dphi, readings.torque}) add(column);
  return numbers;
}

TEST(BaseLoopTest, SensorsAreTheSameHoweverOftenTheyAreRead) {
  for (const double publish_rate : {50.0, 300.0, 1000.0}) {
    const auto expected = sensors_after_reading_every(1, publish_rate);
    for (const int n : {2, 20, 500, 2000}) {
      EXPECT_EQ(sensors_after_reading_every(n, publish_rate), expected) << n << " at " << publish_rate << " Hz";
    }
  }
}

/// What the check says of a loop with these settings at its first instant; empty: all is finite.
std::string refusal_of(const LoopSettings& settings, const Faults& faults = {}) {
  BaseLoop loop(settings);
  loop.push(0, faults);
  loop.push(0, rates({0.3, 0.1, 0.5}));
  try {
    for (int k = 0; k < 100; ++k) {
      if (loop.meet_instant()) loop.require_finite();
      loop.advance_periods(1);
    }
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(BaseLoopTest, TellsWhatIsNotFiniteBeforeItIsPublished) {
  EXPECT_EQ(refusal_of(settings()), "");

  LoopSettings coarse = settings();
  coarse.driver.motors.quantized = true;
  coarse.driver.motor.encoder_ticks = 1e-320;
  EXPECT_EQ(refusal_of(coarse), "base/joint_states: the position of a wheel is not finite at t = 0 s");

  LoopSettings narrow = settings();
  narrow.sensors.kinematics.half_lengths = 1e-320;
  EXPECT_EQ(refusal_of(narrow), "odom: the pose is not finite at t = 0 s");

  LoopSettings nowhere = settings();
  nowhere.scene.initial.x() = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal_of(nowhere), "ground_truth: the state of the base is not finite at t = 0 s");
}

TEST(BaseLoopTest, CountsPeriodsToAnInstant) {
  BaseLoop loop(settings());
  EXPECT_EQ(loop.next_instant(), 0);
  EXPECT_TRUE(loop.meet_instant());
  EXPECT_EQ(loop.next_instant(), 0.02);
  EXPECT_EQ(loop.periods_until(0.02), 20);
  EXPECT_EQ(loop.periods_until(0.0201), 21);
  EXPECT_EQ(loop.periods_until(0), 1);
  loop.advance_periods(20);
  EXPECT_TRUE(loop.meet_instant());
  EXPECT_FALSE(loop.meet_instant());
}

}  // namespace
}  // namespace youbot_base_sim
