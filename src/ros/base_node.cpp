#include "youbot_base_sim/ros/base_node.h"

#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/ros/bag.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/diagnostics.h"
#include "youbot_base_sim/ros/driver_interface.h"
#include "youbot_base_sim/ros/lookout.h"
#include "youbot_base_sim/ros/node_clock.h"
#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/ros/publications.h"
#include "youbot_base_sim/ros/telemetry.h"
#include "youbot_base_sim/ros/throttled_log.h"
#include "youbot_base_sim/ros/time_services.h"

namespace youbot_base_sim {

namespace {

constexpr double kRecorderDelay = 0.2;    // s of wall time from a recorder's subscription to its first message at most
constexpr double kFlushDelay = 0.2;       // s of wall time for the last message to leave before the node ends
constexpr double kDiagnosticsRate = 0.5;  // Hz, as the driver's
constexpr double kMaxAhead = 0.02;  // s of simulated time that may pass at once, unless a control period is longer

// Diagnostics report what time waits for after a second and then every two, the console every tenth second.
const ros::WallDuration kFirstNotice(1), kNextNotice(2);
constexpr int kNoticesPerLine = 5;

/// One number if all wheels have the same, else four.
std::string wheels_text(const Wheels& values) {
  if ((values == values[0]).all()) return fmt::format("{:g}", values[0]);
  return fmt::format("[{:g}]", fmt::join(values.data(), values.data() + kWheels, ", "));
}

/// `DriverInterface` enqueues requests for a `BaseLoop`, whose state and sensors are published when a `NodeClock` says
/// so. Where that is the master of simulated time, `TimeServices` control it.
///
/// The loop stops only at instants that a subscriber could notice, and every 20 ms; waiting, it processes callbacks.
///
/// odom, base/joint_states and /tf stop while the driver has no base, as after a loss of EtherCAT: the driver's do.
class BaseNode final : private TimedLoop {
 public:
  BaseNode(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::atomic<bool>& stop)
      : settings_(read_base_settings({private_node, "~"}, {node, ""})),
        stop_(stop),
        loop_(settings_),
        telemetry_(settings_.scene, settings_.telemetry),
        end_(settings_.end_time > 0 ? settings_.end_time : kInfinity),
        diagnosing_(kDiagnosticsRate),
        node_(node),
        private_node_(private_node) {
    node_.setCallbackQueue(&queue_);
    private_node_.setCallbackQueue(&queue_);
    if (!settings_.bag.empty()) open_bag();
    clock_ = make_node_clock(settings_, loop_, publications_, node_, stop_);
    advertise();
    interface_.emplace(loop_, *clock_, settings_, node_, private_node_, log_);
    time_services_.emplace(
        private_node_, queue_, settings_.start_paused, loop_, *clock_, [this] { reset(); },
        [this] { end("~end is called"); });
  }

  void run() {
    loop_.stop_on(stop_);
    try {
      run_loop();
      const std::string reason = clock_->broken_promise();
      if (settings_.lockstep.strict && !reason.empty()) throw std::runtime_error(reason + " (~lockstep_strict)");
    } catch (const Stopped&) {  // within a control period
    } catch (const std::exception&) {
      const std::string name = bag_ ? bag_->keep_incomplete() : "";
      if (!name.empty()) ROS_ERROR("the bag, up to here, is kept as %s", name.c_str());
      throw;
    }
    if (stop_requested()) ros::shutdown();  // by a signal: now, so that a last line goes where it is still printed
    if (bag_) bag_->commit();
  }

 private:
  /// The reason why simulated time does not advance, and its reports.
  struct Wait {
    std::string what;  ///< empty: it advances
    ros::SteadyTime due;
    int reports = 0;
  };

  void open_bag() {
    try {
      bag_.emplace(OutputOpener(settings_.scene.files).open("bag", settings_.bag, OutputFile::Access::kAnywhere),
                   node_.getNamespace(), [this](double t) { return clock_->bag_stamp(t); });
    } catch (const std::runtime_error& error) {
      throw ParameterError(fmt::format("parameter ~bag: {}", error.what()));
    }
  }

  /// Advertises all topics but /clock, and publishes what does not change.
  void advertise() {
    const auto fixed_transforms = [this] {
      return telemetry_.static_transforms(loop_.simulation(), loop_.sensors(), ros::Time::now());
    };
    std::set<std::string> absent = {kClockTopic};
    if (!loop_.sensors().imu()) absent.insert(kImuTopic);
    if (!settings_.publish_tf) absent.insert(kTransformsTopic);
    if (fixed_transforms().transforms.empty()) absent.insert(kStaticTransformsTopic);
    // Every message counts in simulated time, the latest one by the wall clock.
    const std::uint32_t queue_size = clock_->is_master() ? kRecorderQueueSize : kDriverQueueSize;
    visit_topics([&](const auto& topic) {
      if (absent.count(topic.name) > 0) return;
      publications_.advertise(node_, topic, topic.queue_size > 0 ? topic.queue_size : queue_size);
    });
    publications_.publish(kSceneTopic, [this] { return scene_message(settings_.scene); });
    publications_.publish(kStaticTransformsTopic, fixed_transforms);
  }

  /// True if the loop must stop at instants, for subscribers or a bag.
  bool wants_telemetry() const { return bag_ || publications_.heard(kAtInstants); }

  void run_loop() {
    report_start();
    clock_->announce();
    for (std::string missing = clock_->missing(); !missing.empty() && running(); missing = clock_->missing()) {
      report_wait("time waits for " + missing, ros::console::levels::Warn);
      take_callbacks(kPollInterval);
    }
    if (settings_.wait_for_subscribers) await_subscribers();
    // It may hear /tf. In lockstep a run would depend on when it asks the master.
    if (!settings_.lockstep.on) lookout_.emplace(node_, private_node_, settings_);
    clock_->start();
    publish_instant();
    while (running() && !ended_) {
      if (time_services_->stepping()) {
        advance_by_step();
      } else if (time_services_->paused()) {
        report_wait(fmt::format("time waits, paused at t = {:g} s, for ~unpause or ~step", loop_.time()));
        take_callbacks(kPollInterval);
      } else if (clock_->await(*this)) {
        wait_.what.clear();
        advance_when_due();
      } else if (const double now = clock_->arrival(); diagnosing_.meet(now)) {
        publish_diagnostics(now);  // within a long control period
      }
    }
    if (ended_) ros::WallDuration(kFlushDelay).sleep();
  }

  void report_start() {
    const Scene& scene = settings_.scene;
    const RobotParameters& robot = scene.robot;
    const VelocityGains& gains = settings_.driver.motors.gains;
    ROS_INFO("model %s by %s, control period %g s, %s", name_of(scene.model), loop_.simulation().method().c_str(),
             loop_.control_period(), clock_->name());
    ROS_INFO_STREAM(fmt::format(
        "{}: friction of the drive trains {} N m + {} N m s, of the rollers {} N m + {} N m s, of the floor {}; "
        "velocity gains {:g} N m s/rad, {:g} N m/rad{}",
        scene.files.empty() ? "no scene" : scene.files.front(), wheels_text(robot.dry_friction),
        wheels_text(robot.mu_1), wheels_text(robot.roller_dry_friction), wheels_text(robot.mu_2),
        wheels_text(scene.floor.f), gains.proportional, gains.integral,
        robot.dry_friction.isZero() ? "; without the dry friction of real bases: see profile:=measured" : ""));
    for (const std::string& warning : warnings_of(scene)) ROS_WARN_STREAM(warning);
  }

  void await_subscribers() {
    const auto missing = [this] {
      std::string topics;
      publications_.visit_unheard([&](const TopicRow& topic) {
        if (topic.is(kAwaited) && telemetry_.is_requested(topic)) topics += " " + node_.resolveName(topic.name);
      });
      return topics;
    };
    for (std::string topics = missing(); !topics.empty() && running(); topics = missing()) {
      report_wait("~wait_for_subscribers: time starts when these topics have subscribers:" + topics);
      take_callbacks(0.01);
    }
    wait_.what.clear();
    ros::WallDuration(kRecorderDelay).sleep();
  }

  bool running() const { return node_.ok() && !stop_; }

  bool interrupted() const override {
    return ended_ || time_services_->paused() || time_services_->stepping() || !running();
  }
  bool has_callbacks() override { return !queue_.isEmpty(); }
  const std::string& commander() const override { return interface_->commander(); }

  bool await_command(double patience, const char* what) override {
    const auto begin = ros::SteadyTime::now();
    while (commander().empty() && !interrupted()) {
      const double left = patience - (ros::SteadyTime::now() - begin).toSec();
      if (left <= 0) break;
      clock_->timing().idle([&] { queue_.callOne(ros::WallDuration(std::min(left, kPollInterval))); });
      if (!commander().empty() || has_callbacks()) continue;
      end_with_commands();
      report_wait(fmt::format("lockstep: {} a command on {}, {} or {}, at t = {:g} s", what,
                              node_.resolveName(kTwistTopic), node_.resolveName(kTorqueTopic),
                              node_.resolveName(kVelocityTopic), loop_.time()));
    }
    return !commander().empty();
  }

  /// Before the first control period commands are yet to come.
  void end_with_commands() override {
    if (!settings_.lockstep.end_with_commands || loop_.periods() == 0 || interface_->has_commander()) return;
    end("the last publisher of commands has gone");
  }

  void end(const char* why) {
    if (!ended_) ROS_INFO("%s: the node ends at t = %g s", why, loop_.time());
    ended_ = true;
  }

  /// Callbacks only enqueue requests and note subscribers, but for the services of time, which are served here, between
  /// control periods.
  void take_callbacks(double timeout) override {
    clock_->timing().idle([&] { queue_.callAvailable(ros::WallDuration(timeout)); });
  }

  /// Reports what time waits for once that takes long; the text may change from call to call.
  void report_wait(const std::string& what, ros::console::Level level = ros::console::levels::Info) {
    const auto now = ros::SteadyTime::now();
    if (wait_.what.empty()) wait_ = {what, now + kFirstNotice};
    wait_.what = what;
    if (now < wait_.due) return;
    wait_.due = now + kNextNotice;
    if (wait_.reports++ % kNoticesPerLine == 0) ROS_LOG_STREAM(level, ROSCONSOLE_DEFAULT_NAME, what);
    publish_diagnostics(loop_.time());
  }

  /// Advances to the next time that could be noticed: waking up for each control period would cost more than simulating
  /// it.
  void advance_when_due() {
    advance(periods_ahead());
    clock_->take_late_commands(*this);
    const double lost = clock_->arrive();
    if (lost > 0) log_.warn("lag", fmt::format("too slow for the requested rate: {:.3g} s are lost", lost));
    publish_instant();
  }

  /// Advances by a part of what ~step asks for, without waiting.
  void advance_by_step() {
    if (!time_services_->paused()) return time_services_->end_step("not paused: call ~pause first");
    if (!clock_->take_answers(*this) || !time_services_->stepping()) return;  // a callback may have ended it
    const std::int64_t periods = std::min(time_services_->left(), periods_ahead());
    if (periods == 0) return time_services_->end_step();
    advance(periods);
    publish_instant();
    clock_->announce();
    time_services_->advanced(periods);
  }

  /// Control periods until the next time that could be noticed.
  std::int64_t periods_ahead() {
    const double next = std::min({loop_.time() + kMaxAhead, diagnosing_.next(), end_});
    const std::int64_t periods = loop_.periods_until(wants_telemetry() ? std::min(next, loop_.next_instant()) : next);
    return std::min(periods, clock_->periods_left());
  }

  double next_time() override { return loop_.time() + static_cast<double>(periods_ahead()) * loop_.control_period(); }

  void advance(std::int64_t periods) {
    interface_->forget_commands();
    try {
      loop_.advance_periods(periods);
    } catch (const std::domain_error& error) {
      throw std::runtime_error(fmt::format("{} after t = {} s", error.what(), loop_.time()));
    }
    const BaseDriver::Events events = loop_.take_driver_events();
    if (events.base_lost) ROS_WARN("EtherCAT is lost: the base is not connected until reconnect is called");
    if (events.timed_out) ROS_WARN("no command for %g s: the wheels are stopped", settings_.driver.command_timeout);
    log_tipping();
    if (ControlTime::reached(end_, loop_.time())) end("~end_time has come");
  }

  /// Logs that the base has reached its tipping limit, beyond which a real base would move differently.
  void log_tipping() {
    const auto record = loop_.simulation().reaction_record();
    if (!record || record->tipped_at == tipping_logged_) return;
    tipping_logged_ = record->tipped_at;
    if (!tipping_logged_) return;  // since ~reset
    log_.error("tipping",
               TippedOver(*tipping_logged_, record->tipped).what() + std::string("; the simulation goes on"));
  }

  /// Publishes and records what is due now: the events up to now, and at an instant of publishing the rest.
  void publish_instant() {
    const bool is_due = loop_.meet_instant();
    if (is_due) loop_.require_finite();
    const Events events = loop_.take_events();
    clock_->begin_publishing(is_due, events.any());
    record(events, is_due);
    telemetry_.visit(
        events, [this](double t) { return clock_->stamp(t); },
        [this](const TopicRow& topic, const ros::Time&, const auto& make) { publications_.publish(topic, make); });
    if (is_due && wants_telemetry()) publish_telemetry();
    if (diagnosing_.meet(loop_.time())) publish_diagnostics(loop_.time());
    clock_->end_publishing();
  }

  /// Writes to the bag. A failed bag cannot be continued: the node goes on without it, or ends if it is required.
  void record(const Events& events, bool is_due) {
    if (!bag_) return;
    bag_failure_ = refusal_of([&] {
      bag_->write(telemetry_, events);
      if (is_due) bag_->write(telemetry_, loop_.simulation(), loop_.sensors(), loop_.time());
    });
    if (bag_failure_.empty()) return;
    bag_.reset();
    publish_diagnostics(loop_.time());
    if (settings_.bag_required) {
      ros::WallDuration(kFlushDelay).sleep();
      throw std::runtime_error("the bag has failed: " + bag_failure_);
    }
    ROS_ERROR("the bag has failed, the node goes on without it: %s", bag_failure_.c_str());
  }

  void publish_telemetry() override {
    const ros::Time stamp = clock_->stamp(loop_.time());
    const Simulation& simulation = loop_.simulation();
    telemetry_.visit(simulation, loop_.sensors(), stamp, [&](const TopicRow& topic, const auto& make) {
      if (loop_.driver().present() || !topic.is(kOfDriver)) publications_.publish(topic, make);
    });
    publications_.publish(kContactMarkersTopic, [&] { return telemetry_.markers(simulation, stamp); });
  }

  /// Time t (s) is the loop's, or later within a long control period.
  void publish_diagnostics(double t) {
    const ros::Time now = clock_->stamp(t);
    const LoopTiming::Report timing = clock_->timing().take(loop_.time());
    std::string what = wait_.what;
    if (const std::string rivals = clock_->rivals(); !rivals.empty()) {
      const std::string several = fmt::format("/clock has several publishers, {}: time is undefined", rivals);
      log_.error("clocks", several);
      what = several + (what.empty() ? "" : "; ") + what;
    }
    publications_.publish(kDiagnosticsTopic, [&] {
      auto message = diagnostics_message(loop_.driver(), loop_.simulation(), timing, what, clock_->counters(),
                                         settings_.has_arms, now);
      if (!settings_.bag.empty()) message.status.push_back(bag_status(settings_.bag, bag_failure_));
      std::string robot = node_.getNamespace() + "/";  // "/" and, for a nodelet, "" name none of several
      robot.erase(0, robot.find_first_not_of('/'));
      for (auto& status : message.status) status.name.insert(0, robot);
      return message;
    });
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
    publications_.publish(kDashboardTopic, [&] { return dashboard_message(loop_.driver(), now); });
#endif
  }

  void reset() {
    if (bag_) throw std::runtime_error("~reset is rejected while ~bag is written: the bag's time would go back");
    time_services_->end_step("ended by ~reset");
    loop_.reset();
    clock_->reset();
    interface_->forget_commands();
    diagnosing_.reset();
    publish_instant();
  }

  const BaseSettings settings_;
  const std::atomic<bool>& stop_;
  BaseLoop loop_;
  Telemetry telemetry_;
  const double end_;  // s of simulated time
  Instants diagnosing_;
  std::optional<BagWriter> bag_;  // empty: not recorded, or not any longer
  std::string bag_failure_;       // why; empty: none
  ThrottledLog log_;
  Wait wait_;
  std::optional<double> tipping_logged_;  // when the base tipped, s

  ros::CallbackQueue queue_;
  ros::NodeHandle node_, private_node_;
  Publications publications_;
  std::unique_ptr<NodeClock> clock_;
  std::optional<DriverInterface> interface_;
  std::optional<TimeServices> time_services_;
  std::optional<Lookout> lookout_;

  bool ended_ = false;
};

}  // namespace

std::function<void()> make_base_node(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                                     const std::atomic<bool>& stop) {
  return [base = std::make_shared<BaseNode>(node, private_node, stop)] { base->run(); };
}

}  // namespace youbot_base_sim
