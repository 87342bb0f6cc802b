#include "youbot_base_sim/ros/telemetry.h"

#include <fmt/format.h>

namespace youbot_base_sim {

namespace {

/// In the driver's order: wheels, then casters; after them the rollers, wheel by wheel.
std::vector<std::string> joint_names(bool casters, int rollers) {
  std::vector<std::string> names;
  for (int i = 0; i < kWheels; ++i) names.push_back(wheel_joint(i));
  for (int i = 0; casters && i < kWheels; ++i) names.push_back(std::string("caster_joint_") + kWheelNames[i]);
  for (const char* wheel : kWheelNames) {
    for (int k = 0; k < rollers; ++k) names.push_back(fmt::format("roller_joint_{}_{}", wheel, k));
  }
  return names;
}

/// A roller turns while it is on the floor and stands otherwise; its bearing exerts no commanded torque.
void add_rollers(const Simulation& simulation, sensor_msgs::JointState& message) {
  const int n = simulation.scene().robot.rollers;
  const auto on_floor = simulation.rollers();
  std::size_t joint = message.name.size() - static_cast<std::size_t>(kWheels * n);
  for (int i = 0; i < kWheels; ++i) {
    for (int k = 0; k < n; ++k, ++joint) {
      message.position[joint] = simulation.roller_angle(i, k);
      message.velocity[joint] = k == on_floor[i] ? simulation.state().dgamma()[i] : 0;
    }
  }
}

}  // namespace

Telemetry::Telemetry(const Scene& scene, const Options& options) : options_(options), markers_(options.markers) {
  joints_.name = joint_names(options.casters, options.rollers ? scene.robot.rollers : 0);
  for (auto* values : {&joints_.position, &joints_.velocity, &joints_.effort}) values->resize(joints_.name.size());
}

nav_msgs::Odometry Telemetry::odometry(const BaseSensors& sensors, const ros::Time& stamp) const {
  const WheelOdometry& odometry = sensors.odometry();
  const Wheels& dphi = sensors.readings().dphi;
  nav_msgs::Odometry message = odometry_message(options_.frames.odom, odometry.pose(),
                                                odometry.kinematics().velocity(dphi), stamp, options_.frames.base);
  if (odometry.has_covariance()) {
    message.pose.covariance = covariance_message(odometry.pose_covariance());
    message.twist.covariance = covariance_message(odometry.velocity_covariance(dphi));
  }
  return message;
}

sensor_msgs::JointState Telemetry::joint_states(const Simulation& simulation, const MotorReadings& readings,
                                                const ros::Time& stamp) const {
  constexpr bool kLeft[kWheels] = {true, false, true, false};
  sensor_msgs::JointState message(joints_);
  message.header.stamp = stamp;
  for (int i = 0; i < kWheels; ++i) {
    const double sign = options_.driver_velocity_sign && kLeft[i] ? -1 : 1;
    message.position[i] = readings.phi[i] + 0.0;
    message.velocity[i] = sign * readings.dphi[i] + 0.0;  // not -0 at rest
    message.effort[i] = sign * readings.torque[i] + 0.0;
  }
  if (options_.rollers) add_rollers(simulation, message);
  return message;
}

tf2_msgs::TFMessage Telemetry::transforms(const Simulation& simulation, const BaseSensors& sensors,
                                          const ros::Time& stamp) const {
  const FrameNames& frames = options_.frames;
  tf2_msgs::TFMessage message;
  message.transforms = {transform_message(frames.odom, frames.base, sensors.odometry().pose(), stamp)};
  if (options_.world) {
    message.transforms.push_back(transform_message(frames.world, frames.truth, pose_of(simulation.state()), stamp));
  }
  return message;
}

tf2_msgs::TFMessage Telemetry::static_transforms(const Simulation& simulation, const BaseSensors& sensors,
                                                 const ros::Time& stamp) const {
  const FrameNames& frames = options_.frames;
  tf2_msgs::TFMessage message;
  if (options_.world) {
    const Eigen::Vector3d start = pose_of(simulation.scene().initial);
    message.transforms = {transform_message(frames.world, frames.odom, start, stamp)};
  }
  if (sensors.imu() && is_apart(*sensors.imu())) {
    message.transforms.push_back(transform_message(frames.base_link(), frames.imu_link(), {0, 0, 0}, stamp));
    message.transforms.back().transform.translation = vector_message<geometry_msgs::Vector3>(sensors.imu()->position());
  }
  return message;
}

}  // namespace youbot_base_sim
