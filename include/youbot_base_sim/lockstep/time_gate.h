#pragma once

#include <ros/time.h>

#include <set>
#include <string>

namespace youbot_base_sim {

/// When simulated time may advance: once all nodes that follow /clock are done with what was published. The source of
/// /clock, a simulator or a player of bags, publishes the messages of one time and then announces the next.
class TimeGate {
 public:
  virtual ~TimeGate() = default;

  /// The node `name` subscribes to /clock.
  virtual void add(const std::string& name) = 0;

  /// The node `name` has unsubscribed.
  virtual void remove(const std::string& name) = 0;

  /// Waits until all nodes are done with all messages sent so far. A node that does not come to an end is given up.
  virtual void await_rest() = 0;

  /// The nodes that have ever been given up.
  virtual const std::set<std::string>& given_up() const = 0;

  /// Waits for all other messages, sends `time` on /clock, and waits until it has arrived.
  virtual void announce(const ros::Time& time) = 0;
};

}  // namespace youbot_base_sim
