// Messages and what they mean, without a ROS master.

#include "youbot_base_sim/ros/conversions.h"

#include <gtest/gtest.h>

#include <boost/lexical_cast.hpp>
#include <boost/units/io.hpp>
#include <boost/units/systems/si.hpp>
#include <cmath>

#include "joint_entry.h"
#include "promises/refusals.h"
#include "youbot_base_sim/loop/base_loop.h"

namespace youbot_base_sim {
namespace {

brics_actuator::JointTorques torques(const std::vector<brics_actuator::JointValue>& entries) {
  brics_actuator::JointTorques message;
  message.torques = entries;
  return message;
}

/// Value of the set point of wheel i if there is one and it is of this mode.
std::optional<double> value_of(const WheelCommand& command, int i, DriveMode mode = DriveMode::kTorque) {
  const auto& set_point = command.set_points[i];
  return set_point && set_point->mode == mode ? std::make_optional(set_point->value) : std::nullopt;
}

TEST(Units, are_those_of_boost) {
  namespace si = boost::units::si;
  EXPECT_EQ(kTorqueUnit, boost::lexical_cast<std::string>(si::newton_meters));
  EXPECT_EQ(kVelocityUnit, boost::lexical_cast<std::string>(si::radian_per_second));
}

TEST(Stamp, of_zero_is_valid_ros_time) {
  EXPECT_EQ(stamp_of(0), ros::Time(0, 1));
  EXPECT_EQ(time_of(ros::Time(0, 1)), 0);
}

TEST(Stamp, reads_back_to_the_same_decimal_number) {
  for (int k = 1; k < 100000; k += 7) EXPECT_EQ(time_of(stamp_of(k * 1e-3)), k / 1000.0);
}

TEST(WheelCommand, reads_what_it_writes) {
  const Wheels values(1, -2, 3.5, 0);
  const WheelCommand torque = wheel_command(torque_message(values, ros::Time(1)));
  const WheelCommand velocity = wheel_command(velocity_message(values, ros::Time(1)));
  EXPECT_TRUE(torque.complaints.empty());
  EXPECT_TRUE(velocity.complaints.empty());
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_EQ(value_of(torque, i), values[i]);
    EXPECT_EQ(value_of(velocity, i, DriveMode::kVelocity), values[i]);
  }
}

TEST(WheelCommand, leaves_unnamed_wheels_out) {
  const WheelCommand command = wheel_command(torques({entry("wheel_joint_bl", kTorqueUnit, 2)}));
  EXPECT_TRUE(command.complaints.empty());
  EXPECT_FALSE(command.set_points[0] || command.set_points[1] || command.set_points[3]);
  EXPECT_EQ(value_of(command, 2), 2.0);
}

TEST(WheelCommand, quotes_a_foreign_unit_in_one_short_line) {
  const WheelCommand command =
      wheel_command(torques({entry("wheel_joint_fl", "N\n\033[31mm" + std::string(1000000, 'x'), 1)}));
  ASSERT_EQ(command.complaints.size(), 1u);
  const std::string& text = command.complaints[0].text;
  EXPECT_NE(text.find("\"N\\n\\x1b[31mmxxx"), std::string::npos) << text;
  EXPECT_LT(text.size(), 200u);
}

TEST(WheelCommand, ignores_unknown_joints_and_complains_where_no_joint_is_a_wheel) {
  for (const char* joint : {"", "arm_joint_1", "wheel_joint_", "wheel_joint_fll", "caster_joint_fl", "fl"}) {
    const WheelCommand command = wheel_command(torques({entry(joint, "rad", kNan)}));
    EXPECT_EQ(command.complaints.at(0).text, "names no wheel, such as wheel_joint_fl: nothing changes") << joint;
    for (const auto& set_point : command.set_points) EXPECT_FALSE(set_point) << joint;
  }
}

TEST(WheelCommand, takes_the_first_of_several_with_the_right_unit) {
  const WheelCommand command =
      wheel_command(torques({entry("wheel_joint_fl", "N m", 1), entry("wheel_joint_fl", kTorqueUnit, 2),
                             entry("wheel_joint_fl", kTorqueUnit, 3), entry("arm_joint_1", "rad", 1)}));
  EXPECT_EQ(value_of(command, 0), 2.0);
  EXPECT_EQ(command.complaints.size(), 1u);
}

TEST(WheelCommand, complains_about_a_bounded_number_of_subjects) {
  const auto subject = [](double value) {
    const auto one = entry("wheel_joint_fl", "unit " + std::to_string(value), value);
    return wheel_command(torques({one})).complaints.at(0).subject;
  };
  EXPECT_EQ(subject(1), subject(2));
}

geometry_msgs::Twist twist(double x, double y, double turn) {
  geometry_msgs::Twist message;
  message.linear.x = x;
  message.linear.y = y;
  message.angular.z = turn;
  return message;
}

TEST(TwistCommand, has_the_drivers_wheel_rates) {
  geometry_msgs::Twist message = twist(0.3, 0.2, 0.1);
  message.linear.z = message.angular.x = message.angular.y = kNan;  // ignored
  const WheelCommand command = wheel_command(message, DriverKinematics());
  EXPECT_TRUE(command.complaints.empty());
  // The driver's formulas, of which those on the left have the motor's sign.
  const double R = 0.0475, turn = 0.385 * 0.1;
  const double raw[] = {(-0.3 + 0.2 + turn) / R, (0.3 + 0.2 + turn) / R, (-0.3 - 0.2 + turn) / R,
                        (0.3 - 0.2 + turn) / R};
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_NEAR(value_of(command, i, DriveMode::kVelocity).value(), i % 2 == 0 ? -raw[i] : raw[i], 1e-13) << i;
  }
}

TEST(CovarianceMessage, is_of_x_y_and_yaw) {
  Eigen::Matrix3d covariance;
  covariance << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  const auto message = covariance_message(covariance);
  for (const auto& [at, expected] :
       {std::pair(0, 1), {1, 2}, {5, 3}, {6, 2}, {7, 4}, {11, 5}, {30, 3}, {31, 5}, {35, 6}})
    EXPECT_EQ(message[at], expected) << at;
  for (const int i : {14, 21, 28}) EXPECT_GE(message[i], 1e6) << "z, roll and pitch are unknown";
  EXPECT_EQ(message[2], 0);
}

TEST(OdometryMessage, tells_pose_and_velocity) {
  const auto message = odometry_message("odom", {1, 2, M_PI / 2 + 4 * M_PI}, {3, 4, 5}, ros::Time(6));
  EXPECT_EQ(message.header.frame_id, "odom");
  EXPECT_EQ(message.header.stamp, ros::Time(6));
  EXPECT_EQ(message.child_frame_id, "base_footprint");
  EXPECT_EQ(message.pose.pose.position.x, 1);
  EXPECT_EQ(message.pose.pose.position.y, 2);
  EXPECT_EQ(message.pose.pose.position.z, 0);
  const auto& q = message.pose.pose.orientation;
  EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1, 1e-15);
  EXPECT_NEAR(2 * q.z * q.w, 1, 1e-14) << "sine of the heading";
  EXPECT_EQ(message.twist.twist.linear.x, 3);
  EXPECT_EQ(message.twist.twist.linear.y, 4);
  EXPECT_EQ(message.twist.twist.angular.z, 5);
  for (const double covariance : message.pose.covariance) EXPECT_EQ(covariance, 0);
  const auto twist = odometry_message("odom", {0, 0, 0}, {-0.0, -0.0, -0.0}, ros::Time(1)).twist.twist;
  for (const double rate : {twist.linear.x, twist.linear.y, twist.angular.z}) EXPECT_FALSE(std::signbit(rate));
}

TEST(RollerSwitchMessage, tells_everything) {
  const auto message = roller_switch_message({0.25, 3, 5, 0, -1.5, 1}, ros::Time(7.25));
  EXPECT_EQ(message.header.stamp, ros::Time(7.25));
  EXPECT_EQ(message.header.frame_id, "wheel_link_br");
  EXPECT_EQ(message.wheel, "wheel_joint_br");
  EXPECT_EQ(message.roller_from, 5);
  EXPECT_EQ(message.roller_to, 0);
  EXPECT_EQ(message.direction, 1);
  EXPECT_EQ(message.phi, -1.5);
  EXPECT_EQ(message.t, 0.25);
  EXPECT_EQ(message.count, 1) << "a located one, unless it says otherwise";
  constexpr std::int64_t kMany = 5'000'000'000;  // more than 32 bits hold
  EXPECT_EQ(roller_switch_message({0.25, 0, 0, 2, -1.5, -1, kMany}, ros::Time(7.25)).count, kMany);
  EXPECT_EQ(roller_switch_message({0.25, 0, 0, 2, -1.5, -1, kMany}, ros::Time(7.25)).direction, -1);
}

TEST(WrenchOf, turns_what_odometrys_frame_has_by_that_frames_heading) {
  const FrameNames frames = FrameNames::of("robot", "odom", "base_footprint", "world");
  geometry_msgs::WrenchStamped message;
  message.header.frame_id = "robot/odom";
  message.wrench.force.x = 3;
  const Wrench wrench = wrench_of(message, frames, M_PI / 2);
  EXPECT_TRUE(wrench.fixed);
  EXPECT_NEAR(wrench.force.x(), 0, 1e-15);
  EXPECT_NEAR(wrench.force.y(), 3, 1e-15);
  message.header.frame_id = "world";
  EXPECT_EQ(wrench_of(message, frames, M_PI / 2).force.x(), 3);
  for (const char* other : {"odom", "base_link"}) {
    message.header.frame_id = other;
    EXPECT_THROW(wrench_of(message, frames), std::runtime_error) << other << " is another robot's";
  }
}

// Refusals: one line, and the base goes on as if the command had not come.

const double kNoNumbers[] = {kNan, -kNan, kInf, -kInf};

std::vector<std::string> wrong_units(const std::string& right, const std::string& other) {
  return {"",   other, right + " ",   " " + right,  right.substr(1),    "rad s^-1",
          "Nm", "N m", "m^2 kg s^-2", right + "\n", "\033[31m" + right, std::string(100000, 'u')};
}

/// Expects that no wheel has a set point, and one complaint that may be logged and has `parts`.
void expect_refused(const WheelCommand& command, const std::vector<std::string>& parts = {}) {
  for (const auto& set_point : command.set_points) EXPECT_FALSE(set_point);
  ASSERT_EQ(command.complaints.size(), 1u);
  expect_refusal(command.complaints[0].text, parts);
  expect_refusal(command.complaints[0].subject, {});
}

template <class Message>
struct Entries;
template <>
struct Entries<brics_actuator::JointTorques> {
  static constexpr const char* kUnit = kTorqueUnit;
  static constexpr const char* kOther = kVelocityUnit;
  static auto& of(brics_actuator::JointTorques& message) { return message.torques; }
};
template <>
struct Entries<brics_actuator::JointVelocities> {
  static constexpr const char* kUnit = kVelocityUnit;
  static constexpr const char* kOther = kTorqueUnit;
  static auto& of(brics_actuator::JointVelocities& message) { return message.velocities; }
};

template <class Message>
class JointCommandTest : public testing::Test {
 protected:
  static Message of(std::vector<brics_actuator::JointValue> values) {
    Message message;
    Entries<Message>::of(message) = std::move(values);
    return message;
  }
};
using Messages = testing::Types<brics_actuator::JointTorques, brics_actuator::JointVelocities>;
TYPED_TEST_SUITE(JointCommandTest, Messages, );

TYPED_TEST(JointCommandTest, RefusesWhatIsNoCommand) {
  using E = Entries<TypeParam>;
  int cases = 0;
  for (int i = 0; i < kWheels; ++i) {
    for (const double value : kNoNumbers) {
      expect_refused(wheel_command(this->of({entry(wheel_joint(i), E::kUnit, value)})), {wheel_joint(i)});
      ++cases;
    }
    for (const std::string& unit : wrong_units(E::kUnit, E::kOther)) {
      expect_refused(wheel_command(this->of({entry(wheel_joint(i), unit, 1)})), {wheel_joint(i), E::kUnit});
      ++cases;
    }
  }
  expect_refused(wheel_command(TypeParam()));
  EXPECT_GE(cases, 50);
}

TYPED_TEST(JointCommandTest, TakesTheGoodEntriesBesideTheBad) {
  using E = Entries<TypeParam>;
  for (const double value : kNoNumbers) {
    for (const std::string& unit : wrong_units(E::kUnit, E::kOther)) {
      const WheelCommand command =
          wheel_command(this->of({entry("wheel_joint_fl", E::kUnit, value), entry("wheel_joint_fr", unit, 1),
                                  entry("arm_joint_1", unit, value), entry(std::string(1000, 'j'), E::kUnit, 1),
                                  entry("wheel_joint_br", E::kUnit, 0.5)}));
      EXPECT_FALSE(command.set_points[0] || command.set_points[1] || command.set_points[2]);
      ASSERT_TRUE(command.set_points[3]);
      EXPECT_EQ(command.set_points[3]->value, 0.5);
      EXPECT_EQ(command.complaints.size(), 2u);
      for (const Complaint& complaint : command.complaints) expect_refusal(complaint.text, {});
    }
  }
}

TEST(TwistTest, RefusesWhatIsNoVelocity) {
  for (const double value : {kNan, -kNan, kInf, -kInf, 1.7e308, -1.7e308}) {
    expect_refused(wheel_command(twist(value, 0, 0), {}));
    expect_refused(wheel_command(twist(0, value, 0), {}));
    expect_refused(wheel_command(twist(0, 0, value), {}));
  }
}

// However large: the motors' limits come later.
TEST(TwistTest, MakesRatesThatAreNumbers) {
  const double huge = std::numeric_limits<double>::max();
  for (const double x : {-huge, 0.0, huge}) {
    for (const double y : {-huge, 0.0, huge}) {
      for (const double turn : {-huge, 0.0, huge}) {
        SCOPED_TRACE(testing::Message() << x << ", " << y << ", " << turn);
        for (const auto& set_point : wheel_command(twist(x, y, turn), {}).set_points) {
          EXPECT_TRUE(!set_point || std::isfinite(set_point->value)) << set_point->value;
        }
      }
    }
  }
}

LoopSettings settings() {
  LoopSettings settings;
  settings.scene.solver.control_period = 1e-3;
  return settings;
}

// The largest that messages can carry, one after the other: clipped, and the motion is finite.
TEST(BaseLoopTest, GoesOnWithTheLargestCommands) {
  BaseLoop loop(settings());
  for (const double size : {1e3, 1e10, 1e100, 1e308}) {
    for (const double sign : {1.0, -1.0}) {
      const double value = sign * size;
      loop.push(loop.time(), wheel_command(torque_message({value, -value, value, value}, ros::Time())).set_points);
      loop.advance_periods(5);
      loop.push(loop.time(), wheel_command(velocity_message({value, -value, value, value}, ros::Time())).set_points);
      loop.advance_periods(5);
      loop.push(loop.time(), wheel_command(twist(value, -value, value), {}).set_points);
      loop.advance_periods(5);
      ASSERT_TRUE(loop.simulation().state().values.allFinite());
      EXPECT_LE(loop.simulation().torque().abs().maxCoeff(), 3.1);
    }
  }
}

// Nothing of what is refused reaches the base: it stays where it was held, to the last bit.
TEST(BaseLoopTest, GoesOnAsIfNothingHadCome) {
  const auto end = [](bool disturbed) {
    BaseLoop loop(settings());
    loop.push(0, wheel_command(velocity_message({3, 4, -2, 3}, ros::Time())).set_points);
    for (int k = 0; k < 100; ++k) {
      if (disturbed) {
        const double value = kNoNumbers[k % 4];
        loop.push(loop.time(), wheel_command(torque_message({value, value, value, value}, ros::Time())).set_points);
        loop.push(loop.time(), wheel_command(twist(value, 0, 0), {}).set_points);
        loop.push(loop.time(), wheel_command(brics_actuator::JointVelocities()).set_points);
      }
      loop.advance_periods(1);
    }
    return loop.simulation().state();
  };
  EXPECT_TRUE((end(true).values == end(false).values).all());
}

// The topic `contacts`.

Scene sideways(Model model = Model::kCoulomb) {
  return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml", {{"model", name_of(model)}});
}

ContactsStamped contacts_at(double t, const Scene& scene) {
  Simulation simulation(scene);
  simulation.advance_to(t);
  return contacts_message(simulation, stamp_of(t));
}

TEST(ContactsMessage, tells_where_and_how_the_wheels_stand) {
  const Scene scene = sideways();
  const RobotParameters& robot = scene.robot;
  Simulation simulation(scene);
  simulation.advance_to(1.5);
  const ContactsStamped message = contacts_message(simulation, stamp_of(1.5));
  EXPECT_EQ(message.header.stamp, ros::Time(1.5));
  EXPECT_EQ(message.header.frame_id, "base_footprint");
  EXPECT_EQ(message.t, 1.5);
  EXPECT_EQ(message.kinetic_energy, simulation.kinetic_energy());
  ASSERT_EQ(message.contacts.size(), 4u);
  double weight = 0;
  for (int i = 0; i < kWheels; ++i) {
    const Contact& contact = message.contacts[i];
    SCOPED_TRACE(contact.wheel);
    EXPECT_EQ(contact.wheel, wheel_joint(i));
    EXPECT_EQ(contact.position.x, robot.rho_X()[i]);
    // The contact point wanders along the axle by R_d tan(delta) tan(phi~): by 20 mm to either side.
    EXPECT_NEAR(contact.position.y, robot.rho_Y()[i], robot.R_d * std::tan(M_PI / robot.rollers));
    EXPECT_NE(contact.position.y, robot.rho_Y()[i]);
    EXPECT_EQ(contact.position.z, -0.084);
    EXPECT_EQ(contact.roller, simulation.rollers()[i]);
    EXPECT_EQ(contact.other_roller, -1);
    EXPECT_EQ(contact.torque, simulation.torque()[i]);
    // Friction acts against slip, within its limit.
    const auto &slip = contact.slip_velocity, &force = contact.friction_force;
    EXPECT_LT(slip.x * force.x + slip.y * force.y, 0);
    EXPECT_NEAR(slip.x * force.y - slip.y * force.x, 0, 1e-9 * std::hypot(slip.x, slip.y));
    EXPECT_NEAR(contact.friction_share, std::hypot(force.x, force.y) / (0.5 * contact.normal_force), 1e-12);
    EXPECT_GT(contact.friction_share, 0);
    EXPECT_LE(contact.friction_share, 1);
    weight += contact.normal_force;
  }
  EXPECT_NEAR(weight, robot.m_s() * 9.81, 1e-9);
}

TEST(ContactsMessage, knows_what_a_model_does_not) {
  for (const Model model : {Model::kNoSlip, Model::kViscous}) {
    const ContactsStamped message = contacts_at(1, sideways(model));
    for (const Contact& contact : message.contacts) {
      EXPECT_EQ(contact.friction_share, 0);
      EXPECT_GT(contact.normal_force, 0);
      EXPECT_EQ(contact.friction_force.x == 0, model == Model::kNoSlip);
    }
    EXPECT_GT(message.drive_power, 0);
    EXPECT_EQ(message.floor_power == 0, model == Model::kNoSlip);
  }
}

TEST(ContactsMessage, tells_both_rollers_of_a_wheel_between_two) {
  const TemporaryFolder folder;
  Simulation simulation(load_scene(
      folder.write("scene.yaml",
                   "duration: 10\ndrive: {torque: [{start: 0, constant: [-1.6608860541984796, 0.6423426008195765, "
                   "1.6391085502068918, 1.12921153639236]}]}\n")));
  int held = 0;
  for (int k = 0; k < 1000; ++k) {
    simulation.advance_to(0.01 * k);
    const ContactsStamped message = contacts_message(simulation, ros::Time(1));
    for (int i = 0; i < kWheels; ++i) {
      const int other = simulation.other_rollers()[i].value_or(-1);
      EXPECT_EQ(message.contacts[i].other_roller, other);
      if (other >= 0) ++held;
    }
  }
  EXPECT_GT(held, 0);
}

}  // namespace
}  // namespace youbot_base_sim
