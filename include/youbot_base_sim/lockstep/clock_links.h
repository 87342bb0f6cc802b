#pragma once

#include <ros/callback_queue_interface.h>
#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>
#include <rosgraph_msgs/Clock.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace youbot_base_sim {

/// Sends /clock to single nodes. roscpp does so only in the callback for a new connection: this queue keeps the
/// callback of each connection and calls it again. A new one receives the latest time at once.
class ClockLinks : public ros::CallbackQueueInterface {
 public:
  explicit ClockLinks(ros::NodeHandle& node) {
    const auto send = [this](const ros::SingleSubscriberPublisher& link) {
      name_ = link.getSubscriberName();
      if (!message_.clock.isZero()) link.publish(message_);
    };
    const auto end = [this](const ros::SingleSubscriberPublisher& gone) {
      const auto link = links_.find(gone.getSubscriberName());
      if (link == links_.end()) return;
      const bool stays = --link->second.connections > 0;
      changes_.emplace_back(link->first, stays);
      if (!stays) links_.erase(link);
    };
    auto options = ros::AdvertiseOptions::create<rosgraph_msgs::Clock>("/clock", 1000, send, end, {}, this);
    publisher_ = node.advertise(options);
  }

  /// The nodes that have come (true) and gone since the last call. One of the same name takes over from the other.
  std::vector<std::pair<std::string, bool>> take_changes() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(changes_, {});
  }

  /// Sends `time` to the node of this name, if it has come.
  void send(const std::string& name, const ros::Time& time) {
    const std::lock_guard<std::mutex> lock(mutex_);
    message_.clock = time;
    if (const auto link = links_.find(name); link != links_.end()) link->second.last->call();
  }

  void addCallback(const ros::CallbackInterfacePtr& callback, std::uint64_t /*owner*/) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    name_.clear();
    callback->call();
    if (name_.empty()) return;  // it has gone
    Link& link = links_[name_];
    link.last = callback;
    ++link.connections;
    changes_.emplace_back(name_, true);
  }
  void removeByID(std::uint64_t /*owner*/) override {}

 private:
  struct Link {
    ros::CallbackInterfacePtr last;
    int connections = 0;
  };

  std::mutex mutex_;
  rosgraph_msgs::Clock message_;
  std::string name_;  // of the link that was called last
  std::map<std::string, Link> links_;
  std::vector<std::pair<std::string, bool>> changes_;
  ros::Publisher publisher_;
};

}  // namespace youbot_base_sim
