#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/ros/process.h"

namespace youbot_base_sim {

/// The nodes that follow /clock, and whether they have dealt with all that was published.
///
/// ROS 1 has no acknowledgements. But a node that has dealt with everything sleeps in all of its threads, and what is
/// sent over the loopback device wakes its reader before the sender runs on. So while /proc shows no running thread of
/// any follower or of this process, nothing is under way between them.
///
/// The master takes part: a node that subscribes or looks for a service waits for it.
///
/// A node that is stopped, by SIGSTOP or a debugger, is waited for until it goes on, and named meanwhile. One that has
/// ended rests, whether its parent has taken notice or not.
///
/// A node's processes are those that hold the socket at which, by the master, it answers. The node itself is not
/// asked: in a container its process has another number, and one that hangs would not answer.
class ClockFollowers {
 public:
  /// `patience`: wall time for a node to come to rest; after it, the node is named in a warning and given up. Nothing
  /// is waited for once `stop` is set, which must outlive this.
  ClockFollowers(std::chrono::milliseconds patience, const std::atomic<bool>& stop);

  /// A node subscribes to /clock. Warns if its processes cannot be seen from here.
  void add(const std::string& node);
  void remove(const std::string& node) { processes_.erase(node); }

  /// Waits until the /clock just published has arrived. Loops and timers of roscpp look at it up to a millisecond
  /// later, or more on a virtual machine: `await_rest` waits for those first.
  void let_clock_arrive();

  /// Waits until all of them have come to rest.
  void await_rest();

 private:
  using Clock = std::chrono::steady_clock;

  bool goes_on() const;
  void await_polls(Clock::time_point arrived);
  bool rest();
  void await_continuation(const std::string& node, std::vector<Process>& processes) const;
  std::uint64_t work_so_far();
  void give_up_busiest();

  const std::chrono::milliseconds patience_;
  const std::atomic<bool>& stop_;
  std::map<std::string, std::vector<Process>> processes_;  // by node; of this one and the master too
  std::optional<Clock::time_point> arrived_;               // the last /clock, until its polls have been waited for
};

}  // namespace youbot_base_sim
