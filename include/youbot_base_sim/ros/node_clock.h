#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/loop_timing.h"
#include "youbot_base_sim/ros/publications.h"

namespace youbot_base_sim {

constexpr double kPollInterval = 0.1;  ///< s of wall time that a loop waits at most without looking if ROS still runs

/// The loop that a NodeClock serves: what it does while time waits.
class TimedLoop {
 public:
  virtual ~TimedLoop() = default;

  /// Takes callbacks, and waits for the first one at most `timeout`, s of wall time.
  virtual void take_callbacks(double timeout) = 0;
  virtual bool has_callbacks() = 0;

  /// True if the loop has something else to do than to wait for time.
  virtual bool interrupted() const = 0;

  /// Simulated time to which the loop would advance now, s.
  virtual double next_time() = 0;

  /// The node that has commanded since the loop last advanced, as the last one; empty: none.
  virtual const std::string& commander() const = 0;

  /// Waits for a command at most `patience`, s of wall time, and reports `what` it waits for. Returns if one came.
  virtual bool await_command(double patience, const char* what) = 0;

  /// Ends the loop if it is to end with the last publisher of commands and that has gone.
  virtual void end_with_commands() = 0;

  /// Publishes the present state with the present stamp.
  virtual void publish_telemetry() = 0;
};

/// The passage of simulated time, the stamps of messages, and the publisher of /clock. Deadlines by the wall clock are
/// absolute: the loop catches up after a late instant, unless the lag is beyond a limit and given up as lost.
///
/// | clock | settings | time waits for | /clock |
/// |---|---|---|---|
/// | wall | no `publish_clock` | the wall clock | none: stamps are wall time |
/// | followed | and /use_sim_time | another node's /clock | that one |
/// | own | `publish_clock` | the wall clock times a factor, or nothing | each control period, or where it is noticed |
/// | played | and `lockstep`, its `period` 0 | a player's command, each control period | each control period |
/// | gated | its `period` above 0 | a TimeGate: all that follow /clock, or `wait_for` | each period of lockstep, last |
class NodeClock {
 public:
  /// All references, also those of derived classes, must outlive this.
  explicit NodeClock(BaseLoop& loop) : loop_(loop) {}
  virtual ~NodeClock() = default;
  NodeClock(const NodeClock&) = delete;
  NodeClock& operator=(const NodeClock&) = delete;

  /// The source of time, for the log.
  virtual const char* name() const = 0;

  /// True if this node decides when time passes: then its services may stop it.
  virtual bool is_master() const { return false; }

  /// A message that must come before the time is known; empty: it is known.
  virtual std::string missing() const { return ""; }

  /// The nodes that publish /clock, if there are several; else empty. Asks the master in that case.
  std::string rivals() const;

  /// The present time is due now, and later times accordingly: at the start; after a pause, or to begin without a
  /// command; at t = 0 again, after the loop.
  virtual void start() = 0;
  virtual void resume() { start(); }
  virtual void reset() { start(); }

  /// Control periods that may pass at once, 1 or more: until a time that could be noticed, as far as topics are heard.
  virtual std::int64_t periods_left() const { return std::numeric_limits<std::int64_t>::max(); }

  /// Waits a while until `loop` may advance to its `next_time`. Returns whether it may.
  virtual bool await(TimedLoop& loop) { return await_due(loop, loop.has_callbacks()); }

  /// The loop has reached the time that was due. Returns the lag that is given up, s of wall time.
  double arrive();

  /// Publishes the present time, if this clock does: at the start and after a ~step.
  virtual void announce() {}

  /// Takes callbacks before each part of a ~step. Returns false while nodes of lockstep are not done.
  virtual bool take_answers(TimedLoop& loop) {
    if (loop.has_callbacks()) loop.take_callbacks(0);
    return true;
  }
  virtual void note_command(const std::string& /*node*/) {}  ///< the node has sent one

  /// The loop has advanced without a callback: commands that have come meanwhile do not follow from simulated time.
  virtual void take_late_commands(TimedLoop& /*loop*/) {}

  /// Call them before and after publishing at the present time. `is_due`: at an instant of publishing; `happened`:
  /// there are events since the last call.
  virtual void begin_publishing(bool /*is_due*/, bool /*happened*/) {}
  virtual void end_publishing() {}

  /// The reason why another run may have another result though the clock is to prevent that; empty: nothing is known.
  virtual std::string broken_promise() const { return ""; }
  virtual std::map<std::string, std::string> counters() const { return {}; }  ///< for /diagnostics, by name

  /// Stamp of simulated time t (s) on topics, and in a bag.
  virtual ros::Time stamp(double t) const = 0;
  virtual ros::Time bag_stamp(double t) const { return stamp(t); }

  /// Simulated time at which a message that comes now arrives, s.
  virtual double arrival() const { return loop_.time(); }

  LoopTiming& timing() { return timing_; }

 protected:
  /// Wall time that has passed since simulated time t (s) was due, s; negative if it is not.
  virtual double lag(double t) const = 0;

  /// The largest lag that the loop catches up with, s of wall time.
  virtual double max_lag() const { return 1; }

  /// Sets this clock back by `lag`, s. Returns the part of it that is an error.
  virtual double skip(double lag) = 0;

  /// Wall time until simulated time t (s) is due, s; not positive if it is.
  virtual double wait_for(double t) const { return -lag(t); }

  /// Takes callbacks if there are some or the loop's next time is not due. Returns whether that is due.
  bool await_due(TimedLoop& loop, bool has_callbacks);

  /// Subscribes to /clock. Among the callbacks of `node`, calls `take(time)` for each message; without it, reads none.
  void subscribe(ros::NodeHandle& node, const std::function<void(const ros::Time& time)>& take = {});

  BaseLoop& loop_;

 private:
  LoopTiming timing_;
  ros::CallbackQueue unread_;
  ros::Subscriber clock_subscriber_;
};

/// The clock of these settings, whose topics are those of `node`. Once `stop` is set, nothing is waited for.
std::unique_ptr<NodeClock> make_node_clock(const BaseSettings& settings, BaseLoop& loop, Publications& publications,
                                           ros::NodeHandle& node, const std::atomic<bool>& stop);

}  // namespace youbot_base_sim
