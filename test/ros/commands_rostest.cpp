// What commands do to the node: good and bad ones, too many, late ones, and none.

#include "joint_entry.h"
#include "log.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

/// The good part of a bad command takes effect, the log names the bad part, and the state stays finite.
class BadCommands : public ::testing::Test {
 protected:
  BadCommands() { base_.command(torque_message(kBefore, {})); }

  void command(const std::vector<brics_actuator::JointValue>& torques) {
    brics_actuator::JointTorques message;
    message.torques = torques;
    base_.command(message);
  }

  void expect_torques(const Wheels& expected) {
    base_.settle();
    for (int i = 0; i < kWheels; ++i) EXPECT_EQ(base_.joints.effort[i], expected[i]) << kWheelNames[i];
    EXPECT_TRUE(std::isfinite(base_.truth.pose.pose.position.x));
  }

  void expect_warning(const std::vector<std::string>& words) { log_.expect(rosgraph_msgs::Log::WARN, words); }

  const Wheels kBefore{0.1, 0.2, 0.3, 0.4};
  BaseClient& base_ = BaseClient::fresh();
  Log& log_ = Log::of(base_);
};

TEST_F(BadCommands, entry_with_a_wrong_unit_is_skipped) {
  command({entry("wheel_joint_fl", kTorqueUnit, 1), entry("wheel_joint_fr", "N m", 1), entry("wheel_joint_bl", "", 1),
           entry("wheel_joint_br", kTorqueUnit, 1)});
  expect_torques({1, 0.2, 0.3, 1});
  expect_warning({"torques_command", "wheel_joint_fr", "\"N m\"", kTorqueUnit});
  expect_warning({"torques_command", "wheel_joint_bl", "\"\"", kTorqueUnit});
}

TEST_F(BadCommands, torque_beyond_the_motor_is_clipped) {
  command({entry("wheel_joint_fl", kTorqueUnit, 1e6), entry("wheel_joint_br", kTorqueUnit, -1e300)});
  expect_torques({Motor().max_torque(), 0.2, 0.3, -Motor().max_torque()});
  expect_warning({"torques_command", "wheel_joint_fl", "1000000 N m", "limit", "clipped to 3.0849 N m"});
  expect_warning({"torques_command", "wheel_joint_br", "-1e+300 N m", "limit", "clipped to -3.0849 N m"});
}

TEST_F(BadCommands, velocity_beyond_the_motor_is_clipped) {
  base_.command(velocity_message({20, 1, 1, 1}, {}));
  expect_warning({"velocity_command", "wheel_joint_fl", "20 rad/s", "limit", "clipped to 16.212 rad/s"});
  base_.command(twist(1, 0, 0));
  expect_warning({"cmd_vel", "wheel_joint_br", "21.05263 rad/s", "limit", "clipped to 16.212 rad/s"});
}

TEST_F(BadCommands, twist_that_is_none_is_refused) {
  geometry_msgs::Twist twist;
  twist.angular.z = kNan;
  base_.command(twist);
  expect_torques(kBefore);
  expect_warning({"cmd_vel", "nan"});
}

// Two publishers send commands of all kinds: the last one for a wheel counts, the log stays readable, and the state
// stays finite.
TEST(Floods, leave_the_last_command) {
  constexpr int kFlood = 3000;  // three queues full
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  ros::NodeHandle node;
  ros::Publisher second = node.advertise<brics_actuator::JointTorques>(kTorqueTopic, kFlood);
  wait_for("the second publisher's connection", [&] { return second.getNumSubscribers() > 0; });
  for (int k = 0; k < kFlood; ++k) {
    brics_actuator::JointTorques message;
    message.torques = {entry("wheel_joint_fl", kTorqueUnit, k % 2 == 0 ? 1e6 : kNan),
                       entry("wheel_joint_fr", "furlong", 1), entry("wheel_joint_bl", kTorqueUnit, -1e300)};
    second.publish(message);
    if (k % 10 == 0) base.send(torque_message(Wheels::Constant(1e6), {}));
  }
  // In lockstep each message is a control period; it ends when all that was not dropped has been played.
  wait_for("the flood to be over", [&] { return base.time() > 1.0; });
  base.command(torque_message(Wheels::Zero(), {}));
  wait_for("the last command", [&] {
    base.command(torque_message(Wheels(0.1, 0.2, 0.3, 0.4), {}));
    base.settle();
    return base.joints.effort[0] == 0.1;
  });
  for (const double number : {base.truth.pose.pose.position.x, base.truth.pose.pose.position.y,
                              base.truth.twist.twist.linear.x, base.odometry.pose.pose.position.x}) {
    EXPECT_TRUE(std::isfinite(number)) << number;
  }
  log.expect(rosgraph_msgs::Log::WARN, {"torques_command", "wheel_joint_fr", "furlong"});
  EXPECT_LT(log.count(rosgraph_msgs::Log::WARN, "furlong"), 30u) << "one a second at most";
}

TEST(Floods, kinds_may_be_mixed_wheel_by_wheel) {
  BaseClient& base = BaseClient::fresh();
  base.command(twist(0.2, 0, 0));
  brics_actuator::JointTorques torque;
  torque.torques = {entry("wheel_joint_fl", kTorqueUnit, 0.5)};
  base.command(torque);
  base.go_on(300);
  EXPECT_EQ(base.joints.effort[0], 0.5) << "by torque";
  EXPECT_NEAR(base.joints.velocity[3], 0.2 / 0.0475, 0.3) << "by velocity still";
  base.command(twist(0, 0, 0));
  base.go_on(1000);
  EXPECT_NEAR(base.joints.velocity[0], 0, 0.05) << "by velocity again";
}

// The driver takes the wheels for 5 % smaller than they are.
constexpr double kRadiusRatio = 0.05 / 0.0475;

/// Twists drive the base the right way, and both odometry and ground truth say so.
class CmdVel : public ::testing::Test {
 protected:
  void drive(double v_x, double v_y, double omega) {
    geometry_msgs::Twist command = twist(v_x, v_y, omega);
    command.linear.z = command.angular.x = command.angular.y = std::nan("");  // ignored
    for (int k = 0; k < 1000; ++k) base_.command(command);
    base_.settle();
    EXPECT_EQ(base_.time(), 1.0);
    expect_pose({v_x, v_y, omega});
  }

  /// The velocity times the time, less what the wheels have fallen behind: as far as it takes for the velocity loops to
  /// gather the torque that they exert. The ground truth is also off by slip.
  void expect_pose(const Eigen::Vector3d& velocity) {
    const DriverKinematics kinematics;
    const Wheels rates = kinematics.wheel_rates(velocity);
    const VelocityGains gains;
    Wheels behind;
    for (int i = 0; i < kWheels; ++i) {
      const double error = rates[i] - base_.joints.velocity[i];
      behind[i] = (base_.joints.effort[i] - gains.proportional * error) / gains.integral;
    }
    const Eigen::Vector3d way = velocity * base_.time(), pose = way - kinematics.velocity(behind);
    EXPECT_GT(pose.norm(), 0.6 * way.norm());
    EXPECT_LT((pose_of(base_.odometry) - pose).norm(), 0.01 * way.norm());
    EXPECT_LT((pose_of(base_.truth) - kRadiusRatio * pose).norm(), 0.1 * way.norm());
  }

  static Eigen::Vector3d pose_of(const nav_msgs::Odometry& message) {
    const auto& pose = message.pose.pose;
    return {pose.position.x, pose.position.y, heading(pose.orientation)};
  }

  BaseClient& base_ = BaseClient::fresh();
};

TEST_F(CmdVel, drives_forward) { drive(0.2, 0, 0); }
TEST_F(CmdVel, drives_to_the_left) { drive(0, 0.2, 0); }
TEST_F(CmdVel, turns_counter_clockwise) { drive(0, 0, 0.5); }

TEST_F(CmdVel, tells_the_velocity_in_the_frame_of_the_base) {
  base_.command(twist(0.2, 0, 1));
  base_.go_on(2000);
  for (const nav_msgs::Odometry& message : {base_.odometry, base_.truth}) {
    EXPECT_NEAR(message.twist.twist.linear.x, 0.2, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.linear.y, 0, 0.06) << message.header.frame_id;
    EXPECT_NEAR(message.twist.twist.angular.z, 1, 0.2) << message.header.frame_id;
  }
}

TEST(VelocityCommand, for_one_wheel_leaves_the_others) {
  BaseClient& base = BaseClient::fresh();
  const Wheels forward = Wheels::Constant(4);
  brics_actuator::JointVelocities one = velocity_message(forward, base.clock());
  base.command(one);
  one.velocities = {one.velocities[1]};
  for (int k = 0; k < 500; ++k) base.command(one);
  base.settle();
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(base.joints.velocity[i], 4, 0.2) << kWheelNames[i];
}

constexpr double kTolerance = 1e-9;

/// Torques played over the topic do to the node what they do to a simulation in this process.
class TorquesCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml");
    scene.solver.control_period = 1e-3;
    Simulation simulation(scene);
    simulation.advance_to(3.0);
    expected_ = simulation.state();
    expected_switches_ = simulation.take_switches();
    for (int i = 0; i < kWheels; ++i) {
      for (int k = 0; k < scene.robot.rollers; ++k) expected_rollers_.push_back(simulation.roller_angle(i, k));
    }
    base_ = &BaseClient::fresh();
    const auto torque = make_torque_profile(scene);
    for (int k = 0; k < 3000; ++k) {
      torque->begin_segment(base_->time());
      base_->command(torque_message(torque->value(base_->time()), base_->clock()));
    }
    base_->settle();
  }

  static State expected_;
  static std::vector<RollerSwitch> expected_switches_;
  static std::vector<double> expected_rollers_;
  static BaseClient* base_;
};

State TorquesCommand::expected_;
std::vector<RollerSwitch> TorquesCommand::expected_switches_;
std::vector<double> TorquesCommand::expected_rollers_;
BaseClient* TorquesCommand::base_;

TEST_F(TorquesCommand, end_with_the_same_wheels) {
  const std::vector<std::string> names = {"wheel_joint_fl",  "wheel_joint_fr",  "wheel_joint_bl",  "wheel_joint_br",
                                          "caster_joint_fl", "caster_joint_fr", "caster_joint_bl", "caster_joint_br"};
  ASSERT_EQ(base_->joints.name.size(), 8 + expected_rollers_.size());
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(base_->joints.name[i], names[i]);
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_NEAR(base_->joints.position[i], expected_.phi()[i], kTolerance);
    EXPECT_NEAR(base_->joints.velocity[i], expected_.dphi()[i], kTolerance);
    EXPECT_EQ(base_->joints.position[kWheels + i], 0) << "caster";
  }
}

TEST_F(TorquesCommand, end_with_the_same_rollers) {
  ASSERT_EQ(base_->joints.name.size(), 8 + expected_rollers_.size());
  EXPECT_EQ(base_->joints.name[8], "roller_joint_fl_0");
  EXPECT_EQ(base_->joints.name.back(), "roller_joint_br_5");
  for (std::size_t k = 0; k < expected_rollers_.size(); ++k) {
    EXPECT_NEAR(base_->joints.position[8 + k], expected_rollers_[k], 1e-7) << base_->joints.name[8 + k];
  }
}

TEST_F(TorquesCommand, pass_the_same_switches) {
  wait_for("all switches", [&] { return base_->switches.size() >= expected_switches_.size(); });
  ASSERT_EQ(base_->switches.size(), expected_switches_.size());
  for (std::size_t k = 0; k < expected_switches_.size(); ++k) {
    const RollerSwitch& expected = expected_switches_[k];
    const RollerSwitchStamped& published = base_->switches[k];
    EXPECT_NEAR(published.t, expected.t, kTolerance);
    EXPECT_EQ(published.header.stamp, stamp_of(published.t));
    EXPECT_EQ(published.wheel, wheel_joint(expected.wheel));
    EXPECT_EQ(published.roller_from, expected.roller_from);
    EXPECT_EQ(published.roller_to, expected.roller_to);
    EXPECT_EQ(published.direction, expected.direction);
  }
}

TEST(DelayedCommands, delay_that_makes_no_sense_is_refused) {
  BaseClient& base = BaseClient::fresh();
  SetFaults service;
  service.request.command_delay = -1;
  ASSERT_TRUE(call_service("base_node/set_faults", service));
  EXPECT_FALSE(service.response.success);
  EXPECT_NE(service.response.message.find("command_delay = -1"), std::string::npos) << service.response.message;
  base.command(torque_message(Wheels::Constant(1), {}));
  base.settle();
  EXPECT_EQ(base.joints.effort[0], 1) << "no delay";
}

// The driver's loop takes commands at its cycles of 20 ms.
TEST(CommandRate, commands_wait_for_the_drivers_cycle) {
  BaseClient& base = BaseClient::fresh();
  for (int k = 1; k <= 10; ++k) {
    const double torque = 0.1 * k;
    base.send(torque_message(Wheels::Constant(torque), {}));
    sensor_msgs::JointState first;
    wait_for("the command to act", [&] {
      first = base.joints;
      return first.effort.at(0) == torque;
    });
    // It acts over the control period that begins with a cycle and is published at the period's end.
    const double cycles = (time_of(first.header.stamp) - 1e-3) / 0.02;
    EXPECT_NEAR(cycles, std::round(cycles), 1e-6) << "at " << first.header.stamp;
  }
}

// A time-out, which the driver does not have, stops the wheels when commands stay away.
TEST(CommandTimeout, stops_the_base_and_says_so) {
  BaseClient& base = BaseClient::fresh();
  Log& log = Log::of(base);
  base.reset();
  base.command(twist(0.4, 0, 0));
  base.idle(499);  // which name no wheel: they do not count
  base.settle();
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3);
  base.go_on(501);
  EXPECT_NEAR(base.odometry.twist.twist.linear.x, 0, 0.02);
  log.expect(rosgraph_msgs::Log::WARN, {"no command for 0.5 s", "stopped"});

  base.command(twist(0.4, 0, 0));
  base.go_on(400);
  EXPECT_GT(base.odometry.twist.twist.linear.x, 0.3) << "the next command moves it again";
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
