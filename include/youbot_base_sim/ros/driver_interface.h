#pragma once

#include <fmt/format.h>
#include <geometry_msgs/PoseWithCovarianceStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/SetFaults.h>
#include <youbot_base_sim/SetLoads.h>
#include <youbot_base_sim/SetState.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/offline_program.h"
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
                  ros::NodeHandle& private_node, ThrottledLog& log)
      : loop_(loop),
        clock_(clock),
        log_(log),
        frames_(settings.telemetry.frames),
        warns_of_signs_(settings.telemetry.driver_velocity_sign) {
    subscribe<brics_actuator::JointTorques>(node, kTorqueTopic, [](const auto& m) { return wheel_command(m); });
    subscribe<brics_actuator::JointVelocities>(node, kVelocityTopic, [](const auto& m) { return wheel_command(m); });
    subscribe<geometry_msgs::Twist>(node, kTwistTopic, [kinematics = settings.sensors.kinematics](const auto& m) {
      return wheel_command(m, kinematics);
    });
    hear<geometry_msgs::WrenchStamped>(private_node, kWrenchTopic, "~", [this](const auto& message) {
      const Wrench wrench = wrench_of(message, frames_, odom_pose()[2]);
      warn_of_vertical_force(wrench);
      return wrench;
    });
    if (settings.listen_to_initialpose) {
      hear<geometry_msgs::PoseWithCovarianceStamped>(
          node, kInitialPoseTopic, "", [this](const auto& message) { return state_of(message, frames_, odom_pose()); });
    }
    const auto loads = [this](const SetLoads::Request& asked) {
      LoadsRequest request{loads_of(asked), static_cast<bool>(asked.at_rest)};
      if (const std::string reason = loop_.refusal(request.loads); !reason.empty()) throw std::runtime_error(reason);
      return request;
    };
    const auto state = [this](const SetState::Request& asked) { return state_of(asked, frames_, odom_pose()); };
    services_ = {offer_switch<SwitchOff>(node, "base/switchOffMotors", "Switch off the base motors"),
                 offer_switch<SwitchOn>(node, "base/switchOnMotors", "Switch on the base motors"),
                 node.advertiseService("reconnect", &DriverInterface::reconnect, this),
                 offer<SetFaults>(private_node, "set_faults", &SetFaults::Response::message, faults_of),
                 offer<SetLoads>(private_node, "set_loads", &SetLoads::Response::message, loads),
                 offer<SetState>(private_node, "set_state", &SetState::Response::status_message, state)};
  }

  /// The node that sent the last command message since the last `forget_commands`; bad ones count. Empty: none came.
  const std::string& commander() const { return commander_; }
  void forget_commands() { commander_.clear(); }

  /// True if a command topic has a publisher.
  bool has_commander() const {
    return std::any_of(command_subscribers_.begin(), command_subscribers_.end(),
                       [](const ros::Subscriber& subscriber) { return subscriber.getNumPublishers() > 0; });
  }

 private:
  static constexpr char kNoBase[] = "No base initialized!";  // the driver's words

  /// Subscribes to commands, which `read` makes of a message.
  template <class Message, class Read>
  void subscribe(ros::NodeHandle& node, const char* topic, const Read& read) {
    using Event = ros::MessageEvent<const Message>;
    const auto take = [this, topic, read](const Event& event) {
      commander_ = event.getPublisherName();
      clock_.note_command(commander_);
      receive(topic, read(*event.getMessage()));
    };
    command_subscribers_.push_back(
        node.subscribe<Message, const Event&>(topic, kCommandQueueSize, take, ros::VoidConstPtr(), no_delay()));
  }

  /// Subscribes to other requests, which `make_request` makes of a message. Its errors are logged.
  template <class Message, class MakeRequest>
  void hear(ros::NodeHandle& node, const char* topic, const char* prefix, const MakeRequest& make_request) {
    const auto take = [=](const boost::shared_ptr<const Message>& message) {
      const std::string reason = refusal([&] { return make_request(*message); });
      if (!reason.empty()) log_.warn(topic, fmt::format("{}{}: {}: rejected", prefix, topic, reason));
    };
    request_subscribers_.push_back(node.subscribe<Message>(topic, kCommandQueueSize, take, {}, no_delay()));
  }

  /// Without this Nagle's algorithm may hold a command back for 40 ms.
  static ros::TransportHints no_delay() { return ros::TransportHints().tcpNoDelay(); }

  void receive(const char* topic, const WheelCommand& command) {
    const double now = clock_.arrival();
    if (!loop_.present(now)) return log_.error("no base", kNoBase);
    const auto complain = [&](const std::string& subject, const std::string& text) {
      log_.warn(topic + subject, fmt::format("{}: {}", topic, text));
    };
    if (warns_of_signs_ && topic == std::string(kVelocityTopic) && (command.set_points[0] || command.set_points[2])) {
      warns_of_signs_ = false;
      ROS_WARN(
          "%s beside joint velocities with ~joint_velocity_sign = driver_exact: on wheel_joint_fl and _bl the two have "
          "opposite signs, and a loop closed over both has positive feedback; consistent has one sign for all",
          topic);
    }
    for (const Complaint& complaint : command.complaints) complain(complaint.subject, complaint.text);
    const Motor& motor = loop_.driver().motor();
    bool names_any = false;
    for (int i = 0; i < kWheels; ++i) {
      const auto& set_point = command.set_points[i];
      names_any = names_any || set_point;
      if (!set_point || motor.can(*set_point)) continue;
      const char* unit = text_of(set_point->mode).unit;
      complain(wheel_joint(i) + " limit",
               fmt::format("{}: {:.7g} {} is beyond the motor's limit: clipped to {:.5g} {}", wheel_joint(i),
                           set_point->value, unit, motor.limited(*set_point).value, unit));
    }
    if (names_any) loop_.push(now, command.set_points);
  }

  void warn_of_vertical_force(const Wrench& wrench) const {
    const NormalReactions reactions = loop_.simulation().scene().robot.normal_reactions;
    if (wrench.force.z() == 0 || reactions == NormalReactions::kDynamic) return;
    log_.warn("vertical force",
              fmt::format("~{}: wrench.force.z = {}: has no effect unless robot.normal_reactions is dynamic",
                          kWrenchTopic, wrench.force.z()));
  }

  /// Enqueues a request other than a command. Throws std::runtime_error if it is refused.
  void request(const BaseRequest& request) {
    if (loop_.push(clock_.arrival(), request)) return;
    throw std::runtime_error(fmt::format("{} requests wait for time to advance", BaseRequests::kMaxWaiting));
  }

  /// Enqueues what `make_request` returns. Returns why not, where that throws or too many wait; else an empty text.
  template <class MakeRequest>
  std::string refusal(const MakeRequest& make_request) {
    return refusal_of([&] { request(make_request()); });
  }

  /// A service of the driver that needs a base. `line`: for the log, the driver's. What it throws, roscpp sends to the
  /// caller and logs: std_srvs/Empty has no room for a reason.
  template <class Request>
  ros::ServiceServer offer_switch(ros::NodeHandle& node, const char* service, const char* line) {
    const auto serve = [this, line](std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
      ROS_INFO_STREAM(line);
      if (!loop_.present(clock_.arrival())) throw std::runtime_error(kNoBase);
      request(Request());
      return true;
    };
    return node.advertiseService<std_srvs::Empty::Request, std_srvs::Empty::Response>(service, serve);
  }

  /// True whether or not there is a base then, as the driver's is.
  bool reconnect(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    request(Reconnect());
    if (loop_.present(clock_.arrival())) {
      ROS_INFO("Base is initialized.");
    } else {
      ROS_ERROR("Base could not be initialized: EtherCAT is lost");
    }
    return true;
  }

  /// A service that enqueues what `make_request` makes of what is asked; `message` says why not.
  template <class Service, class MakeRequest>
  ros::ServiceServer offer(ros::NodeHandle& private_node, const char* service, std::string Service::Response::*message,
                           MakeRequest make_request) {
    const auto serve = [=](typename Service::Request& asked, typename Service::Response& response) {
      response.*message = refusal([&] { return make_request(asked); });
      response.success = (response.*message).empty();
      return true;
    };
    return private_node.advertiseService<typename Service::Request, typename Service::Response>(service, serve);
  }

  Eigen::Vector3d odom_pose() const { return loop_.simulation().scene().initial.values.col(0).head<3>().matrix(); }

  BaseLoop& loop_;
  NodeClock& clock_;
  ThrottledLog& log_;
  const FrameNames frames_;
  bool warns_of_signs_;  // of joint velocities that are not those of commands, once
  std::string commander_;
  std::vector<ros::Subscriber> command_subscribers_, request_subscribers_;
  std::vector<ros::ServiceServer> services_;
};

}  // namespace youbot_base_sim
