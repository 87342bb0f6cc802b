#include "youbot_robot_hw/youbot_hw.h"

#include <ros/console.h>

#include <cmath>

namespace youbot_robot_hw {

using hardware_interface::ControllerInfo;
using hardware_interface::JointHandle;
using youbot_base_sim::DriveMode;
using youbot_base_sim::kWheels;
using youbot_base_sim::MotorReadings;
using youbot_base_sim::SetPoint;

namespace {

constexpr const char* kVelocityInterface = "hardware_interface::VelocityJointInterface";
constexpr const char* kEffortInterface = "hardware_interface::EffortJointInterface";

/// Calls `visit(interface, joint)` for each joint that the controllers claim.
template <class Visit>
void visit_claims(const std::list<ControllerInfo>& controllers, Visit&& visit) {
  for (const auto& controller : controllers) {
    for (const auto& claimed : controller.claimed_resources) {
      for (const auto& joint : claimed.resources) visit(claimed.hardware_interface, joint);
    }
  }
}

}  // namespace

YoubotHW::YoubotHW(const youbot_base_sim::Scene& scene) : base_(scene) {
  const char* const names[kWheels] = {"fl", "fr", "bl", "br"};
  for (int i = 0; i < kWheels; ++i) {
    Wheel& wheel = wheels_[i];
    wheel.joint = std::string("wheel_joint_") + names[i];
    states_.registerHandle({wheel.joint, &wheel.position, &wheel.velocity, &wheel.effort});
    velocities_.registerHandle(JointHandle(states_.getHandle(wheel.joint), &wheel.commanded_velocity));
    efforts_.registerHandle(JointHandle(states_.getHandle(wheel.joint), &wheel.commanded_effort));
  }
  registerInterface(&states_);
  registerInterface(&velocities_);
  registerInterface(&efforts_);
  read({}, {});
}

void YoubotHW::doSwitch(const std::list<ControllerInfo>& start, const std::list<ControllerInfo>& stop) {
  visit_claims(stop, [&](const std::string&, const std::string& joint) { claim("", joint); });
  visit_claims(start, [&](const std::string& interface, const std::string& joint) { claim(interface, joint); });
}

void YoubotHW::claim(const std::string& interface, const std::string& joint) {
  for (Wheel& wheel : wheels_) {
    if (wheel.joint != joint) continue;
    wheel.mode = interface == kVelocityInterface ? Wheel::kVelocity
                 : interface == kEffortInterface ? Wheel::kEffort
                                                 : Wheel::kHeld;
    wheel.commanded_velocity = wheel.commanded_effort = 0;
  }
}

void YoubotHW::read(const ros::Time&, const ros::Duration&) {
  const MotorReadings& readings = base_.read();
  for (int i = 0; i < kWheels; ++i) {
    wheels_[i].position = readings.phi[i];
    wheels_[i].velocity = readings.dphi[i];
    wheels_[i].effort = readings.torque[i];
  }
}

void YoubotHW::write(const ros::Time&, const ros::Duration& period) {
  SetPoints set_points;
  for (int i = 0; i < kWheels; ++i) set_points[i] = set_point(wheels_[i]);
  if (!base_.command(set_points)) {
    ROS_WARN_THROTTLE(1, "A controller's command is not finite: its wheel goes on as before");
  }
  base_.advance(period.toSec());
}

SetPoint YoubotHW::set_point(const Wheel& wheel) const {
  if (wheel.mode == Wheel::kEffort) return {DriveMode::kTorque, wheel.commanded_effort};
  return {DriveMode::kVelocity, wheel.mode == Wheel::kVelocity ? wheel.commanded_velocity : 0};
}

}  // namespace youbot_robot_hw
