#include "youbot_base_sim/ros/telemetry.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

/// Names as the driver orders them: wheels, then casters; the rollers after them, wheel by wheel.
std::vector<std::string> joint_names(int rollers) {
  std::vector<std::string> names;
  for (int i = 0; i < kWheels; ++i) names.push_back(wheel_joint(i));
  for (const char* wheel : kWheelNames) names.push_back(std::string("caster_joint_") + wheel);
  for (const char* wheel : kWheelNames) {
    for (int k = 0; k < rollers; ++k) names.push_back(std::string("roller_joint_") + wheel + "_" + std::to_string(k));
  }
  return names;
}

}  // namespace

Telemetry::Telemetry(const Simulation& simulation, const Options& options)
    : odometry_(options.kinematics, simulation.state().phi()), with_rollers_(options.rollers) {
  joints_.name = joint_names(with_rollers_ ? simulation.scene().robot.rollers : 0);
  joints_.position.resize(joints_.name.size());
  joints_.velocity.resize(joints_.name.size());
  joints_.effort.resize(joints_.name.size());
  take_in(simulation);
}

void Telemetry::update(const Simulation& simulation) {
  odometry_.update(simulation.state().phi());
  take_in(simulation);
}

void Telemetry::reset(const Simulation& simulation) {
  odometry_.reset(simulation.state().phi());
  take_in(simulation);
}

void Telemetry::take_in(const Simulation& simulation) {
  state_ = simulation.state();
  const Wheels torque = simulation.torque();
  for (int i = 0; i < kWheels; ++i) {
    joints_.position[i] = state_.phi()[i];
    joints_.velocity[i] = state_.dphi()[i];
    joints_.effort[i] = torque[i];
  }
  if (!with_rollers_) return;
  // A roller turns while it is on the floor and stands otherwise; its bearing exerts no torque that anyone commands.
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
  return odometry_message(kOdometryFrame, odometry_.pose(), odometry_.kinematics().velocity(state_.dphi()), stamp);
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

}  // namespace youbot_base_sim
