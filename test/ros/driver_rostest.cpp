// What the node does as the driver: motors and encoders with their faults, settings, signs and units, and EtherCAT.

#include <Eigen/Dense>

#include "joint_entry.h"
#include "log.h"
#include "program.h"

namespace youbot_base_sim {
namespace {

/// base/switchOffMotors frees the wheels, the next command energises them, base/switchOnMotors keeps them at rest.
class MotorServices : public ::testing::Test {
 protected:
  void SetUp() override {
    base_.command(twist(0.4, 0, 0));
    base_.go_on(499);
    EXPECT_GT(base_.truth.twist.twist.linear.x, 0.35);
  }

  BaseClient& base_ = BaseClient::fresh();
};

TEST_F(MotorServices, off_means_free_wheels) {
  EXPECT_TRUE(base_.call("base/switchOffMotors"));
  base_.go_on(200);
  for (int i = 0; i < kWheels; ++i) EXPECT_EQ(base_.joints.effort[i], 0) << kWheelNames[i];
  // Bearings alone, 0.11 N m s/rad a wheel, brake 36 kg with a time constant of 0.2 s: exp(-1).
  EXPECT_GT(base_.truth.twist.twist.linear.x, 0.1);
}

TEST_F(MotorServices, on_means_at_rest) {
  EXPECT_TRUE(base_.call("base/switchOnMotors"));
  base_.go_on(500);
  EXPECT_NEAR(base_.truth.twist.twist.linear.x, 0, 0.01);
}

// A motor that does not answer stands still in the joint states and drags; the driver goes on with the others.
TEST(SilentMotor, drags_while_the_driver_goes_on) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.4, 0, 0));
  base.go_on(499);
  const double position = base.joints.position[1];
  SetFaults::Request faults;
  faults.silent[1] = true;
  base.set_faults(faults);
  base.command(twist(0, 0, 0));  // does not reach it
  base.go_on(999);
  EXPECT_NEAR(base.joints.position[1], position, 0.02);
  EXPECT_GT(base.joints.velocity[1], 5) << "of before";
  EXPECT_NEAR(base.joints.velocity[0], 0, 0.1);
  base.set_faults({});
  base.go_on(500);
  EXPECT_NEAR(base.joints.velocity[1], 0, 0.1) << "what the command was";
}

// Encoders that slip or are noisy mislead odometry and joint states, and not ground truth.
TEST(EncoderFaults, slipping_encoder_bends_the_odometry) {
  BaseClient& base = BaseClient::fresh();
  SetFaults::Request faults;
  faults.encoder_slip[0] = faults.encoder_slip[2] = 0.2;  // on the left
  base.set_faults(faults);
  base.command(twist(0.4, 0, 0));
  base.go_on(999);
  EXPECT_NEAR(heading(base.truth.pose.pose.orientation), 0, 0.05);
  EXPECT_NEAR(base.joints.position[0], 0.8 * base.joints.position[1], 0.05 * base.joints.position[1]);
  // A fifth of what the left wheels rolled, over the width that the driver reckons with.
  const double rolled = 0.0475 * base.joints.position[1];
  EXPECT_NEAR(heading(base.odometry.pose.pose.orientation), 0.2 * rolled / (2 * 0.385), 0.1 * rolled);
}

// A loss of EtherCAT takes the base away until it is reconnected, as with the driver.
TEST(EthercatLoss, takes_the_base_away_until_reconnect) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  base.reset();
  base.command(twist(0.4, 0, 0));
  base.go_on(499);
  EXPECT_GT(base.odometry.pose.pose.position.x, 0.1);

  SetFaults::Request lost;
  lost.ethercat_lost = true;
  base.set_faults(lost);
  base.idle(200);
  base.settle_truth();
  log.expect(rosgraph_msgs::Log::WARN, {"EtherCAT is lost"});
  // What the driver publishes ends with the hundredth cycle; ground truth does not.
  EXPECT_NEAR(time_of(base.odometry.header.stamp), 0.6, 0.0021);
  EXPECT_NEAR(time_of(base.joints.header.stamp), 0.6, 0.0021);
  EXPECT_NEAR(time_of(base.tf.header.stamp), 0.6, 0.0021);
  EXPECT_EQ(base.time(), 0.7);
  // The wheels turn freely.
  const double v = base.truth.twist.twist.linear.x;
  EXPECT_GT(v, 0.1);

  base.command(twist(-0.4, 0, 0));
  log.expect(rosgraph_msgs::Log::ERROR, {"No base initialized!"});
  EXPECT_FALSE(base.call("base/switchOnMotors"));
  EXPECT_FALSE(base.call("base/switchOffMotors"));
  Program call("/usr/bin/env", {"rosservice", "call", "/base/switchOnMotors"});
  EXPECT_NE(call.wait(), 0);
  EXPECT_NE(call.err().find("No base initialized!"), std::string::npos) << "the caller: " << call.err();

  EXPECT_TRUE(base.call("reconnect")) << "answers true in any case";
  log.expect(rosgraph_msgs::Log::ERROR, {"could not be initialized"});
  base.set_faults({});
  base.idle(10);
  base.settle_truth();
  EXPECT_LT(time_of(base.odometry.header.stamp), 0.61) << "it takes a reconnect";

  EXPECT_TRUE(base.call("reconnect"));
  base.go_on(1);
  EXPECT_NEAR(base.odometry.pose.pose.position.x, 0, 1e-3) << "odometry starts again";
  EXPECT_GT(base.joints.position[0], 2.0) << "encoders do not";
  base.go_on(500);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, 0, 0.02) << "the wheels are kept at rest";
  base.command(twist(0.4, 0, 0));
  base.go_on(300);
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3);
}

// The driver's own signs: the wheels on the left have their motors' rates and efforts, the opposite of their
// positions'.
TEST(JointSigns, are_the_drivers) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(0.5), {}));
  base.go_on(499);
  for (int i = 0; i < kWheels; ++i) {
    const double sign = i % 2 == 0 ? -1 : 1;  // fl and bl
    EXPECT_GT(base.joints.position[i], 0.1) << kWheelNames[i];
    EXPECT_GT(sign * base.joints.velocity[i], 0.1) << kWheelNames[i];
    EXPECT_EQ(base.joints.effort[i], sign * 0.5) << kWheelNames[i];
  }
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.05) << "odometry is what it is";
  EXPECT_NEAR(base.odometry.twist.twist.angular.z, 0, 0.1);
}

// Commands have one sign for all wheels, so that a loop closed over both would have positive feedback.
TEST(JointSigns, are_warned_of_once_beside_velocity_commands) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  brics_actuator::JointVelocities right;
  right.velocities = {entry("wheel_joint_fr", kVelocityUnit, 1), entry("wheel_joint_br", kVelocityUnit, 1)};
  base.command(right);
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "positive feedback"), 0u) << "the wheels on the right have one sign";
  for (int k = 0; k < 3; ++k) base.command(velocity_message(Wheels::Constant(1), {}));
  log.expect(rosgraph_msgs::Log::WARN, {"positive feedback", "velocity_command", "wheel_joint_fl and _bl"});
  base.command(torque_message({1e6, 0, 0, 0}, {}));
  log.expect(rosgraph_msgs::Log::WARN, {"torques_command", "limit"});
  EXPECT_EQ(log.count(rosgraph_msgs::Log::WARN, "positive feedback"), 1u);
}

// A wheel at rest has no -0 with either sign.
TEST(JointSigns, of_zero_are_positive) {
  BaseClient& base = BaseClient::fresh();
  base.settle();
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_EQ(base.joints.velocity[i], 0) << kWheelNames[i];
    EXPECT_FALSE(std::signbit(base.joints.velocity[i])) << kWheelNames[i];
    EXPECT_FALSE(std::signbit(base.joints.effort[i])) << kWheelNames[i];
  }
}

// EtherCAT counts in encoder ticks, motor rpm and mA, and odometry has nothing else. Worked out from the driver's
// configuration file: 4000 ticks a turn, gear 364/9405, 0.0335 N m/A.
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
    base.go_on(1);
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

// The scene's motors are the node's, but for what a parameter says.
TEST(MotorSettings, are_the_scenes_unless_a_parameter_is_given) {
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(2), base.clock()));
  base.go_on(49);
  EXPECT_NEAR(base.joints.effort[0], 0, 1e-3) << "the parameter's delay is longer than the scene's";
  base.go_on(1);
  EXPECT_NEAR(base.joints.effort[0], 0.8, 1e-12) << "the scene's limit";
}

// ~dry_friction of the drives holds the base against torques below it and lets it go above. Friction of T N m, smoothed
// over the rate r, carries M N m at the rate r M / sqrt(T^2 - M^2).
TEST(DryFriction, holds_but_for_creep_and_lets_go) {
  const RobotParameters robot;
  const double T = 0.5, M = 0.4, creep = robot.dry_friction_rate * M / std::sqrt(T * T - M * M);
  BaseClient& base = BaseClient::fresh();
  base.command(torque_message(Wheels::Constant(M), {}));
  base.go_on(999);
  EXPECT_NEAR(base.joints.velocity[0], creep, 0.02 * creep);
  EXPECT_NEAR(base.truth.twist.twist.linear.x, robot.R * creep, 0.02 * robot.R * creep);
  EXPECT_EQ(base.joints.effort[0], M) << "the motor's torque, as its current tells";

  base.command(torque_message(Wheels::Constant(0.8), {}));
  base.go_on(999);
  EXPECT_GT(base.truth.twist.twist.linear.x, 0.1);
}

Eigen::Matrix3d covariance_of(const boost::array<double, 36>& message) {
  constexpr int kAt[] = {0, 1, 5};
  Eigen::Matrix3d covariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) covariance(i, j) = message[6 * kAt[i] + kAt[j]];
  }
  return covariance;
}

// Covariances of odometry, on request, cover the error of odometry.
TEST(OdometryCovariance, covers_the_error) {
  BaseClient& base = BaseClient::fresh();
  for (const auto& command : {twist(0.4, 0, 0), twist(0, 0.3, 0), twist(0.2, 0.1, 0.8)}) {
    base.command(command);
    base.go_on(999);
    const auto& truth = base.truth.pose.pose;
    const auto& odometry = base.odometry.pose.pose;
    const Eigen::Vector3d error(odometry.position.x - truth.position.x, odometry.position.y - truth.position.y,
                                std::remainder(heading(odometry.orientation) - heading(truth.orientation), 2 * M_PI));
    const Eigen::Matrix3d covariance = covariance_of(base.odometry.pose.covariance);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().minCoeff(), 0);
    // Mahalanobis distance: within four deviations, and not a hundredth of one.
    const double distance = std::sqrt(error.dot(covariance.inverse() * error));
    EXPECT_LT(distance, 4) << error.transpose() << "\n" << covariance;
    EXPECT_GT(distance, 0.01);
    EXPECT_GT(base.odometry.twist.covariance[0], 0);
  }
  EXPECT_EQ(base.truth.pose.covariance[0], 0) << "ground truth is exact";
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
