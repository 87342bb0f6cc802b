#include "youbot_base_sim/ros/conversions.h"

#include <fmt/format.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <stdexcept>
#include <utility>

#include "youbot_base_sim/scene/frames.h"
#include "youbot_base_sim/scene/load_schedule.h"
#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

/// Position of the origin of base_link, from O at the height of the axles, m.
const Eigen::Vector3d kBaseLinkOrigin{0, 0, -kAxleHeight};

constexpr double kUnknownVariance = 1e6;  // m^2, rad^2 and so on: of the components that planar odometry cannot measure

template <class Message>
Message stamped(const std::string& frame, const ros::Time& stamp) {
  Message message;
  message.header.frame_id = frame;
  message.header.stamp = stamp;
  return message;
}

geometry_msgs::Vector3 vector3(const Eigen::Vector3d& vector) { return vector_message<geometry_msgs::Vector3>(vector); }

geometry_msgs::Quaternion quaternion(double heading) {
  const auto [sine, cosine] = sine_and_cosine(0.5 * heading);
  return tf2::toMsg(tf2::Quaternion(0, 0, sine, cosine));
}

/// The wheel of a joint; -1 if it is none's.
int wheel_of(const std::string& joint) {
  int i = kWheels - 1;
  while (i >= 0 && joint != wheel_joint(i)) --i;
  return i;
}

WheelCommand read(const std::vector<brics_actuator::JointValue>& entries, const std::string& unit, DriveMode mode) {
  WheelCommand command;
  if (std::none_of(entries.begin(), entries.end(), [](const auto& entry) { return wheel_of(entry.joint_uri) >= 0; }))
    command.complaints.push_back({"empty", "names no wheel, such as " + wheel_joint(0) + ": nothing changes"});
  std::array<bool, kWheels> seen{};
  for (const auto& entry : entries) {
    const int i = wheel_of(entry.joint_uri);
    if (i < 0) continue;
    const auto complain = [&](const char* part, const std::string& text) {
      command.complaints.push_back({entry.joint_uri + part, entry.joint_uri + ": " + text});
    };
    if (entry.unit != unit) {
      complain(" unit", fmt::format("unit \"{}\" is not \"{}\": skipped", quote(entry.unit), unit));
    } else if (std::exchange(seen[i], true)) {
      continue;
    } else if (std::isfinite(entry.value)) {
      command.set_points[i] = SetPoint{mode, entry.value};
    } else {
      complain(" value",
               fmt::format("{} is not a finite number: rejected, the joint keeps its set point", entry.value));
    }
  }
  return command;
}

/// Throws unless `number` is in its range.
double checked(const std::string& name, double number, const Range& range) {
  if (contains(range, number)) return number;
  throw std::runtime_error(fmt::format("{} = {}: must be {}", name, number, text_of(range)));
}

Eigen::Vector3d checked(const std::string& name, const Eigen::Vector3d& vector, const Range& range) {
  for (int k = 0; k < 3; ++k) checked(fmt::format("{}.{}", name, "xyz"[k]), vector[k], range);
  return vector;
}

/// x, y and heading of a pose on the floor.
Eigen::Vector3d planar(const geometry_msgs::Pose& pose) {
  constexpr double kMaxTilt = 1e-3, kMaxError = 0.01;  // sine of half the angle; of a quaternion's length
  const geometry_msgs::Point& position = pose.position;
  const geometry_msgs::Quaternion& q = pose.orientation;
  if (!(std::abs(position.z) <= 1e-6)) {
    throw std::runtime_error(fmt::format("pose.position.z = {}: must be 0", position.z));
  }
  const double length = Eigen::Vector4d(q.x, q.y, q.z, q.w).norm();
  const bool is_turn = std::abs(length - 1) <= kMaxError && std::hypot(q.x, q.y) <= kMaxTilt;
  if (!is_turn && length != 0) {
    throw std::runtime_error(fmt::format(
        "pose.orientation = ({}, {}, {}, {}): must be a unit quaternion about z, or all 0", q.x, q.y, q.z, q.w));
  }
  return {checked("pose.position.x", position.x, kPoses), checked("pose.position.y", position.y, kPoses),
          std::remainder(2 * std::atan2(q.z, q.w), 2 * M_PI)};
}

/// Throws unless these components, which a base on the floor does not have, are 0.
void require_zero(const std::string& names, std::initializer_list<double> values) {
  for (const double value : values) {
    if (value != 0) throw std::runtime_error(fmt::format("{} = {}: must be 0", names, fmt::join(values, ", ")));
  }
}

/// The pose in the scene's frame of what is at `pose` in `frame`.
Eigen::Vector3d in_scene(const std::string& name, const std::string& frame, const Eigen::Vector3d& pose,
                         const FrameNames& frames, const Eigen::Vector3d& odom) {
  if (frame.empty() || frame == frames.world || frame == frames.map) return pose;
  if (frame != frames.odom) {
    throw std::runtime_error(fmt::format("{} = {}: must be {}, {} or ~map_frame ({})", name, quote(frame), frames.world,
                                         frames.odom, frames.map.empty() ? "unset" : frames.map));
  }
  Eigen::Vector3d sum = odom + turned({pose[0], pose[1], 0}, odom[2]);
  sum[2] += pose[2];
  return sum;
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

std::string wheel_joint(int i) { return std::string("wheel_joint_") + kWheelNames[i]; }

nav_msgs::Odometry odometry_message(const std::string& frame, const Eigen::Vector3d& pose,
                                    const Eigen::Vector3d& velocity, const ros::Time& stamp, const std::string& child) {
  auto message = stamped<nav_msgs::Odometry>(frame, stamp);
  message.child_frame_id = child;
  message.pose.pose.position = vector_message<geometry_msgs::Point>({pose[0], pose[1], 0});
  message.pose.pose.orientation = quaternion(pose[2]);
  message.twist.twist.linear.x = velocity[0] + 0.0;  // not -0 at rest
  message.twist.twist.linear.y = velocity[1] + 0.0;
  message.twist.twist.angular.z = velocity[2] + 0.0;
  return message;
}

sensor_msgs::Imu imu_message(const Imu& imu, const ros::Time& stamp, const std::string& frame) {
  constexpr double kLevelVariance = 1e-6;  // of roll and pitch, rad^2, and of the rates about x and y, rad^2/s^2
  auto message = stamped<sensor_msgs::Imu>(frame, stamp);
  message.orientation = quaternion(imu.heading());
  message.angular_velocity.z = imu.rate();
  message.linear_acceleration = vector3(imu.acceleration());
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
  auto message = stamped<geometry_msgs::TransformStamped>(frame, stamp);
  message.child_frame_id = child;
  message.transform.translation = vector3({pose[0], pose[1], 0});
  message.transform.rotation = quaternion(pose[2]);
  return message;
}

RollerSwitchStamped roller_switch_message(const RollerSwitch& event, const ros::Time& stamp, const FrameNames& frames) {
  auto message = stamped<RollerSwitchStamped>(frames.wheel_link(event.wheel), stamp);
  message.wheel = wheel_joint(event.wheel);
  message.roller_from = static_cast<std::uint8_t>(event.roller_from);
  message.roller_to = static_cast<std::uint8_t>(event.roller_to);
  message.direction = static_cast<std::int8_t>(event.direction);
  message.phi = event.phi;
  message.t = event.t;
  message.count = event.count;
  return message;
}

ContactsStamped contacts_message(const Simulation& simulation, const ros::Time& stamp, const std::string& frame) {
  const Scene& scene = simulation.scene();
  const ContactDetails contacts = simulation.contacts();
  const Wheels torque = simulation.torque();
  const Wheels X = scene.robot.rho_X(), Y = scene.robot.rho_Y() + contacts.Delta_Y;
  const auto rollers = simulation.rollers();
  const auto other_rollers = simulation.other_rollers();

  auto message = stamped<ContactsStamped>(frame, stamp);
  message.t = simulation.time();
  message.contacts.resize(kWheels);
  for (int i = 0; i < kWheels; ++i) {
    Contact& contact = message.contacts[i];
    contact.wheel = wheel_joint(i);
    contact.position = vector_message<geometry_msgs::Point>({X[i], Y[i], floor_height(scene.robot)});
    contact.slip_velocity = vector3({contacts.V_PX[i], contacts.V_PY[i], 0});
    contact.friction_force = vector3({contacts.F_X[i], contacts.F_Y[i], 0});
    contact.normal_force = contacts.N[i];
    const double limit = limits_friction(scene.model) ? contacts.f[i] * contacts.N[i] : 0;
    const Eigen::Vector3d F{contacts.F_X[i], contacts.F_Y[i], contacts.F_Z[i]};
    contact.friction_share = limit > 0 ? std::sqrt(product(F.transpose(), F).value()) / limit : 0;
    contact.torque = torque[i];
    contact.roller = static_cast<std::uint8_t>(rollers[i]);
    contact.other_roller = static_cast<std::int16_t>(other_rollers[i].value_or(-1));
  }
  const PowerBalance power = simulation.power_balance();
  message.kinetic_energy = simulation.kinetic_energy();
  message.drive_power = power.drive;
  message.bearing_power = power.bearings;
  message.roller_power = power.rollers;
  message.floor_power = power.floor;
  message.external_power = power.external;
  return message;
}

Eigen::Vector3d platform_force(const Wrench& wrench, double psi) {
  return wrench.fixed ? turned(wrench.force, -psi) : wrench.force;
}

geometry_msgs::WrenchStamped wrench_message(const std::vector<Wrench>& wrenches, double psi, const ros::Time& stamp,
                                            const std::string& frame) {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  for (const Wrench& wrench : wrenches) {
    const Eigen::Vector3d one = platform_force(wrench, psi);
    force += one;
    torque += (wrench.point - kBaseLinkOrigin).cross(one) + wrench.torque * Eigen::Vector3d::UnitZ();
  }
  auto message = stamped<geometry_msgs::WrenchStamped>(frame, stamp);
  message.wrench.force = vector3(force);
  message.wrench.torque = vector3(torque);
  return message;
}

std_msgs::String scene_message(const Scene& scene) {
  std_msgs::String message;
  message.data = provenance(scene) + scene.resolved;
  return message;
}

LoadsStamped loads_message(const std::vector<Load>& loads, const ros::Time& stamp, const std::string& frame) {
  auto message = stamped<LoadsStamped>(frame, stamp);
  for (const Load& load : loads) {
    Payload& payload = message.loads.emplace_back();
    payload.mass = load.mass;
    payload.position = vector_message<geometry_msgs::Point>(load.position - kBaseLinkOrigin);
    payload.inertia = load.inertia;
  }
  return message;
}

Wrench wrench_of(const geometry_msgs::WrenchStamped& message, const FrameNames& frames, double odom_psi) {
  const std::string& frame = message.header.frame_id;
  const geometry_msgs::Vector3& torque = message.wrench.torque;
  const bool by_odom = frame == frames.odom, fixed = by_odom || frame == frames.world;
  if (!fixed && !frame.empty() && frame != frames.base_link() && frame != frames.base) {
    throw std::runtime_error(fmt::format("header.frame_id = {}: must be {}, {} or {}", quote(frame), frames.base_link(),
                                         frames.world, frames.odom));
  }
  require_zero("wrench.torque.x, y", {torque.x, torque.y});
  const Eigen::Vector3d force = checked("wrench.force", vector_of(message.wrench.force), kWrenchForces);
  return {by_odom ? turned(force, odom_psi) : force, kBaseLinkOrigin,
          checked("wrench.torque.z", torque.z, kWrenchTorques), fixed};
}

std::vector<Load> loads_of(const SetLoads::Request& request) {
  std::vector<Load> loads;
  for (const Payload& message : request.loads) {
    const std::string name = fmt::format("loads[{}].", loads.size());
    loads.push_back({checked(name + "mass", message.mass, kLoadMasses),
                     checked(name + "position", vector_of(message.position), kLoadPositions) + kBaseLinkOrigin,
                     checked(name + "inertia", message.inertia, kLoadInertias)});
  }
  return loads;
}

Faults faults_of(const SetFaults::Request& request) {
  Faults faults;
  faults.ethercat_lost = request.ethercat_lost;
  for (int i = 0; i < kWheels; ++i) {
    faults.silent[i] = request.silent[i];
    faults.encoder_slip[i] = checked(fmt::format("encoder_slip[{}]", i), request.encoder_slip[i], {0, 1, ""});
  }
  faults.encoder_noise = checked("encoder_noise", request.encoder_noise, {0, 10, "rad"});
  faults.command_delay = checked("command_delay", request.command_delay, {0, kMaxCommandDelay, "s"});
  return faults;
}

StateRequest state_of(const SetState::Request& request, const FrameNames& frames, const Eigen::Vector3d& odom) {
  const Eigen::Vector3d pose = planar(request.pose);
  const geometry_msgs::Twist& twist = request.twist;
  require_zero("twist.linear.z, angular.x, angular.y", {twist.linear.z, twist.angular.x, twist.angular.y});
  const Eigen::Vector3d velocity{checked("twist.linear.x", twist.linear.x, kSpeeds),
                                 checked("twist.linear.y", twist.linear.y, kSpeeds),
                                 checked("twist.angular.z", twist.angular.z, kSpeeds)};
  StateRequest state{in_scene("reference_frame", request.reference_frame, pose, frames, odom),
                     turned(velocity, -pose[2]), std::nullopt};
  if (request.wheel_angles.empty()) return state;
  if (request.wheel_angles.size() != kWheels) {
    throw std::runtime_error(
        fmt::format("wheel_angles: {} numbers: must be {} or none", request.wheel_angles.size(), kWheels));
  }
  state.phi = Wheels::Zero();
  for (int i = 0; i < kWheels; ++i) {
    (*state.phi)[i] = checked(fmt::format("wheel_angles[{}]", i), request.wheel_angles[i], kWheelAngles);
  }
  return state;
}

StateRequest state_of(const geometry_msgs::PoseWithCovarianceStamped& message, const FrameNames& frames,
                      const Eigen::Vector3d& odom) {
  const Eigen::Vector3d pose = planar(message.pose.pose);
  return {in_scene("header.frame_id", message.header.frame_id, pose, frames, odom), Eigen::Vector3d::Zero(),
          std::nullopt};
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
    command.complaints.push_back({"value", fmt::format("({}, {}, {}) {}: rejected, the base goes on as before",
                                                       velocity[0], velocity[1], velocity[2], reason)});
    return command;
  }
  command.set_points = drive_command(DriveMode::kVelocity, rates);
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
