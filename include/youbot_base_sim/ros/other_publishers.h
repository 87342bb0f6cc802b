#pragma once

#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/ros/base_settings.h"

namespace youbot_base_sim {

/// Looks out for other nodes that publish what this node does, or command it beside each other, and warns once of each.
/// Asks the master in a thread of its own, which a silent master may block.
class OtherPublishers {
 public:
  /// The topics are those of `node`. `settings` must outlive this.
  OtherPublishers(const ros::NodeHandle& node, const BaseSettings& settings) : settings_(settings), node_(node) {
    node_.setCallbackQueue(&queue_);
    timer_ = node_.createWallTimer(ros::WallDuration(0.1), &OtherPublishers::look, this);
    spinner_.start();
  }
  OtherPublishers(const OtherPublishers&) = delete;
  OtherPublishers& operator=(const OtherPublishers&) = delete;

  /// Whether another node publishes /clock though this one is the master of simulated time.
  bool of_clock() const { return of_clock_; }

 private:
  using Names = std::vector<std::string>;

  void look(const ros::WallTimerEvent&) {
    timer_.setPeriod(ros::WallDuration(5), false);
    XmlRpc::XmlRpcValue request, response, state;
    request[0] = ros::this_node::getName();
    if (!ros::master::execute("getSystemState", request, response, state, false)) return;
    const Names commanders = others(state[0], kTwistTopic), odometers = others(state[0], kOdometryTopic);
    if (commanders.size() > 1) warn(kTwistTopic, commanders, "the newest command counts");
    if (!odometers.empty()) warn(kOdometryTopic, odometers, "besides this node: its listeners mix the two");
    const Names clocks = settings_.publish_clock ? others(state[0], kClockTopic) : Names();
    of_clock_ = !clocks.empty();
    if (of_clock_) warn(kClockTopic, clocks, "besides this node: time is undefined");
    if (settings_.publish_tf) listen(others(state[0], kTransformsTopic));
  }

  /// Hears /tf from one look to the next whenever `publishers` have changed: always would cost more than it finds.
  void listen(const Names& publishers) {
    transforms_.shutdown();
    if (publishers == heard_) return;
    heard_ = publishers;
    if (!heard_.empty()) transforms_ = node_.subscribe(kTransformsTopic, 100, &OtherPublishers::take, this);
  }

  void take(const ros::MessageEvent<const tf2_msgs::TFMessage>& event) {
    if (event.getPublisherName() == ros::this_node::getName()) return;
    const std::string& base = settings_.telemetry.frames.base;
    for (const auto& transform : event.getConstMessage()->transforms) {
      const std::string what = fmt::format("TF {} -> {}", transform.header.frame_id, base);
      if (transform.child_frame_id == base)
        warn(what, {event.getPublisherName()}, "besides this node: ~publish_tf = false leaves it to the other");
    }
  }

  void warn(const std::string& what, const Names& names, const char* meaning) {
    const std::string text = fmt::format("{} comes from {} {}", what, fmt::join(names, ", "), meaning);
    if (std::exchange(said_[what], text) != text) ROS_WARN_STREAM(text);
  }

  /// The nodes but this one that the master has as publishers of a topic.
  Names others(XmlRpc::XmlRpcValue& publishers, const char* topic) const {
    Names names;
    for (int k = 0; k < publishers.size(); ++k) {  // NOLINT(modernize-loop-convert): its iterators are a struct's
      if (static_cast<std::string>(publishers[k][0]) != node_.resolveName(topic)) continue;
      for (int i = 0; i < publishers[k][1].size(); ++i) names.push_back(publishers[k][1][i]);
    }
    names.erase(std::remove(names.begin(), names.end(), ros::this_node::getName()), names.end());
    return names;
  }

  const BaseSettings& settings_;
  std::atomic<bool> of_clock_{false};
  Names heard_;                              // on /tf, as of the last look
  std::map<std::string, std::string> said_;  // by subject
  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  ros::Subscriber transforms_;
  ros::WallTimer timer_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace youbot_base_sim
