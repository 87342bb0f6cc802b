#pragma once

#include <sys/types.h>

#include <map>
#include <string>

namespace youbot_base_sim {

/// The nodes that follow /clock, and whether they have dealt with all that was published.
///
/// ROS 1 has no acknowledgements. But a node on this machine that has dealt with everything sleeps in all of its
/// threads, and what is sent over the loopback device wakes its reader before the sender goes on. So while no thread of
/// any follower or of this process runs, nothing is under way between them. /proc tells.
class ClockFollowers {
 public:
  /// A node subscribes to /clock. Asks the master and the node for its process.
  void add(const std::string& node);

  /// A node has gone.
  void remove(const std::string& node) { processes_.erase(node); }

  /// Waits until all of them have come to rest. Whoever takes longer than ten seconds, or runs on another machine, is
  /// not waited for again, with a warning.
  void await_rest();

 private:
  std::string restless();

  std::map<std::string, pid_t> processes_;  // by node
};

}  // namespace youbot_base_sim
