#pragma once

#include <sys/types.h>

#include <chrono>
#include <map>
#include <set>
#include <string>

namespace youbot_base_sim {

/// The nodes that follow /clock, and whether they have dealt with all that was published.
///
/// ROS 1 has no acknowledgements. But a node on this machine that has dealt with everything sleeps in all of its
/// threads, and what is sent over the loopback device wakes its reader before the sender runs on. So while no thread of
/// any follower or of this process runs, nothing is under way between them. The states come from /proc.
///
/// A node's processes are those that hold the socket at which, by the master, it answers. The node itself is not
/// asked: in a container its process number is another process's here, and one that hangs would not answer.
class ClockFollowers {
 public:
  /// `patience`: wall time for a node to come to rest.
  explicit ClockFollowers(std::chrono::milliseconds patience = std::chrono::seconds(10));

  /// A node subscribes to /clock. Warns if its processes cannot be seen from here.
  void add(const std::string& node);

  /// A node has gone.
  void remove(const std::string& node) { processes_.erase(node); }

  /// /clock has just been published: waits until it has arrived. A node that sleeps by it may look at it no sooner than
  /// a millisecond later, as roscpp does; `await_rest` gives it that time.
  void let_clock_arrive();

  /// Waits until all of them have come to rest. A node that takes longer than the patience is not waited for again,
  /// with a warning that names it.
  void await_rest();

 private:
  using Clock = std::chrono::steady_clock;

  std::string restless() const;

  const std::chrono::milliseconds patience_;
  std::map<std::string, std::set<pid_t>> processes_;  // by node, of this one too
  Clock::time_point seen_;                            // /clock, by all of them
};

}  // namespace youbot_base_sim
