#pragma once

#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <map>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "youbot_base_sim/ros/base_settings.h"

namespace youbot_base_sim {

using Publishers = std::map<std::string, std::set<std::string>>;

/// The names of the nodes that publish, by the full name of their topic; empty if the master does not answer.
inline Publishers publishers() {
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", request, response, state, false)) return {};
  Publishers nodes;
  for (int k = 0; k < state[0].size(); ++k) {
    for (int i = 0; i < state[0][k][1].size(); ++i)  // NOLINT(modernize-loop-convert): its iterators are a struct's
      nodes[state[0][k][0]].insert(state[0][k][1][i]);
  }
  return nodes;
}

/// Warns of what other nodes do to this one: publish its odometry or its transform, command it beside each other, set
/// its parameters, which it has read. Asks the master in a thread of its own, which a silent master may block.
class Lookout {
 public:
  /// Topics are those of `node`, parameters those of `private_node`. `settings` must outlive this.
  Lookout(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const BaseSettings& settings)
      : settings_(settings), node_(node), private_node_(private_node) {
    private_node_.getParam("", parameters_);
    node_.setCallbackQueue(&queue_);
    timer_ = node_.createWallTimer(ros::WallDuration(0.1), &Lookout::look, this);
    spinner_.start();
  }
  Lookout(const Lookout&) = delete;
  Lookout& operator=(const Lookout&) = delete;

 private:
  using Names = std::set<std::string>;

  void look(const ros::WallTimerEvent& /*event*/) {
    timer_.setPeriod(ros::WallDuration(5), false);
    Publishers nodes = publishers();
    const Names commanders = others(nodes, kTwistTopic), odometers = others(nodes, kOdometryTopic);
    if (commanders.size() > 1) warn(kTwistTopic, commanders, "the newest command counts");
    if (!odometers.empty()) warn(kOdometryTopic, odometers, "beside this node: listeners mix the two");
    if (settings_.publish_tf) listen(others(nodes, kTransformsTopic));
    XmlRpc::XmlRpcValue now;
    private_node_.getParam("", now);
    if (now.getType() != XmlRpc::XmlRpcValue::TypeStruct) return;
    for (auto& [name, value] : now) {
      if (std::exchange(parameters_[name], value) == value) continue;
      std::ostringstream text;
      value.write(text);
      ROS_WARN_STREAM("parameter ~" << name << " = " << text.str() << " is set too late, without effect");
    }
  }

  /// Hears /tf from one look to the next whenever `publishers` have changed: always would cost more than it finds.
  void listen(const Names& publishers) {
    transforms_.shutdown();
    if (std::exchange(heard_, publishers) == publishers || publishers.empty()) return;
    transforms_ = node_.subscribe(kTransformsTopic, 100, &Lookout::take, this);
  }

  void take(const ros::MessageEvent<const tf2_msgs::TFMessage>& event) {
    const std::string& name = event.getPublisherName();
    for (const auto& transform : event.getConstMessage()->transforms) {
      if (transform.child_frame_id != settings_.telemetry.frames.base || name == ros::this_node::getName()) continue;
      warn("TF " + transform.header.frame_id + " -> " + transform.child_frame_id, {name},
           "beside this node: ~publish_tf = false leaves it to the other");
    }
  }

  void warn(const std::string& subject, const Names& names, const char* meaning) {
    const std::string text = fmt::format("{} comes from {}: {}", subject, fmt::join(names, ", "), meaning);
    if (said_.insert(text).second) ROS_WARN_STREAM(text);
  }

  /// The nodes but this one that publish a topic.
  Names others(Publishers& nodes, const std::string& topic) const {
    Names names = nodes[node_.resolveName(topic)];
    names.erase(ros::this_node::getName());
    return names;
  }

  const BaseSettings& settings_;
  XmlRpc::XmlRpcValue parameters_;  // as of the last look; at first as this node has read them
  Names heard_;                     // on /tf, as of the last look
  std::set<std::string> said_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_, private_node_;
  ros::Subscriber transforms_;
  ros::WallTimer timer_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace youbot_base_sim
