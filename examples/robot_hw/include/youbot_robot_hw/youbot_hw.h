#pragma once

#include <hardware_interface/joint_command_interface.h>
#include <hardware_interface/joint_state_interface.h>
#include <hardware_interface/robot_hw.h>

#include <array>
#include <list>
#include <string>

#include "youbot_robot_hw/test_bed.h"

namespace youbot_robot_hw {

/// The simulated base as hardware of ros_control: joints wheel_joint_fl, _fr, _bl and _br, positive forward, with
/// JointStateInterface (rad, rad/s, N m), VelocityJointInterface (rad/s) and EffortJointInterface (N m). A wheel
/// follows the interface by which a controller claims it; the motors hold the others at rest, as the driver does.
///
/// `write` gives the motors their commands and advances the base: the time of its caller is the time of the base.
class YoubotHW : public hardware_interface::RobotHW {
 public:
  /// As TestBed.
  explicit YoubotHW(const youbot_base_sim::Scene& scene);

  /// Before that, ControllerManager has rejected controllers that claim the same wheel.
  void doSwitch(const std::list<hardware_interface::ControllerInfo>& start,
                const std::list<hardware_interface::ControllerInfo>& stop) override;

  /// Reads the motors.
  void read(const ros::Time& time, const ros::Duration& period) override;

  /// Commands the motors and advances by `period`; see TestBed::advance. A command that is not finite leaves its wheel
  /// as it was, with a warning.
  void write(const ros::Time& time, const ros::Duration& period) override;

  const TestBed& base() const { return base_; }

 private:
  struct Wheel {
    std::string joint;
    double position, velocity, effort;  // read
    double commanded_velocity, commanded_effort;
    enum { kHeld, kVelocity, kEffort } mode;
  };

  void claim(const std::string& interface, const std::string& joint);
  youbot_base_sim::SetPoint set_point(const Wheel& wheel) const;

  TestBed base_;
  std::array<Wheel, youbot_base_sim::kWheels> wheels_{};
  hardware_interface::JointStateInterface states_;
  hardware_interface::VelocityJointInterface velocities_;
  hardware_interface::EffortJointInterface efforts_;
};

}  // namespace youbot_robot_hw
