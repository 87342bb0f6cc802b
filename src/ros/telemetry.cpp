#include "youbot_base_sim/ros/telemetry.h"

namespace youbot_base_sim {

namespace {

/// Names as the driver orders them: wheels, then casters; the rollers after them, wheel by wheel.
std::vector<std::string> joint_names(int rollers) {
  std::vector<std::string> names;
  for (int i = 0; i < kWheels; ++i) names.push_back(wheel_joint(i));
  for (const char* wheel : kWheelNames) names.push_back(std::string(kCasterJointPrefix) + wheel);
  for (const char* wheel : kWheelNames) {
    for (int k = 0; k < rollers; ++k)
      names.push_back(std::string(kRollerJointPrefix) + wheel + "_" + std::to_string(k));
  }
  return names;
}

}  // namespace

Telemetry::Telemetry(const Simulation& simulation, const MotorReadings& readings, const Options& options)
    : options_(options), odometry_(options.kinematics, readings.phi, options.wheel_error) {
  joints_.name = joint_names(options.rollers ? simulation.scene().robot.rollers : 0);
  joints_.position.resize(joints_.name.size());
  joints_.velocity.resize(joints_.name.size());
  joints_.effort.resize(joints_.name.size());
  take_in(simulation, readings);
}

void Telemetry::update(const Simulation& simulation, const MotorReadings& readings) {
  odometry_.update(readings.phi);
  take_in(simulation, readings);
}

void Telemetry::restart_odometry() { odometry_.reset(readings_.phi); }

void Telemetry::take_in(const Simulation& simulation, const MotorReadings& readings) {
  constexpr bool kLeft[kWheels] = {true, false, true, false};
  state_ = simulation.state();
  readings_ = readings;
  for (int i = 0; i < kWheels; ++i) {
    const double sign = options_.driver_velocity_sign && kLeft[i] ? -1 : 1;
    joints_.position[i] = readings.phi[i];
    joints_.velocity[i] = sign * readings.dphi[i];
    joints_.effort[i] = sign * readings.torque[i];
  }
  if (options_.rollers) take_in_rollers(simulation);
}

/// A roller turns while it is on the floor and stands otherwise; its bearing exerts no torque that anyone commands.
void Telemetry::take_in_rollers(const Simulation& simulation) {
  const int n = simulation.scene().robot.rollers;
  const auto on_floor = simulation.rollers();
  std::size_t joint = 2 * kWheels;
  for (int i = 0; i < kWheels; ++i) {
    for (int k = 0; k < n; ++k, ++joint) {
      joints_.position[joint] = simulation.roller_angle(i, k);
      joints_.velocity[joint] = k == on_floor[i] ? state_.dgamma()[i] : 0;
    }
  }
}

nav_msgs::Odometry Telemetry::odometry(const ros::Time& stamp) const {
  nav_msgs::Odometry message =
      odometry_message(kOdometryFrame, odometry_.pose(), odometry_.kinematics().velocity(readings_.dphi), stamp);
  if (options_.wheel_error > 0) {
    message.pose.covariance = covariance_message(odometry_.pose_covariance());
    message.twist.covariance = covariance_message(odometry_.velocity_covariance(readings_.dphi));
  }
  return message;
}

nav_msgs::Odometry Telemetry::ground_truth(const ros::Time& stamp) const {
  return odometry_message(kWorldFrame, {state_.x(), state_.y(), state_.psi()}, state_.velocity(), stamp);
}

sensor_msgs::JointState Telemetry::joint_states(const ros::Time& stamp) const {
  sensor_msgs::JointState message(joints_);
  message.header.stamp = stamp;
  return message;
}

tf2_msgs::TFMessage Telemetry::transforms(const ros::Time& stamp) const {
  tf2_msgs::TFMessage message;
  message.transforms.push_back(transform_message(kOdometryFrame, kBaseFrame, odometry_.pose(), stamp));
  return message;
}

MotorReadings exact_readings(const Simulation& simulation) {
  return {simulation.state().phi(), simulation.state().dphi(), simulation.torque()};
}

}  // namespace youbot_base_sim
