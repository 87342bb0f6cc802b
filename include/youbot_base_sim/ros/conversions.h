#pragma once

#include <brics_actuator/JointTorques.h>
#include <brics_actuator/JointVelocities.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <youbot_base_sim/RollerSwitchStamped.h>

#include <Eigen/Dense>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/physics/roller_switch.h"
#include "youbot_base_sim/physics/state.h"
#include "youbot_base_sim/ros/node_constants.h"

/// Between simulation and messages: pure functions. Wheels and their joints have one sign everywhere, that of the URDF
/// and of the paper: positive drives forward, on all four wheels. (The real driver's motors on the left turn the other
/// way round; its joint positions have the sign used here.)
namespace youbot_base_sim {

/// Units of commands, as boost::units writes them, which is what the driver compares with: N m/rad and rad/s.
constexpr char kTorqueUnit[] = "m^2 kg s^-2 rad^-1";
constexpr char kVelocityUnit[] = "s^-1 rad";

/// Simulated time t (s) as a stamp. ROS takes time zero for "no time yet", and rosbag refuses it: the instant t = 0 is
/// therefore written as 1 ns.
ros::Time stamp_of(double t);

/// The simulated time that a stamp from `stamp_of` tells, s: the double nearest to its decimal number; 0 for 1 ns.
double time_of(const ros::Time& stamp);

/// `wheel_joint_fl` and so on, for wheel i.
std::string wheel_joint(int i);

/// Pose x, y (m), heading (rad) in `frame`; velocity V_X, V_Y (m/s), Omega (rad/s) in the base's own frame. Covariances
/// are zero, as the driver's.
nav_msgs::Odometry odometry_message(const std::string& frame, const Eigen::Vector3d& pose,
                                    const Eigen::Vector3d& velocity, const ros::Time& stamp);

/// Covariance of x, y, heading, or of V_X, V_Y, Omega, as one of six degrees of freedom; the three others do not vary.
boost::array<double, 36> covariance_message(const Eigen::Matrix3d& covariance);

/// Pose x, y (m), heading (rad) of the frame `child` in `frame`.
geometry_msgs::TransformStamped transform_message(const std::string& frame, const std::string& child,
                                                  const Eigen::Vector3d& pose, const ros::Time& stamp);

/// `stamp` is that of the instant when the switch happened; of many in one record, when the last one was noticed.
RollerSwitchStamped roller_switch_message(const RollerSwitch& event, const ros::Time& stamp);

/// A part of a command that is not obeyed, or not to the letter.
struct Complaint {
  std::string subject;  ///< what it is about, one of a small set: for not saying the same a thousand times a second
  std::string text;     ///< the sentence for the log
};

/// What a command message says about each wheel; nothing for a wheel that it does not name, which keeps its set point.
struct WheelCommand {
  DriveCommand set_points;  ///< of finite values
  std::vector<Complaint> complaints;
};

/// Reads a command as the driver does: an entry counts if its unit is `kTorqueUnit` or `kVelocityUnit` to the letter,
/// else it is skipped with a complaint; joints other than the wheels' are ignored without a word; of several entries
/// for one joint the first with the right unit counts; a value that is not finite is refused with a complaint; no
/// entries at all are one complaint. Time stamps and poison stamps are ignored.
WheelCommand wheel_command(const brics_actuator::JointTorques& message);
WheelCommand wheel_command(const brics_actuator::JointVelocities& message);

/// The same for the rates of all wheels, by `kinematics`, that a twist commands. Of the twist V_X, V_Y and Omega count,
/// as in the driver; if one of the three is not finite, the twist is refused with a complaint.
WheelCommand wheel_command(const geometry_msgs::Twist& message, const DriverKinematics& kinematics);

/// Commands for all four wheels, N m and rad/s.
brics_actuator::JointTorques torque_message(const Wheels& torque, const ros::Time& stamp);
brics_actuator::JointVelocities velocity_message(const Wheels& rate, const ros::Time& stamp);

}  // namespace youbot_base_sim
