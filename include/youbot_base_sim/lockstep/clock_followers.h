#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "youbot_base_sim/lockstep/process.h"
#include "youbot_base_sim/lockstep/time_gate.h"

namespace youbot_base_sim {

/// A gate for unmodified nodes: they are done when all their threads sleep.
///
/// ROS 1 has no acknowledgements. But a node that has dealt with everything sleeps in all of its threads, and what is
/// sent over the loopback device wakes its reader before the sender runs on. So while /proc shows no running thread of
/// any follower or of this process, nothing is under way between them.
///
/// The master takes part: a node that subscribes or looks for a service waits for it.
///
/// The gate waits for a node that SIGSTOP or a debugger has stopped, and names it meanwhile. A node that has ended is
/// at rest, even if its parent has not taken notice.
///
/// A node's processes are those that hold the socket at which, by the master, it answers. The gate does not ask the
/// node: in a container its process has another number, and one that hangs would not answer.
class ClockFollowers : public TimeGate {
 public:
  using Publish = std::function<void(const ros::Time& time)>;

  /// `publish` sends /clock to all followers. `patience`: wall time for a node to come to rest; after it, a warning
  /// names the node, and the gate gives it up. Once `stop` is set, which must outlive this, nothing is waited for.
  ClockFollowers(Publish publish, std::chrono::milliseconds patience, const std::atomic<bool>& stop);

  /// Warns if the processes of the node cannot be seen from here.
  void add(const std::string& node) override;
  void remove(const std::string& node) override { processes_.erase(node); }

  void await_rest() override;
  const std::set<std::string>& given_up() const override { return given_up_; }

  /// Loops and timers of roscpp look at /clock up to a millisecond later, or more on a virtual machine: the next
  /// `await_rest` waits for those first.
  void announce(const ros::Time& time) override;

 private:
  using Clock = std::chrono::steady_clock;

  bool goes_on() const;
  void await_polls(Clock::time_point arrived);
  bool rest();
  void await_continuation(const std::string& node, std::vector<Process>& processes) const;
  std::uint64_t work_so_far();
  void drop_busiest();

  const Publish publish_;
  const std::chrono::milliseconds patience_;
  const std::atomic<bool>& stop_;
  std::map<std::string, std::vector<Process>> processes_;  // by node; of this one and the master too
  std::set<std::string> given_up_;
  std::optional<Clock::time_point> arrived_;  // when the last /clock did; empty: its polls are over
};

}  // namespace youbot_base_sim
