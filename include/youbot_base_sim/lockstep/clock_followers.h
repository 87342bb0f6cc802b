#pragma once

#include <ros/callback_queue_interface.h>
#include <ros/init.h>
#include <ros/node_handle.h>
#include <ros/single_subscriber_publisher.h>
#include <rosgraph_msgs/Clock.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/lockstep/process.h"
#include "youbot_base_sim/lockstep/time_gate.h"

namespace youbot_base_sim {

/// Sends /clock to single nodes. roscpp does so only in the callback for a new connection: this queue keeps the
/// callback of each connection and calls it again. A new one receives the time at once.
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

  /// Sets the time; false: it is set already.
  bool set_time(const ros::Time& time) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::exchange(message_.clock, time) != time;
  }

  /// Sends the time to the node of this name, if it has come.
  void send(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
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

/// A gate for unmodified nodes: they are done when all their threads sleep.
///
/// ROS 1 has no acknowledgements. But a node that has dealt with everything sleeps in all of its threads, and what is
/// sent over the loopback device wakes its reader before the sender runs on. So if each node has been seen asleep since
/// the last packet on that device, nothing is under way between them. They need not sleep at the same instant, which
/// loops of roscpp, awake each millisecond, seldom do. Beside other traffic, no node may run while all are looked at.
/// The master takes part: a node that subscribes or looks for a service waits for it.
///
/// Nodes whose messages reach each other or a common node receive /clock one after another, by name, with a rest in
/// between, so they act in the same order in every run. All others receive it at the same time.
///
/// The gate waits for a node that SIGSTOP or a debugger has stopped, and names it meanwhile. A node that has ended is
/// at rest, even if its parent has not taken notice. One that was given up is taken back when it rests.
class ClockFollowers : public TimeGate {
 public:
  /// `patience`: wall time for the nodes to come to rest; after it, a warning names the busiest, and the gate gives it
  /// up. Once `stop` is set, nothing is waited for; it must outlive this.
  ClockFollowers(ros::NodeHandle& node, std::chrono::duration<double> patience, const std::atomic<bool>& stop);

  /// Waits for this node too. Its processes are those that hold the socket at which, by the master, it answers: in a
  /// container a process has another number, and one that hangs would not answer. Warns if they cannot be seen.
  void add(const std::string& name);

  bool await_rest() override;

  /// Loops and timers of roscpp look at /clock up to a millisecond later, or more on a virtual machine: waits for them.
  void announce(const ros::Time& time) override;

 private:
  using Clock = std::chrono::steady_clock;
  using Group = std::vector<std::string>;  // of followers that receive /clock at the same time

  struct Node {
    std::vector<Process> processes;  // empty: they cannot be seen
    std::uint32_t port = 0;          // at which it answers XML-RPC
    Clock::duration waited{};        // until it rested, looks included
    int rests_to_return = 0;         // in steps one after another; above 0: it is given up
    bool is_named = false, may_have_polled = false;
  };

  std::pair<std::string, double> slowest() const override { return slowest_of(nodes_); }
  bool goes_on() const { return ros::ok() && !stop_; }
  static Node look_up(const std::string& name);
  void update_nodes();
  void await_sleep();
  void await_links();
  std::string missing_link();
  void order_groups();
  void await_polls(const Group& group);
  static bool rests(Node& node);
  void take_back();
  void warn_of_threads();
  std::uint64_t work_so_far();
  void give_up(const std::map<std::string, int>& awake, int looks);

  ClockLinks links_;
  const Clock::duration patience_;
  const std::atomic<bool>& stop_;
  std::map<std::string, Node> nodes_;             // by name; this one and the master too
  std::vector<Group> groups_;                     // in the order in which they receive /clock
  XmlRpc::XmlRpcValue state_;                     // of the master, by which `groups_` was determined
  std::optional<std::uint64_t> master_work_;      // at that time; empty: nodes have come or gone since
  Clock::time_point settled_;                     // when it is trusted to know nothing new while it does no work
  std::optional<std::uint64_t> packets_at_rest_;  // empty: there was no rest
};

}  // namespace youbot_base_sim
