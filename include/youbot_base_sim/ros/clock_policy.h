#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cstdint>
#include <memory>
#include <string>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/loop/pacer.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/driver_interface.h"
#include "youbot_base_sim/ros/node_constants.h"
#include "youbot_base_sim/ros/publications.h"

namespace youbot_base_sim {

/// The longest wall time, s, that the loop waits without looking whether ROS still runs.
constexpr double kPollInterval = 0.1;

/// What a clock policy asks of the node that it belongs to while it waits.
class ClockOwner {
 public:
  virtual ~ClockOwner() = default;

  virtual const DriverInterface& commands() const = 0;
  virtual ros::CallbackQueue& queue() = 0;
  /// Whether waiting must end: time is paused, or stepped, or ROS has ended.
  virtual bool interrupted() const = 0;
  /// Says what time waits for, where that takes long.
  virtual void report_wait(const std::string& what) = 0;
  /// Publishes what is published at an instant.
  virtual void publish_telemetry() = 0;
  /// Ends the node's loop.
  virtual void end() = 0;
};

/// How simulated time advances, what stamps messages have, and when /clock is published.
///
/// | policy | time waits for | /clock |
/// |---|---|---|
/// | wall clock | the wall clock | none: stamps are wall time |
/// | simulated time | the wall clock times a factor, or nothing | each control period, or where it could be noticed |
/// | lockstep | a command, each control period | each control period |
/// | lockstep of loops | a command, each period of lockstep, and the nodes that follow /clock | each such period, last
/// |
class ClockPolicy {
 public:
  /// The policy that the settings ask for. All references must outlive it.
  static std::unique_ptr<ClockPolicy> make(const BaseSettings& settings, BaseLoop& loop, Publications& publications);

  virtual ~ClockPolicy() = default;

  /// Whether time is simulated time, which this publishes and which can be paused, stepped and reset.
  virtual bool is_master() const { return true; }

  virtual const char* name() const { return "master of simulated time"; }

  /// Queue size of publishers: by simulated time every message counts, by the wall clock the latest.
  virtual std::uint32_t queue_size() const { return kRecorderQueueSize; }

  /// Advertises /clock, if there is one.
  virtual void advertise(ros::NodeHandle&) {}

  /// Whether the end of each control period could be noticed, as far as topics are heard now.
  virtual bool wants_each_period() const { return false; }

  /// Publishes the present time, if /clock is.
  virtual void announce() {}

  /// The present time is due now, and later times accordingly: at the start and after a pause.
  virtual void start() { pacer_.start(loop_.time()); }

  /// Back to t = 0, after the loop.
  virtual void reset() { start(); }

  /// Whether the next control period may begin; waits for what it takes, a while. False: look at all else first.
  virtual bool await(ClockOwner&) { return true; }

  /// Whether messages that are there when a control period is due are taken first.
  virtual bool takes_late_messages() const { return true; }

  /// Control periods that may pass at once, of this many.
  virtual std::int64_t bounded(std::int64_t periods) const { return periods; }

  /// The loop has reached the time that was due. Returns the wall time that it was too slow by and that is given up, s.
  virtual double arrive();

  /// Before what is published at the present time. `is_due`: that is an instant of publishing; `switched`: rollers have
  /// switched.
  virtual void begin_publishing(bool /*is_due*/, bool /*switched*/) {}

  /// After it.
  virtual void end_publishing() {}

  /// After a part of a step.
  virtual void end_of_step() {}

  /// Stamp of simulated time t, s.
  virtual ros::Time stamp(double t) const = 0;

  /// Simulated time at which a message that comes now arrives, s.
  virtual double arrival() const { return loop_.time(); }

  /// What time does without, for diagnostics; empty: nothing.
  virtual std::string lack() const { return ""; }

  /// Simulated seconds per second of wall time, as lately seen.
  double speed() { return speed_.at(loop_.time()); }

  Pacer& pacer() { return pacer_; }

 protected:
  ClockPolicy(double factor, double max_lag, BaseLoop& loop) : loop_(loop), pacer_(factor, max_lag) {}

  BaseLoop& loop_;
  Pacer pacer_;

 private:
  SpeedMeter speed_;
};

}  // namespace youbot_base_sim
