#pragma once

#include <ros/time.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace youbot_base_sim {

/// Decides when simulated time may advance: once all nodes that it waits for are done with what was published. The
/// source of /clock, a simulator or a player of bags, publishes the messages of one time and then announces the next.
class TimeGate {
 public:
  virtual ~TimeGate() = default;

  /// True once the gate knows all nodes that it waits for: before, only /clock may advance.
  virtual bool is_ready() const { return true; }

  /// Waits until all nodes are done with all messages sent so far, or returns false: the caller takes callbacks and
  /// asks again. A node that does not come to an end is given up.
  virtual bool await_rest() = 0;

  /// The node has sent a message to the source of /clock.
  virtual void note_message(const std::string& /*node*/) {}

  /// Sends `time` on /clock unless that was sent last. A gate that does not depend on messages waits before and after.
  virtual void announce(const ros::Time& time) = 0;

  /// The node has sent a message though all nodes were done. The first time, a warning names it.
  void note_late(const std::string& node);

  /// The reason why another run may have another result: nodes that have ever been given up; empty: there are none.
  std::string broken_promise() const;

  /// Values for /diagnostics, by name: steps, late commands, nodes given up, the node that time waits for longest.
  std::map<std::string, std::string> counters() const;

 protected:
  /// Of the nodes' members `waited`.
  template <class Nodes>
  static std::pair<std::string, double> slowest_of(const Nodes& nodes) {
    const auto found = std::max_element(nodes.begin(), nodes.end(),
                                        [](const auto& a, const auto& b) { return a.second.waited < b.second.waited; });
    return {found->first, std::chrono::duration<double, std::milli>(found->second.waited).count()};
  }

  std::int64_t steps_ = 0;
  std::set<std::string> given_up_;  // nodes, ever

 private:
  /// The node that time has waited for longest, and for how long in all, ms of wall time.
  virtual std::pair<std::string, double> slowest() const = 0;

  std::map<std::string, int> late_;  // commands, by node
};

}  // namespace youbot_base_sim
