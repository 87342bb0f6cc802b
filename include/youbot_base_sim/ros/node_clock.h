#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>
#include <youbot_base_sim/Step.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/loop/lockstep.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/clock_followers.h"
#include "youbot_base_sim/ros/publications.h"

namespace youbot_base_sim {

/// How simulated time advances, what stamps messages have, and when /clock is published. Deadlines by the wall clock
/// are absolute: the loop catches up after a late instant, unless the lag is beyond a limit and given up as lost.
///
/// | settings | time waits for | /clock |
/// |---|---|---|
/// | no `publish_clock` | the wall clock | none: stamps are wall time |
/// | and /use_sim_time | another node's /clock | that one |
/// | `publish_clock` | the wall clock times a factor, or nothing | each control period, or where it could be noticed |
/// | and `lockstep` | the nodes that follow /clock, until they rest | each period of lockstep, last |
/// | its `period` 0 | a player's command, each control period | each control period |
class NodeClock {
 public:
  /// Once `stop` is set, nothing is waited for. All references must outlive it.
  NodeClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications, const std::atomic<bool>& stop);

  /// Advertises /clock, or follows another node's.
  void connect(ros::NodeHandle& node);

  /// Whether the time is not known yet: another node has not published it.
  bool unknown() const { return follows_ && ros::Time::now().isZero(); }

  /// The nodes that publish /clock, if there are several; else empty. Asks the master in that case.
  std::string rivals() const;

  /// Publishes the present time, if /clock is.
  void announce();

  /// The present time is due now, and later times accordingly: at the start and after a pause.
  void start();

  /// Back to t = 0, after the loop.
  void reset();

  /// Whether the end of each control period could be noticed, as far as topics are heard now.
  bool wants_each_period() const;

  /// Wall time until simulated time t (s) is due, s; not positive if it is.
  double wait_for(double t) const;

  /// Calls `take_callbacks`, which waits for something other than time, and counts its duration as idle.
  template <class TakeCallbacks>
  void wait(const TakeCallbacks& take_callbacks) {
    timing_.busy += since(awake_since_);
    take_callbacks();
    awake_since_ = SteadyClock::now();
  }

  /// The loop has reached the time that was due. Returns the lag that is given up, s of wall time.
  double arrive();

  /// How the loop kept time since the last `take_timing`.
  struct Timing {
    std::int64_t instants = 0;
    double lateness = 0;      ///< from an instant's being due to the loop's arrival there, mean, s
    double max_lateness = 0;  ///< s
    double busy = 0;          ///< share of the time that the loop did not wait
    double lost = 0;          ///< given up, s
    double speed = 0;         ///< simulated seconds per second of wall time
  };

  /// Returns the timing and clears it.
  Timing take_timing();

  /// To be called before and after publishing at the present time. `is_due`: at an instant of publishing; `switched`:
  /// rollers have switched.
  void begin_publishing(bool is_due, bool switched);
  void end_publishing();

  /// Calls `publish`, and advances /clock by a period of lockstep without the simulation.
  template <class Publish>
  void idle(const Publish& publish) {
    lockstep_.idle();
    publish();
    publish_period();
  }

  /// Stamp of simulated time t, s.
  ros::Time stamp(double t) const;

  /// Simulated time at which a message that comes now arrives, s.
  double arrival() const;

  /// Waits until the nodes that follow /clock rest.
  void await_rest() { followers_->await_rest(); }

  Lockstep& lockstep() { return lockstep_; }

 private:
  using SteadyClock = std::chrono::steady_clock;

  static double since(SteadyClock::time_point past) {
    return std::chrono::duration<double>(SteadyClock::now() - past).count();
  }
  double due() const;
  void take_time(const rosgraph_msgs::Clock& message);
  void publish_period();

  const BaseSettings& settings_;
  BaseLoop& loop_;
  Publications& publications_;
  const bool paced_;    // by the wall clock or by commands, each control period
  const bool follows_;  // another node's /clock
  Lockstep lockstep_;
  std::optional<ClockFollowers> followers_;  // in lockstep with those that rest
  ros::CallbackQueue unread_;                // messages of its own
  ros::Subscriber clock_subscriber_;
  ros::Time latest_;               // /clock of another node
  bool running_ = false;           // since the start
  ros::Duration zero_;             // of stamps at t = 0
  SteadyClock::time_point start_;  // when simulated time start_t_ was due
  double start_t_ = 0;             // s
  Timing timing_;                  // lateness and busy as sums, s
  SteadyClock::time_point timing_start_ = SteadyClock::now(), awake_since_ = timing_start_;
  double timing_start_t_ = 0;  // s
};

/// The services of simulated time: ~pause, ~unpause, ~reset, ~end (std_srvs/Empty) and ~step (youbot_base_sim/Step).
///
/// The loop serves them with its callbacks, between control periods. ~step answers only once the loop has advanced by
/// all its periods, so it has a thread of its own, which hands the request to the loop's callback queue. Several steps
/// run one after another.
class TimeServices {
 public:
  /// `reset` goes back to t = 0; it throws std::runtime_error, with a reason for the caller, if it refuses. `end` ends
  /// the node. `queue` is the loop's. All references must outlive this.
  TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, const BaseLoop& loop,
               NodeClock& clock, const std::function<void()>& reset, const std::function<void()>& end);
  ~TimeServices();
  TimeServices(const TimeServices&) = delete;
  TimeServices& operator=(const TimeServices&) = delete;

  // The rest is for the loop's thread.

  /// Whether time stands still but for steps.
  bool paused() const { return paused_; }

  /// Whether a step is under way, and by how many control periods it still is to advance.
  bool stepping() const { return answer_ != nullptr; }
  std::int64_t left() const { return left_; }

  /// The loop has advanced by some of them; the last ones answer the request.
  void advanced(std::int64_t periods);

  /// Answers that the step has ended, or is refused, and why.
  void end_step(const std::string& reason);

 private:
  bool step(Step::Request& request, Step::Response& response);
  void answer(bool success, const std::string& message);

  const BaseLoop& loop_;
  ros::CallbackQueue& loop_queue_;
  ros::CallbackQueue step_queue_;
  ros::NodeHandle step_node_;
  std::vector<ros::ServiceServer> servers_;
  ros::AsyncSpinner spinner_{1, &step_queue_};
  std::atomic<bool> closing_{false};
  std::shared_ptr<std::promise<Step::Response>> answer_;  // null: no step is under way
  std::int64_t left_ = 0;
  bool paused_;
};

}  // namespace youbot_base_sim
