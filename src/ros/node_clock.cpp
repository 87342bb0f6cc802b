#include "youbot_base_sim/ros/node_clock.h"

#include <fmt/format.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>

#include "youbot_base_sim/lockstep/clock_followers.h"
#include "youbot_base_sim/lockstep/step_reports.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/lookout.h"

namespace youbot_base_sim {

namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr double kProbe = 0.25;   // s of wall time that the tenth step waits for commands by the wall clock
constexpr int kMaxAnswers = 100;  // to services that a node calls one after another without sleeping

double since(SteadyClock::time_point past) { return std::chrono::duration<double>(SteadyClock::now() - past).count(); }

}  // namespace

std::string NodeClock::rivals() const {
  if (clock_subscriber_.getNumPublishers() < 2) return "";
  return fmt::format("{}", fmt::join(publishers()[kClockTopic], ", "));
}

double NodeClock::arrive() {
  const double late = lag(loop_.time());
  if (late <= max_lag()) {
    timing_.arrive(late);
    return 0;
  }
  timing_.lose(late);
  return skip(late);
}

bool NodeClock::await_due(TimedLoop& loop, bool has_callbacks) {
  const double wait = wait_for(loop.next_time());
  if (wait <= 0 && !has_callbacks) return true;
  loop.take_callbacks(std::clamp(wait, 0.0, kPollInterval));
  return !loop.interrupted() && wait_for(loop.next_time()) <= 0;
}

void NodeClock::subscribe(ros::NodeHandle& node, const std::function<void(const ros::Time& time)>& take) {
  auto options = ros::SubscribeOptions::create<rosgraph_msgs::Clock>(
      kClockTopic, 1, [take](const auto& message) { take(message->clock); }, {},
      take ? node.getCallbackQueue() : &unread_);
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  clock_subscriber_ = node.subscribe(options);
}

namespace {

/// Time that passes without this node. Stamps count from the node's start.
class WallClock : public NodeClock {
 public:
  using NodeClock::NodeClock;

  const char* name() const override { return "wall clock"; }
  void start() override {
    zero_ = ros::Time::now() - ros::Time();
    start_ = SteadyClock::now();
  }
  ros::Time stamp(double t) const override { return ros::Time() + (zero_ + ros::Duration(t)); }
  double arrival() const override { return std::max(loop_.time(), due()); }

 protected:
  /// Simulated time that has passed since the start, s.
  virtual double passed() const { return since(*start_); }

  double due() const { return start_ ? passed() : loop_.time(); }
  double lag(double t) const override { return due() - t; }
  double skip(double lag) override {
    zero_ += ros::Duration(lag);
    *start_ += std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(lag));
    loop_.bring_requests_forward();
    return lag;
  }

  ros::Duration zero_;                            // stamp of t = 0
  std::optional<SteadyClock::time_point> start_;  // when that was due; empty: before `start`
};

/// Another node's /clock. Where it goes back, the simulation goes on from there. The simulation begins once /clock
/// moves: while it stands, as before a run in lockstep, who hears the first odometry depends on wall time.
class FollowedClock : public WallClock {
 public:
  FollowedClock(BaseLoop& loop, ros::NodeHandle& node) : WallClock(loop) {
    const auto take = [this](const ros::Time& time) {
      if (time < latest_) {
        ROS_WARN("/clock goes back from %g s to %g s: the simulation goes on", latest_.toSec(), time.toSec());
        zero_ += time - latest_;
      }
      if (latest_.isZero()) zero_ = time - ros::Time();
      latest_ = time;
    };
    subscribe(node, take);
    take(ros::Time::now());  // a time that stands is not sent again to a node that has heard it
  }

  const char* name() const override { return "another node's /clock"; }
  std::string missing() const override {
    if (passed() > 0) return "";
    if (!latest_.isZero()) return "another node's /clock, which stands still";
    return "another node's /clock: /use_sim_time is true, ~publish_clock is not. Without such a node, such as where a "
           "lasting roscore has it from another launch: rosparam set /use_sim_time false, and start again";
  }
  void start() override { start_ = SteadyClock::now(); }

 private:
  double passed() const override { return (latest_ - ros::Time() - zero_).toSec(); }

  // Its next message wakes the loop; when that comes is not known.
  double wait_for(double t) const override {
    constexpr double kRounding = 1.5e-9;  // of /clock, s, whose time 0 is 1 ns
    return t <= due() + kRounding ? 0 : std::numeric_limits<double>::infinity();
  }

  ros::Time latest_;
};

/// The wall clock times a factor, or, where that is 0, as fast as possible.
class OwnClock : public NodeClock {
 public:
  OwnClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications, ros::NodeHandle& node)
      : NodeClock(loop), factor_(settings.real_time_factor), publications_(publications) {
    // A newcomer knows a time that stands. Latched, the newest would come before those that still wait in a queue.
    publications.advertise(node, kClockTopic, kClockTopic.queue_size, [this] { announce(); });
    subscribe(node);  // to know of other publishers
  }

  const char* name() const override { return "master of simulated time"; }
  bool is_master() const override { return true; }
  void announce() override { publish(stamp(loop_.time())); }
  void start() override {
    start_ = SteadyClock::now();
    start_t_ = loop_.time();
  }
  std::int64_t periods_left() const override {
    return factor_ > 0 || publications_.heard(kAtPeriods) ? 1 : NodeClock::periods_left();
  }

  // A clock without pace publishes where it matters: each control period would cost more than the simulation itself.
  void begin_publishing(bool is_due, bool happened) override {
    if (factor_ > 0 || is_due || happened) announce();
  }
  ros::Time stamp(double t) const override { return stamp_of(t); }
  ros::Time bag_stamp(double t) const override { return stamp_of(t); }

 protected:
  double lag(double t) const override { return factor_ > 0 ? (start_t_ + factor_ * since(start_) - t) / factor_ : 0; }
  double skip(double lag) override {
    start();
    return lag;
  }

  void publish(const ros::Time& time) const {
    publications_.publish(kClockTopic, [&time] {
      rosgraph_msgs::Clock message;
      message.clock = time;
      return message;
    });
  }

 private:
  const double factor_;
  Publications& publications_;
  SteadyClock::time_point start_;  // when start_t_ was due
  double start_t_ = 0;             // s
};

/// A clock that lets control periods begin one by one or in steps. Time that others take is no lag.
class SteppedClock : public OwnClock {
 public:
  using OwnClock::OwnClock;

  void reset() override {
    released_ = -1;
    start();
  }

 protected:
  double max_lag() const override { return 0; }
  double skip(double) override {
    start();
    return 0;
  }
  bool is_released() const { return loop_.periods() == released_; }
  void release() { released_ = loop_.periods(); }

 private:
  std::int64_t released_ = -1;  // the last control period that was let begin
};

/// A player's: each control period waits for a command.
class PlayedClock : public SteppedClock {
 public:
  PlayedClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications, ros::NodeHandle& node)
      : SteppedClock(settings, loop, publications, node), settings_(settings.lockstep) {}

  std::int64_t periods_left() const override { return 1; }
  bool await(TimedLoop& loop) override {
    if (!is_released()) {
      const bool gives_up = settings_.end_with_commands && settings_.timeout > 0;
      const double patience = gives_up ? settings_.timeout : std::numeric_limits<double>::infinity();
      const bool commanded = loop.await_command(patience, "time waits for");
      if (loop.interrupted()) return false;
      if (!commanded) {
        throw std::runtime_error(
            fmt::format("lockstep: no command for {:g} s at t = {:g} s: the node ends (~end_with_commands)", patience,
                        loop_.time()));
      }
      release();
    }
    return await_due(loop, false);  // callbacks wait: the command in hand is the only one for this period
  }
  void begin_publishing(bool, bool) override { announce(); }

 private:
  const LockstepSettings& settings_;
};

/// In lockstep with the nodes that follow /clock: a gate lets each period of lockstep begin.
class GatedClock : public SteppedClock {
 public:
  GatedClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications, ros::NodeHandle& node,
             const std::atomic<bool>& stop)
      : SteppedClock(settings, loop, publications, node),
        period_(settings.lockstep.period),
        every_(std::max<std::int64_t>(1, std::llround(period_ / loop.control_period()))) {
    const std::chrono::duration<double> patience(settings.lockstep.timeout);
    if (settings.lockstep.wait_for.empty()) {
      gate_ = std::make_unique<ClockFollowers>(node, patience, stop);
    } else {
      gate_ = make_step_reports(node, settings.lockstep.wait_for, patience,
                                [this](const ros::Time& time) { publish(time); });
    }
  }

  void resume() override {
    commanded_ = true;
    start();
  }
  void reset() override {
    commanded_ = false;
    idle_periods_ = 0;
    SteppedClock::reset();
  }
  std::int64_t periods_left() const override { return every_ - loop_.periods() % every_; }

  bool await(TimedLoop& loop) override {
    if (waits()) {
      if (!(commanded_ && gate_->is_ready()) && !await_first_command(loop)) return false;
      await_rest(loop);
      loop.end_with_commands();
      if (loop.interrupted() || !(commanded_ || !loop.commander().empty())) return false;  // which a reset forgets
      release();
      commanded_ = true;
    }
    return await_due(loop, false);  // callbacks wait: the commands in hand are those of this period
  }
  void begin_publishing(bool, bool) override {}
  void end_publishing() override {
    if (begins()) announce();
  }
  void announce() override {
    answers_ = 0;
    gate_->announce(stamp(loop_.time()));
  }
  /// A node whose service call is answered goes on working. One that never rests could go on for ever.
  bool take_answers(TimedLoop& loop) override {
    bool done = true;
    timing().idle([&] { done = gate_->await_rest(); });
    if (done && (!loop.has_callbacks() || ++answers_ > kMaxAnswers)) return true;
    loop.take_callbacks(done ? 0 : kPollInterval);
    if (!done) loop.end_with_commands();
    return false;
  }
  void note_command(const std::string& node) override { gate_->note_message(node); }
  /// All nodes still rest. The tenth step waits a while for commands that come all the same.
  void take_late_commands(TimedLoop& loop) override {
    if (!begins()) return;
    if (loop.has_callbacks()) loop.take_callbacks(0);
    if (loop_.periods() == 10 * every_) loop.await_command(kProbe, "looks out for");
    if (!loop.commander().empty()) gate_->note_late(loop.commander());
  }
  std::string broken_promise() const override { return gate_->broken_promise(); }
  std::map<std::string, std::string> counters() const override { return gate_->counters(); }
  /// Zero would mean no time, so all times are 1 ns later: loops act in the same steps whether they begin before time
  /// is known, and so count from zero, or after.
  ros::Time stamp(double t) const override {
    return ros::TIME_MIN + ros::Duration(static_cast<double>(idle_periods_) * period_ + t);
  }

  /// Within a period messages act from the next on.
  double arrival() const override {
    if (waits()) return loop_.time();
    return static_cast<double>(loop_.periods() + periods_left()) * loop_.control_period();
  }

 private:
  bool begins() const { return loop_.periods() % every_ == 0; }
  bool waits() const { return begins() && !is_released(); }

  /// Before the first command only /clock advances, by the wall clock, for nodes that sleep before they command: how
  /// long that takes must not change the simulation.
  bool await_first_command(TimedLoop& loop) {
    const bool is_ready = gate_->is_ready();
    if (is_ready) loop.await_command(period_, "the simulation begins with ~unpause or");
    if (!is_ready) timing().idle([this] { ros::WallDuration(period_).sleep(); });
    // The first command of a node that still works is one for this period, however long it takes.
    if ((!is_ready || loop.commander().empty()) && !loop.interrupted()) await_rest(loop);
    if (loop.interrupted() || (is_ready && commanded_)) return false;
    const bool commanded = is_ready && !loop.commander().empty();
    if (!commanded) {
      ++idle_periods_;
      loop.publish_telemetry();
      announce();
    }
    return commanded;
  }

  /// Waits until all nodes are done, and takes what they have sent.
  void await_rest(TimedLoop& loop) {
    while (!take_answers(loop) && !loop.interrupted()) continue;
  }

  const double period_;            // of lockstep, s
  const std::int64_t every_;       // control periods
  std::int64_t idle_periods_ = 0;  // of lockstep, before the simulation has begun
  bool commanded_ = false;         // or begun by ~unpause
  int answers_ = 0;                // in this period
  std::unique_ptr<TimeGate> gate_;
};

}  // namespace

std::unique_ptr<NodeClock> make_node_clock(const BaseSettings& settings, BaseLoop& loop, Publications& publications,
                                           ros::NodeHandle& node, const std::atomic<bool>& stop) {
  if (!settings.publish_clock && !ros::Time::isSimTime()) return std::make_unique<WallClock>(loop);
  if (!settings.publish_clock) return std::make_unique<FollowedClock>(loop, node);
  if (!settings.lockstep.on) return std::make_unique<OwnClock>(settings, loop, publications, node);
  if (settings.lockstep.period == 0) return std::make_unique<PlayedClock>(settings, loop, publications, node);
  return std::make_unique<GatedClock>(settings, loop, publications, node, stop);
}

}  // namespace youbot_base_sim
