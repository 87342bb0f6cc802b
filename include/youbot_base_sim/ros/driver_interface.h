#pragma once

#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/SetFaults.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include <vector>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/node_clock.h"
#include "youbot_base_sim/ros/throttled_log.h"

namespace youbot_base_sim {

/// The topics and services that command the base, the driver's and the simulator's own (docs/node.md): converts
/// messages, answers services and enqueues requests for the control loop. Queues hold 1000 messages, as the driver's.
/// Each command holds until the next one for its wheel.
///
/// The driver's services fail without a base as the driver's do. All but commands are refused while too many requests
/// wait for time to advance. Callers get the reason of a refusal.
class DriverInterface {
 public:
  /// All references must outlive it.
  DriverInterface(BaseLoop& loop, NodeClock& clock, const BaseSettings& settings, ros::NodeHandle& node,
                  ros::NodeHandle& private_node, ThrottledLog& log);

  /// The node that sent the last command message since the last `forget_commands`; bad ones count. Empty: none came.
  const std::string& commander() const { return commander_; }
  void forget_commands() { commander_.clear(); }

  /// True if a command topic has a publisher.
  bool has_commander() const;

 private:
  template <class Message, class Read>
  void subscribe(ros::NodeHandle& node, const char* topic, const Read& read);
  void receive(const char* topic, const WheelCommand& command);
  void receive_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message);
  void receive_wrench(const geometry_msgs::WrenchStamped& message);
  void request(const BaseRequest& request);
  template <class Service, class MakeRequest>
  ros::ServiceServer offer(ros::NodeHandle& private_node, const char* service, std::string Service::Response::*message,
                           MakeRequest make_request);
  template <class Request>
  ros::ServiceServer offer_switch(ros::NodeHandle& node, const char* service, const char* line);
  bool reconnect(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  Eigen::Vector3d odom_pose() const { return loop_.simulation().scene().initial.values.col(0).head<3>().matrix(); }
  template <class MakeRequest>
  std::string refusal(const MakeRequest& make_request);

  BaseLoop& loop_;
  NodeClock& clock_;
  ThrottledLog& log_;
  const FrameNames frames_;
  bool warns_of_signs_;  // of joint velocities that are not those of commands, once
  std::string commander_;
  std::vector<ros::Subscriber> command_subscribers_;
  ros::Subscriber wrench_subscriber_, initialpose_subscriber_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace youbot_base_sim
