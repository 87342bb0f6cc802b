#pragma once

#include <brics_actuator/JointTorques.h>
#include <brics_actuator/JointVelocities.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Twist.h>
#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <std_msgs/String.h>
#include <youbot_base_sim/ContactsStamped.h>
#include <youbot_base_sim/LoadsStamped.h>
#include <youbot_base_sim/RollerSwitchStamped.h>
#include <youbot_base_sim/SetFaults.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/loop/base_requests.h"
#include "youbot_base_sim/ros/frame_names.h"
#include "youbot_base_sim/sensors/imu.h"
#include "youbot_base_sim/simulation.h"

/// Conversions between simulation and messages, as pure functions. Wheel joints have the sign of the URDF and of the
/// paper: positive drives forward. (The real driver's left motors turn the other way, but not its joint positions.)
/// Points of loads and wrenches count from O at the height of the axles, those in messages from base_link's origin.
/// `frames` that are left out are the driver's.
namespace youbot_base_sim {

/// Units of commands, as boost::units writes them, which is what the driver compares with: N m/rad and rad/s.
constexpr char kTorqueUnit[] = "m^2 kg s^-2 rad^-1";
constexpr char kVelocityUnit[] = "s^-1 rad";

/// Simulated time t (s) as a stamp. ROS reads time zero as "no time yet" and rosbag refuses it, so t = 0 becomes 1 ns.
ros::Time stamp_of(double t);

/// The inverse of `stamp_of`, s: the double nearest to the stamp's decimal number; 0 for 1 ns.
double time_of(const ros::Time& stamp);

/// A message of three numbers: geometry_msgs/Point, geometry_msgs/Vector3.
template <class Message>
Message vector_message(const Eigen::Vector3d& vector) {
  Message message;
  message.x = vector.x();
  message.y = vector.y();
  message.z = vector.z();
  return message;
}

/// The inverse of `vector_message`.
template <class Message>
Eigen::Vector3d vector_of(const Message& message) {
  return {message.x, message.y, message.z};
}

/// `wheel_joint_fl` and so on, for wheel i.
std::string wheel_joint(int i);

/// Pose x, y (m), heading (rad) in `frame`; velocity V_X, V_Y (m/s), Omega (rad/s) in the base's own frame, `child`.
/// Covariances are zero, as the driver's.
nav_msgs::Odometry odometry_message(const std::string& frame, const Eigen::Vector3d& pose,
                                    const Eigen::Vector3d& velocity, const ros::Time& stamp,
                                    const std::string& child = kBaseFrame);

/// The readings of the unit, in the base's frame; roll and pitch are zero.
sensor_msgs::Imu imu_message(const Imu& imu, const ros::Time& stamp, const std::string& frame = kBaseFrame);

/// Covariance of x, y, heading, or of V_X, V_Y, Omega, as one of six degrees of freedom, the three others unknown.
boost::array<double, 36> covariance_message(const Eigen::Matrix3d& covariance);

/// Pose x, y (m), heading (rad) of the frame `child` in `frame`.
geometry_msgs::TransformStamped transform_message(const std::string& frame, const std::string& child,
                                                  const Eigen::Vector3d& pose, const ros::Time& stamp);

/// `stamp` is that of the switch; of many in one record, of when the last one was noticed.
RollerSwitchStamped roller_switch_message(const RollerSwitch& event, const ros::Time& stamp,
                                          const FrameNames& frames = {});

/// The present state of the four contacts, and where the power goes.
ContactsStamped contacts_message(const Simulation& simulation, const ros::Time& stamp,
                                 const std::string& frame = kBaseFrame);

/// The force of a wrench on a base at heading psi (rad) in the platform's frame, N.
Eigen::Vector3d platform_force(const Wrench& wrench, double psi);

/// The sum of wrenches on a base at heading psi (rad): force and torque in base_link, about its origin.
geometry_msgs::WrenchStamped wrench_message(const std::vector<Wrench>& wrenches, double psi, const ros::Time& stamp,
                                            const std::string& frame = kBaseLinkFrame);

/// The text of `provenance`, then the scene as YAML.
std_msgs::String scene_message(const Scene& scene);

LoadsStamped loads_message(const std::vector<Load>& loads, const ros::Time& stamp,
                           const std::string& frame = kBaseLinkFrame);

/// A wrench message as the simulation has it. Frames base_link, base_footprint and none are the platform's. In `world`
/// and `odom`, which has the heading odom_psi (rad), the force keeps its direction in the fixed frame, but still acts
/// at the origin of base_link. Throws std::runtime_error, a line that names the field, for what cannot be taken; so do
/// the next two.
Wrench wrench_of(const geometry_msgs::WrenchStamped& message, const FrameNames& frames = {}, double odom_psi = 0);

std::vector<Load> loads_of(const SetLoads::Request& request);

Faults faults_of(const SetFaults::Request& request);

/// `odom`: pose x, y (m), heading (rad) of that frame in the scene's. Throws as the above.
StateRequest state_of(const SetState::Request& request, const FrameNames& frames, const Eigen::Vector3d& odom);

/// The base at rest at this pose, whatever its covariance.
StateRequest state_of(const geometry_msgs::PoseWithCovarianceStamped& message, const FrameNames& frames,
                      const Eigen::Vector3d& odom);

/// A warning about an ignored part of a command.
struct Complaint {
  std::string subject;  ///< one of a small set of names, by which the log is throttled
  std::string text;     ///< the sentence for the log
};

/// A command message as set points. A wheel that it does not name has none and keeps its previous one.
struct WheelCommand {
  DriveCommand set_points;  ///< all values finite
  std::vector<Complaint> complaints;
};

/// Reads a command as the driver does. Each joint's first entry with `kTorqueUnit` or `kVelocityUnit`, to the letter,
/// counts. Another unit, a value that is not finite, and a message without entries are complaints; joints other than
/// the wheels', time stamps and poison stamps are ignored.
WheelCommand wheel_command(const brics_actuator::JointTorques& message);
WheelCommand wheel_command(const brics_actuator::JointVelocities& message);

/// Converts a twist to the rates of all wheels by `kinematics`. Only linear.x, linear.y and angular.z are read, as by
/// the driver. If a rate would not be finite, the twist is refused with a complaint.
WheelCommand wheel_command(const geometry_msgs::Twist& message, const DriverKinematics& kinematics);

/// Commands for all four wheels, N m and rad/s.
brics_actuator::JointTorques torque_message(const Wheels& torque, const ros::Time& stamp);
brics_actuator::JointVelocities velocity_message(const Wheels& rate, const ros::Time& stamp);

}  // namespace youbot_base_sim
