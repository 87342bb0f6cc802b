#pragma once

#include <geometry_msgs/Twist.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/SetFaults.h>

#include <functional>
#include <vector>

#include "youbot_base_sim/ros/base_loop.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/throttled_log.h"

namespace youbot_base_sim {

/// The base driver's topics and services: converts messages, answers services and enqueues requests for the control
/// loop.
///
/// Subscribes (queue 1000, as the driver):
///   cmd_vel                               geometry_msgs/Twist, by the driver's kinematics to wheel rates
///   base/base_controller/torques_command  brics_actuator/JointTorques, at the wheels
///   base/base_controller/velocity_command brics_actuator/JointVelocities, kept by the wheels' velocity loop
/// A command holds until the next one for the same wheel. The driver has no topic for single wheels; these are named,
/// and their messages read, by analogy to the arm's.
///
/// Offers base/switchOffMotors, base/switchOnMotors and reconnect (std_srvs/Empty), which fail without a base as the
/// driver's do, and ~set_faults (youbot_base_sim/SetFaults). All fail while too many requests wait for time to go on.
class DriverInterface {
 public:
  /// `now` tells the simulated time at which what comes now arrives, s. All references must outlive it.
  DriverInterface(BaseLoop& loop, const std::function<double()>& now, const Telemetry::Options& telemetry,
                  ros::NodeHandle& node, ros::NodeHandle& private_node, ThrottledLog& log);

  /// Command messages so far, bad ones included.
  std::int64_t commands() const { return commands_; }

  /// Whether anybody is there who could command.
  bool has_commander() const;

 private:
  template <class Message>
  void subscribe(ros::NodeHandle& node, const char* topic, const std::function<WheelCommand(const Message&)>& read);
  void receive(const char* topic, const WheelCommand& command);
  bool request(const DriverRequest& request);
  bool request_of_base(const DriverRequest& request);
  bool switch_off(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool switch_on(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool reconnect(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool set_faults(SetFaults::Request& asked, SetFaults::Response& response);

  BaseLoop& loop_;
  std::function<double()> now_;
  ThrottledLog& log_;
  bool warns_of_signs_;  // of joint velocities that are not those of commands, once
  std::int64_t commands_ = 0;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace youbot_base_sim
