#pragma once

#include <geometry_msgs/Twist.h>
#include <nav_msgs/Odometry.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/JointState.h>
#include <std_srvs/Empty.h>
#include <tf2_msgs/TFMessage.h>
#include <youbot_base_sim/SetFaults.h>
#include <youbot_base_sim/Step.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "rostest.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/topics.h"

namespace youbot_base_sim {

/// What the tests know of a base_node that is the master of time: its latest messages, and commands to it.
class BaseClient {
 public:
  /// The program's one client (connections take time, and a message that is published before counts for nothing), with
  /// the node back at t = 0.
  static BaseClient& fresh() {
    static BaseClient* client = new BaseClient;
    client->reset();
    return *client;
  }

  /// Publishes a command and waits for the end of the control period that it is for: the node must be in lockstep.
  void command(const brics_actuator::JointTorques& message) { command(torques_, message); }
  void command(const brics_actuator::JointVelocities& message) { command(velocities_, message); }
  void command(const geometry_msgs::Twist& message) { command(twist_, message); }

  /// Publishes a command that arrives at some time.
  void send(const brics_actuator::JointTorques& message) { torques_.publish(message); }

  /// Waits for the messages of the time on the clock: it must be an instant of publishing.
  void settle() {
    wait_for("all topics to have the clock's time", [this] {
      return !clock_.isZero() && odometry.header.stamp == clock_ && truth.header.stamp == clock_ &&
             joints.header.stamp == clock_ && tf.header.stamp == clock_;
    });
  }

  /// The same for what is there without a base.
  void settle_truth() {
    wait_for("ground truth to have the clock's time",
             [this] { return !clock_.isZero() && truth.header.stamp == clock_; });
  }

  /// Goes on by `periods` control periods, in lockstep, with commands that name no wheel.
  void idle(int periods) {
    for (int k = 0; k < periods; ++k) command(brics_actuator::JointTorques());
  }

  /// The same, to an instant of publishing, and waits for its messages.
  void go_on(int periods) {
    idle(periods);
    settle();
  }

  void pause() { require("base_node/pause"); }
  void unpause() { require("base_node/unpause"); }

  /// Calls a service; false where it fails.
  static bool call(const std::string& name) {
    std_srvs::Empty service;
    return call_service(name, service);
  }

  /// Sets the faults; throws if they are refused.
  static void set_faults(const SetFaults::Request& faults) {
    SetFaults service;
    service.request = faults;
    if (!call_service("base_node/set_faults", service) || !service.response.success) {
      throw std::runtime_error("~set_faults fails: " + service.response.message);
    }
  }

  /// Back to t = 0, and waits for its messages.
  void reset() {
    require("base_node/reset");
    wait_for("the clock to be back at zero", [this] { return time() == 0; });
    settle();
    switches.clear();
  }

  /// Calls ~step and, unless it is refused, waits for the messages of where it ends.
  Step::Response step(std::uint32_t periods) {
    Step service;
    service.request.periods = periods;
    if (!call_service("base_node/step", service)) throw std::runtime_error("~step cannot be called");
    if (service.response.success) {
      wait_for("the last step", [&] { return clock_ >= stamp_of(service.response.t); });
      settle();
    }
    return service.response;
  }

  /// Simulated time, s.
  double time() const { return time_of(clock_); }

  ros::Time clock() const { return clock_; }

  nav_msgs::Odometry odometry, truth;
  sensor_msgs::JointState joints;
  geometry_msgs::TransformStamped tf;
  std::vector<RollerSwitchStamped> switches;

 private:
  static constexpr std::uint32_t kQueue = 10000;

  BaseClient() {
    const auto hints = ros::TransportHints().tcpNoDelay();
    subscribers_ = {node_.subscribe<rosgraph_msgs::Clock>(
                        kClockTopic, kQueue, [this](const auto& m) { clock_ = m->clock; }, {}, hints),
                    node_.subscribe<nav_msgs::Odometry>(
                        kOdometryTopic, kQueue, [this](const auto& m) { odometry = *m; }, {}, hints),
                    node_.subscribe<nav_msgs::Odometry>(
                        kGroundTruthTopic, kQueue, [this](const auto& m) { truth = *m; }, {}, hints),
                    node_.subscribe<sensor_msgs::JointState>(
                        kJointStatesTopic, kQueue, [this](const auto& m) { joints = *m; }, {}, hints),
                    node_.subscribe<tf2_msgs::TFMessage>(
                        kTransformsTopic, kQueue, [this](const auto& m) { tf = m->transforms.at(0); }, {}, hints),
                    node_.subscribe<RollerSwitchStamped>(
                        kRollerSwitchesTopic, kQueue, [this](const auto& m) { switches.push_back(*m); }, {}, hints)};
    torques_ = node_.advertise<brics_actuator::JointTorques>(kTorqueTopic, kQueue);
    velocities_ = node_.advertise<brics_actuator::JointVelocities>(kVelocityTopic, kQueue);
    twist_ = node_.advertise<geometry_msgs::Twist>(kTwistTopic, kQueue);
    wait_for("the node to listen", [this] {
      return torques_.getNumSubscribers() > 0 && velocities_.getNumSubscribers() > 0 && twist_.getNumSubscribers() > 0;
    });
    settle();
  }

  template <class Message>
  void command(const ros::Publisher& publisher, const Message& message) {
    const ros::Time before = clock_;
    publisher.publish(message);
    wait_for("the control period to end", [&] { return clock_ > before; });
  }

  static void require(const std::string& name) {
    if (!call(name)) throw std::runtime_error(name + " cannot be called");
  }

  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher torques_, velocities_, twist_;
  ros::Time clock_;
};

/// A twist that the base can follow.
inline geometry_msgs::Twist twist(double v_x, double v_y, double omega) {
  geometry_msgs::Twist message;
  message.linear.x = v_x;
  message.linear.y = v_y;
  message.angular.z = omega;
  return message;
}

/// Heading of a message, rad, in (-pi, pi].
inline double heading(const geometry_msgs::Quaternion& q) { return std::remainder(2 * std::atan2(q.z, q.w), 2 * M_PI); }

}  // namespace youbot_base_sim
