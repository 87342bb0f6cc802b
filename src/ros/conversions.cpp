#include "youbot_base_sim/ros/conversions.h"

#include <fmt/format.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include <algorithm>
#include <bitset>
#include <cmath>

#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

constexpr double kUnknownVariance = 1e6;  // m^2, rad^2 and so on: of the components that planar odometry cannot measure

geometry_msgs::Quaternion quaternion(double heading) { return tf2::toMsg(tf2::Quaternion({0, 0, 1}, heading)); }

/// Number of the wheel whose joint is called `joint`; -1 if none is.
int wheel_of(const std::string& joint) {
  if (joint.rfind(kWheelJointPrefix, 0) != 0) return -1;
  const auto suffix = joint.substr(sizeof(kWheelJointPrefix) - 1);
  const auto found = std::find(kWheelNames.begin(), kWheelNames.end(), suffix);
  return found == kWheelNames.end() ? -1 : static_cast<int>(found - kWheelNames.begin());
}

WheelCommand read(const std::vector<brics_actuator::JointValue>& entries, const std::string& unit, DriveMode mode) {
  WheelCommand command;
  if (entries.empty()) command.complaints.push_back({"empty", "names no joint at all: nothing changes"});
  std::bitset<kWheels> seen;
  for (const auto& entry : entries) {
    const int i = wheel_of(entry.joint_uri);
    if (i < 0) continue;
    if (entry.unit != unit) {
      command.complaints.push_back({entry.joint_uri + " unit", fmt::format("{}: unit \"{}\" is not \"{}\": skipped",
                                                                           entry.joint_uri, quote(entry.unit), unit)});
      continue;
    }
    if (seen[i]) continue;
    seen[i] = true;
    if (std::isfinite(entry.value)) {
      command.set_points[i] = SetPoint{mode, entry.value};
    } else {
      command.complaints.push_back({entry.joint_uri + " value",
                                    fmt::format("{}: {} is not a finite number: refused, the joint keeps its set point",
                                                entry.joint_uri, entry.value)});
    }
  }
  return command;
}

std::vector<brics_actuator::JointValue> entries(const Wheels& values, const std::string& unit, const ros::Time& stamp) {
  std::vector<brics_actuator::JointValue> entries(kWheels);
  for (int i = 0; i < kWheels; ++i) {
    entries[i].timeStamp = stamp;
    entries[i].joint_uri = wheel_joint(i);
    entries[i].unit = unit;
    entries[i].value = values[i];
  }
  return entries;
}

}  // namespace

ros::Time stamp_of(double t) { return std::max(ros::Time(t), ros::TIME_MIN); }

double time_of(const ros::Time& stamp) {
  return stamp <= ros::TIME_MIN ? 0 : static_cast<double>(stamp.toNSec()) / 1e9;
}

std::string wheel_joint(int i) { return std::string(kWheelJointPrefix) + kWheelNames[i]; }

nav_msgs::Odometry odometry_message(const std::string& frame, const Eigen::Vector3d& pose,
                                    const Eigen::Vector3d& velocity, const ros::Time& stamp) {
  nav_msgs::Odometry message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  message.child_frame_id = kBaseFrame;
  message.pose.pose.position.x = pose[0];
  message.pose.pose.position.y = pose[1];
  message.pose.pose.orientation = quaternion(pose[2]);
  message.twist.twist.linear.x = velocity[0] + 0.0;  // not -0 at rest
  message.twist.twist.linear.y = velocity[1] + 0.0;
  message.twist.twist.angular.z = velocity[2] + 0.0;
  return message;
}

sensor_msgs::Imu imu_message(const Imu& imu, const ros::Time& stamp) {
  constexpr double kLevelVariance = 1e-6;  // of roll and pitch, rad^2, and of the rates about x and y, rad^2/s^2
  sensor_msgs::Imu message;
  message.header.stamp = stamp;
  message.header.frame_id = kBaseFrame;
  message.orientation = quaternion(imu.heading());
  message.angular_velocity.z = imu.rate();
  message.linear_acceleration.x = imu.acceleration()[0];
  message.linear_acceleration.y = imu.acceleration()[1];
  message.linear_acceleration.z = imu.acceleration()[2];
  message.orientation_covariance = {
      kLevelVariance, 0, 0, 0, kLevelVariance, 0, 0, 0, imu.heading_variance() + kLevelVariance};
  message.angular_velocity_covariance = {kLevelVariance, 0, 0, 0, kLevelVariance, 0, 0, 0, imu.rate_variance()};
  const double variance = imu.acceleration_variance();
  message.linear_acceleration_covariance = {variance, 0, 0, 0, variance, 0, 0, 0, variance};
  return message;
}

boost::array<double, 36> covariance_message(const Eigen::Matrix3d& covariance) {
  constexpr int kAt[] = {0, 1, 5};  // of x, y, z and the turns about them
  boost::array<double, 36> message{};
  for (const int i : {2, 3, 4}) message[7 * i] = kUnknownVariance;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) message[6 * kAt[i] + kAt[j]] = covariance(i, j);
  }
  return message;
}

geometry_msgs::TransformStamped transform_message(const std::string& frame, const std::string& child,
                                                  const Eigen::Vector3d& pose, const ros::Time& stamp) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = frame;
  message.child_frame_id = child;
  message.transform.translation.x = pose[0];
  message.transform.translation.y = pose[1];
  message.transform.rotation = quaternion(pose[2]);
  return message;
}

RollerSwitchStamped roller_switch_message(const RollerSwitch& event, const ros::Time& stamp) {
  RollerSwitchStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = std::string(kWheelFramePrefix) + kWheelNames[event.wheel];
  message.wheel = wheel_joint(event.wheel);
  message.roller_from = static_cast<std::uint8_t>(event.roller_from);
  message.roller_to = static_cast<std::uint8_t>(event.roller_to);
  message.direction = static_cast<std::int8_t>(event.direction);
  message.phi = event.phi;
  message.t = event.t;
  message.count = event.count;
  return message;
}

WheelCommand wheel_command(const brics_actuator::JointTorques& message) {
  return read(message.torques, kTorqueUnit, DriveMode::kTorque);
}

WheelCommand wheel_command(const brics_actuator::JointVelocities& message) {
  return read(message.velocities, kVelocityUnit, DriveMode::kVelocity);
}

WheelCommand wheel_command(const geometry_msgs::Twist& message, const DriverKinematics& kinematics) {
  WheelCommand command;
  const Eigen::Vector3d velocity(message.linear.x, message.linear.y, message.angular.z);
  const Wheels rates = kinematics.wheel_rates(velocity);
  if (!rates.allFinite()) {
    const std::string reason = velocity.allFinite() ? "is too large" : "is not finite";
    command.complaints.push_back({"value", fmt::format("({}, {}, {}) {}: refused, the base goes on as before",
                                                       velocity[0], velocity[1], velocity[2], reason)});
    return command;
  }
  for (int i = 0; i < kWheels; ++i) command.set_points[i] = SetPoint{DriveMode::kVelocity, rates[i]};
  return command;
}

brics_actuator::JointTorques torque_message(const Wheels& torque, const ros::Time& stamp) {
  brics_actuator::JointTorques message;
  message.torques = entries(torque, kTorqueUnit, stamp);
  return message;
}

brics_actuator::JointVelocities velocity_message(const Wheels& rate, const ros::Time& stamp) {
  brics_actuator::JointVelocities message;
  message.velocities = entries(rate, kVelocityUnit, stamp);
  return message;
}

}  // namespace youbot_base_sim
