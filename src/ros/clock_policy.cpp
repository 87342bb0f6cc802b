#include "youbot_base_sim/ros/clock_policy.h"

#include <fmt/format.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>

#include "youbot_base_sim/loop/lockstep.h"
#include "youbot_base_sim/ros/clock_followers.h"
#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {

namespace {

constexpr double kMaxLag = 1.0;  // s of wall time, before the loop stops catching up

class WallClock : public ClockPolicy {
 public:
  explicit WallClock(BaseLoop& loop) : ClockPolicy(1, kMaxLag, loop) {}

  bool is_master() const override { return false; }
  const char* name() const override { return "wall clock"; }
  std::uint32_t queue_size() const override { return kDriverQueueSize; }

  void start() override {
    zero_ = ros::Time::now();
    ClockPolicy::start();
  }

  double arrive() override {
    const double lost = ClockPolicy::arrive();
    zero_ += ros::Duration(lost);
    return lost;
  }

  ros::Time stamp(double t) const override { return zero_ + ros::Duration(t); }
  double arrival() const override { return zero_.isZero() ? loop_.time() : std::max(loop_.time(), pacer_.now()); }

 private:
  ros::Time zero_;  // wall time of t = 0; zero before the start
};

class SimulatedTime : public ClockPolicy {
 public:
  SimulatedTime(double factor, double max_lag, bool paced, BaseLoop& loop, Publications& publications)
      : ClockPolicy(factor, max_lag, loop), publications_(publications), paced_(paced) {}

  // Latched, so that a node that comes later, perhaps while time stands still, knows the time at once.
  void advertise(ros::NodeHandle& node) override {
    publications_.advertise<rosgraph_msgs::Clock>(
        node, kClockTopic, kRecorderQueueSize, true, [this](const std::string& name) { gain(name); },
        [this](const std::string& name) { lose(name); });
  }

  bool wants_each_period() const override {
    return paced_ || publications_.heard(kRollerSwitchesTopic) || publications_.heard(kClockTopic);
  }

  void announce() override {
    publications_.publish(kClockTopic, [this] {
      rosgraph_msgs::Clock message;
      message.clock = stamp(loop_.time());
      return message;
    });
  }

  // With nothing to keep pace with, a /clock message each control period would cost more than the simulation itself.
  void begin_publishing(bool is_due, bool switched) override {
    if (paced_ || is_due || switched) announce();
  }

  ros::Time stamp(double t) const override { return stamp_of(t); }

 protected:
  virtual void gain(const std::string&) {}
  virtual void lose(const std::string&) {}

 private:
  Publications& publications_;
  const bool paced_;  // by the wall clock or by commands, each control period
};

class LockstepClock : public SimulatedTime {
 public:
  LockstepClock(const BaseSettings& settings, bool paced, BaseLoop& loop, Publications& publications)
      : SimulatedTime(settings.real_time_factor, 0, paced, loop, publications),
        settings_(settings.lockstep),
        lockstep_(settings.lockstep, loop.control_period()) {}

  bool await(ClockOwner& owner) override;
  bool takes_late_messages() const override { return false; }  // the command in hand is the only one for this period
  double arrive() override { return pacer_.arrive(loop_.time()), 0; }
  std::string lack() const override {
    const bool lacks = lockstep_.started() && lockstep_.unanswered();
    return lacks ? "lockstep: no command: time goes on without" : "";
  }
  void reset() override {
    lockstep_.reset();
    SimulatedTime::reset();
  }

 protected:
  virtual std::int64_t idle_periods() const { return 0; }
  virtual void idle(ClockOwner&) {}
  virtual void await_followers(ClockOwner&) {}

  const LockstepSettings settings_;
  Lockstep lockstep_;

 private:
  bool advance_without_command(ClockOwner& owner);
};

/// Waits for the command message of the next period of lockstep.
bool LockstepClock::await(ClockOwner& owner) {
  using SteadyClock = std::chrono::steady_clock;
  if (!lockstep_.waits(loop_.periods())) return true;
  const auto start = SteadyClock::now();
  const DriverInterface& commands = owner.commands();
  while (!commands.commanded() && !owner.interrupted()) {
    const double left = lockstep_.patience() - std::chrono::duration<double>(SteadyClock::now() - start).count();
    if (left <= 0) return advance_without_command(owner);
    pacer_.idle([&] { owner.queue().callOne(ros::WallDuration(std::min(left, kPollInterval))); });
    if (commands.commanded() || !owner.queue().isEmpty()) continue;
    if (settings_.end_with_commands && lockstep_.started() && !commands.has_commander()) {
      ROS_INFO("no publisher of commands is left: the node ends at t = %g s", loop_.time());
      owner.end();
      return false;
    }
    owner.report_wait(fmt::format("lockstep: time waits at t = {:g} s for a command on {}, {} or {}", loop_.time(),
                                  kTwistTopic, kTorqueTopic, kVelocityTopic));
  }
  if (commands.commanded()) await_followers(owner);
  if (!commands.commanded() || owner.interrupted()) return false;
  lockstep_.release(loop_.periods(), true);
  return true;
}

/// No command has come in time. Before the first one nothing is simulated: /clock alone advances, for nodes that sleep
/// before they command, and how long that takes must not matter.
bool LockstepClock::advance_without_command(ClockOwner& owner) {
  const std::string none =
      fmt::format("lockstep: no command for {:g} s at t = {:g} s", settings_.timeout, loop_.time());
  if (lockstep_.ends(idle_periods())) throw std::runtime_error(none + ": the node ends, by ~end_with_commands");
  if (lockstep_.idles()) {
    idle(owner);
  } else {
    if (!lockstep_.unanswered()) ROS_WARN("%s: time goes on without, by the wall clock, until one comes", none.c_str());
    lockstep_.release(loop_.periods(), false);
  }
  return lockstep_.started();
}

/// Lockstep with nodes that have loops of their own: /clock advances by whole periods of lockstep, each once all else
/// has arrived.
class LoopLockstepClock : public LockstepClock {
 public:
  LoopLockstepClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications)
      : LockstepClock(settings, false, loop, publications) {}

  bool wants_each_period() const override { return false; }
  std::int64_t bounded(std::int64_t periods) const override {
    return std::min(periods, lockstep_.left(loop_.periods()));
  }
  void begin_publishing(bool, bool) override {}
  void end_publishing() override {
    if (lockstep_.begins(loop_.periods())) publish_period();
  }
  void end_of_step() override { announce(); }
  ros::Time stamp(double t) const override {
    return stamp_of(static_cast<double>(idle_periods_) * settings_.period + t);
  }

  // Within a period messages act from the next on.
  double arrival() const override {
    const std::int64_t k = loop_.periods();
    if (lockstep_.waits(k)) return loop_.time();
    return static_cast<double>(k + lockstep_.left(k)) * loop_.control_period();
  }

  void reset() override {
    idle_periods_ = 0;
    LockstepClock::reset();
  }

 private:
  void gain(const std::string& name) override { followers_.add(name); }
  void lose(const std::string& name) override { followers_.remove(name); }
  std::int64_t idle_periods() const override { return idle_periods_; }

  void idle(ClockOwner& owner) override {
    ++idle_periods_;
    owner.publish_telemetry();
    publish_period();
  }

  // The nodes that command may work on until they sleep. At t = 0 /clock has 1 ns, because zero means no time; a loop
  // that sleeps from there would miss the first period by that.
  void await_followers(ClockOwner& owner) override {
    if (idle_periods_ == 0) idle(owner);
    followers_.await_rest();
    pacer_.idle([&] { owner.queue().callAvailable(); });
  }

  void publish_period() {
    followers_.await_rest();
    announce();
    followers_.let_clock_arrive();
  }

  ClockFollowers followers_;
  std::int64_t idle_periods_ = 0;  // of lockstep by which /clock has advanced before the first command
};

}  // namespace

double ClockPolicy::arrive() {
  const double lost = pacer_.arrive(loop_.time());
  if (lost > 0) loop_.bring_requests_forward();
  return lost;
}

std::unique_ptr<ClockPolicy> ClockPolicy::make(const BaseSettings& settings, BaseLoop& loop,
                                               Publications& publications) {
  const double factor = settings.real_time_factor;
  if (!settings.publish_clock) return std::make_unique<WallClock>(loop);
  if (!settings.lockstep.on) return std::make_unique<SimulatedTime>(factor, kMaxLag, factor > 0, loop, publications);
  if (settings.lockstep.period == 0) return std::make_unique<LockstepClock>(settings, true, loop, publications);
  return std::make_unique<LoopLockstepClock>(settings, loop, publications);
}

}  // namespace youbot_base_sim
