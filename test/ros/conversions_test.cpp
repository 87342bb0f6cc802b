// Messages and what they mean, without a ROS master.

#include "youbot_base_sim/ros/conversions.h"

#include <gtest/gtest.h>

#include <boost/lexical_cast.hpp>
#include <boost/units/io.hpp>
#include <boost/units/systems/si.hpp>
#include <cmath>

#include "joint_entry.h"

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

TEST(WheelCommand, takes_the_unit_to_the_letter) {
  for (const char* unit : {"", "N m", "m^2 kg s^-2", "m^2 kg s^-2 rad^-1 ", kVelocityUnit}) {
    const WheelCommand command =
        wheel_command(torques({entry("wheel_joint_fl", unit, 1), entry("wheel_joint_fr", kTorqueUnit, 1)}));
    EXPECT_FALSE(command.set_points[0]) << unit;
    EXPECT_EQ(value_of(command, 1), 1.0) << unit;
    ASSERT_EQ(command.complaints.size(), 1u) << unit;
    EXPECT_NE(command.complaints[0].text.find("wheel_joint_fl"), std::string::npos);
    EXPECT_NE(command.complaints[0].text.find(kTorqueUnit), std::string::npos);
  }
}

TEST(WheelCommand, refuses_what_is_not_finite) {
  for (const double value : {kNan, kInf, -kInf}) {
    const WheelCommand command =
        wheel_command(torques({entry("wheel_joint_fl", kTorqueUnit, value), entry("wheel_joint_fr", kTorqueUnit, 1)}));
    EXPECT_FALSE(command.set_points[0]) << value;
    EXPECT_EQ(value_of(command, 1), 1.0) << value;
    ASSERT_EQ(command.complaints.size(), 1u) << value;
    EXPECT_NE(command.complaints[0].text.find("wheel_joint_fl"), std::string::npos);
  }
}

TEST(WheelCommand, ignores_unknown_joints_without_a_word) {
  for (const char* joint : {"", "arm_joint_1", "wheel_joint_", "wheel_joint_fll", "caster_joint_fl", "fl"}) {
    const WheelCommand command = wheel_command(torques({entry(joint, "rad", kNan)}));
    EXPECT_TRUE(command.complaints.empty()) << joint;
    for (const auto& set_point : command.set_points) EXPECT_FALSE(set_point) << joint;
  }
}

TEST(WheelCommand, takes_the_first_of_several_with_the_right_unit) {
  const WheelCommand command =
      wheel_command(torques({entry("wheel_joint_fl", "N m", 1), entry("wheel_joint_fl", kTorqueUnit, 2),
                             entry("wheel_joint_fl", kTorqueUnit, 3)}));
  EXPECT_EQ(value_of(command, 0), 2.0);
  EXPECT_EQ(command.complaints.size(), 1u);
}

TEST(WheelCommand, complains_once_about_nothing_at_all) {
  EXPECT_EQ(wheel_command(brics_actuator::JointTorques()).complaints.size(), 1u);
  EXPECT_EQ(wheel_command(brics_actuator::JointVelocities()).complaints.size(), 1u);
}

TEST(WheelCommand, complains_about_a_bounded_number_of_subjects) {
  const auto subject = [](double value) {
    return wheel_command(torques({entry("wheel_joint_fl", "unit " + std::to_string(value), value)}))
        .complaints.at(0)
        .subject;
  };
  EXPECT_EQ(subject(1), subject(2));
}

TEST(TwistCommand, has_the_drivers_wheel_rates) {
  geometry_msgs::Twist twist;
  twist.linear.x = 0.3;
  twist.linear.y = 0.2;
  twist.angular.z = 0.1;
  twist.linear.z = twist.angular.x = twist.angular.y = kNan;  // ignored
  const WheelCommand command = wheel_command(twist, DriverKinematics());
  EXPECT_TRUE(command.complaints.empty());
  // The driver's formulas, of which those on the left have the motor's sign.
  const double R = 0.0475, turn = 0.385 * 0.1;
  const double raw[] = {(-0.3 + 0.2 + turn) / R, (0.3 + 0.2 + turn) / R, (-0.3 - 0.2 + turn) / R,
                        (0.3 - 0.2 + turn) / R};
  for (int i = 0; i < kWheels; ++i) {
    EXPECT_NEAR(value_of(command, i, DriveMode::kVelocity).value(), i % 2 == 0 ? -raw[i] : raw[i], 1e-13) << i;
  }
}

TEST(TwistCommand, is_refused_where_a_rate_would_not_be_finite) {
  const auto expect_refused = [](const geometry_msgs::Twist& twist) {
    const WheelCommand command = wheel_command(twist, DriverKinematics());
    for (const auto& set_point : command.set_points) EXPECT_FALSE(set_point);
    EXPECT_EQ(command.complaints.size(), 1u);
  };
  for (const double value : {kNan, kInf, -kInf, 1.7e308, -1.7e308}) {
    geometry_msgs::Twist twist;
    twist.linear.x = value;
    expect_refused(twist);
    twist.linear.x = 0;
    twist.linear.y = value;
    expect_refused(twist);
    twist.linear.y = 0;
    twist.angular.z = value;
    expect_refused(twist);
  }
}

TEST(CovarianceMessage, is_of_x_y_and_yaw) {
  Eigen::Matrix3d covariance;
  covariance << 1, 2, 3, 2, 4, 5, 3, 5, 6;
  const auto message = covariance_message(covariance);
  EXPECT_EQ(message[0], 1);
  EXPECT_EQ(message[1], 2);
  EXPECT_EQ(message[5], 3);
  EXPECT_EQ(message[6], 2);
  EXPECT_EQ(message[7], 4);
  EXPECT_EQ(message[11], 5);
  EXPECT_EQ(message[30], 3);
  EXPECT_EQ(message[31], 5);
  EXPECT_EQ(message[35], 6);
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
}

TEST(OdometryMessage, has_no_negative_zero) {
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
}

TEST(RollerSwitchMessage, may_stand_for_many) {
  constexpr std::int64_t kMany = 5'000'000'000;  // more than 32 bits hold
  const auto message = roller_switch_message({0.25, 0, 0, 2, -1.5, -1, kMany}, ros::Time(7.25));
  EXPECT_EQ(message.count, kMany);
  EXPECT_EQ(message.direction, -1);
  EXPECT_EQ(message.roller_from, 0);
  EXPECT_EQ(message.roller_to, 2);
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

}  // namespace
}  // namespace youbot_base_sim
