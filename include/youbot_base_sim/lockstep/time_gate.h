#pragma once

#include <ros/time.h>

#include <map>
#include <string>

namespace youbot_base_sim {

/// When simulated time may advance: once all nodes that follow /clock are done with what was published. The source of
/// /clock, a simulator or a player of bags, publishes the messages of one time and then announces the next.
class TimeGate {
 public:
  virtual ~TimeGate() = default;

  /// Waits until all nodes are done with all messages sent so far. A node that does not come to an end is given up.
  virtual void await_rest() = 0;

  /// Waits for all other messages, sends `time` on /clock unless that was sent last, and waits until all nodes are done
  /// with that too.
  virtual void announce(const ros::Time& time) = 0;

  /// The node has sent a message though all nodes were done. The first time, a warning names it.
  virtual void note_late(const std::string& node) = 0;

  /// Why another run may have another result: nodes that have ever been given up; empty: there are none.
  virtual std::string broken_promise() const = 0;

  /// What /diagnostics shows, by name: steps, late commands, nodes given up, the node that time waits for longest.
  virtual std::map<std::string, std::string> counters() const = 0;
};

}  // namespace youbot_base_sim
