// The base behind its driver, without ROS.

#include "youbot_robot_hw/test_bed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace youbot_robot_hw {
namespace {

using namespace youbot_base_sim;

Scene scene(double control_period = 1e-3) {
  return default_scene({{"solver.control_period", control_period}, {"robot.profile", "measured"}});
}

SetPoints all(DriveMode mode, double value) {
  SetPoints set_points;
  set_points.fill({mode, value});
  return set_points;
}

TEST(TestBed, RatesAreKeptAndTheBaseCoversWhatItsWheelsRoll) {
  TestBed bed(scene());
  bed.command(all(DriveMode::kVelocity, 6));
  bed.advance(2);
  const Wheels phi = bed.read().phi;
  const double x = bed.state().x();
  bed.advance(2);
  // R = 0.05 m. Rates swing by a few per cent with the rollers; the base slips by less than that.
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(bed.read().phi[i] - phi[i], 12, 0.12);
  EXPECT_NEAR(bed.state().x() - x, 0.05 * 12, 0.02);
}

TEST(TestBed, TorquesAreThoseThatTheMotorsCanExert) {
  TestBed bed(scene());
  bed.command(all(DriveMode::kTorque, 1));
  bed.advance(0.5);
  const Motor motor;
  const double exerted = motor.torque(std::floor(1 / motor.milliampere()) * 1e-3);  // whole mA
  Simulation simulation(scene());
  simulation.set_torque(Wheels::Constant(exerted));
  simulation.advance_to(0.5);
  EXPECT_NEAR(bed.state().x(), simulation.state().x(), 1e-9);
  EXPECT_GT(bed.state().x(), 0.05);
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(bed.read().torque[i], exerted, 1e-12);
}

TEST(TestBed, EachWheelHasItsOwnMode) {
  TestBed bed(scene());
  SetPoints set_points = all(DriveMode::kVelocity, 3);
  set_points[1] = set_points[3] = {DriveMode::kTorque, 0};
  bed.command(set_points);
  bed.advance(2);
  const MotorReadings& readings = bed.read();
  EXPECT_EQ(readings.torque[1], 0);
  EXPECT_EQ(readings.torque[3], 0);
  EXPECT_GT(std::abs(readings.torque[0]), 0.1);
  EXPECT_NEAR(readings.dphi[0], 3, 0.3);
}

TEST(TestBed, SetPointsThatAreNotFiniteLeaveTheirWheelAsItWas) {
  TestBed bed(scene()), wanted(scene());
  EXPECT_TRUE(bed.command(all(DriveMode::kVelocity, 3)));
  wanted.command(all(DriveMode::kVelocity, 3));
  SetPoints set_points = all(DriveMode::kVelocity, 3);
  set_points[2].value = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(bed.command(set_points));
  bed.advance(1);
  wanted.advance(1);
  EXPECT_TRUE((bed.state().values == wanted.state().values).all());
}

TEST(TestBed, OnlyWholeControlPeriodsPass) {
  TestBed bed(scene());
  for (const double duration : {0.0, -0.001, 0.0004, 0.0015, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(bed.advance(duration), std::invalid_argument) << duration;
  }
  for (int k = 0; k < 100; ++k) bed.advance(0.01);
  EXPECT_DOUBLE_EQ(bed.time(), 1);
  Scene continuous = scene();
  continuous.solver.control_period = 0;
  EXPECT_THROW(TestBed{continuous}, std::invalid_argument);
}

}  // namespace
}  // namespace youbot_robot_hw

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
