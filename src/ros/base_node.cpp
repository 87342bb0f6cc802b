#include "youbot_base_sim/ros/base_node.h"

#include <fmt/format.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <stdexcept>
#include <string>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/ros/diagnostics.h"
#include "youbot_base_sim/ros/parameters.h"
#include "youbot_base_sim/ros/program.h"

namespace youbot_base_sim {

namespace {

constexpr double kMaxLag = 1.0;         // s of wall time, before the loop stops catching up
constexpr double kRecorderDelay = 0.2;  // s of wall time from a recorder's subscription to its first message at most
constexpr double kLastWord = 0.2;       // s of wall time for the last message to leave before the node ends
constexpr double kPatience = 0.1;       // s of wall time between two looks whether ROS goes on
constexpr auto kDiagnosticsWhileWaiting = std::chrono::seconds(2);
constexpr double kMaxAhead = 0.02;  // s of simulated time that may pass at once, unless a control period is longer

/// Topics that time does not wait for: what they tell comes again, or is kept for whoever comes later.
const std::set<std::string> kNotWaitedFor = {kDiagnosticsTopic, kDashboardTopic, kContactMarkersTopic, kLoadsTopic,
                                             kAppliedWrenchTopic};

/// Whether a topic comes from elsewhere than the driver.
bool is_truth(const std::string& topic) {
  return topic == kGroundTruthTopic || topic == kContactsTopic || topic == kImuTopic;
}

}  // namespace

BaseNode::BaseNode(const BaseSettings& settings)
    : settings_(settings),
      keeps_pace_(settings.lockstep.period == 0 && (settings.lockstep.on || settings.real_time_factor > 0)),
      loop_(settings),
      lockstep_(settings.lockstep, loop_.control_period()),
      pacer_(settings.real_time_factor, settings.lockstep.on ? 0 : kMaxLag),
      diagnosing_(kDiagnosticsRate),
      markers_(settings.markers),
      private_node_("~"),
      publications_([this] { see_who_listens(); }),
      paused_(settings.start_paused) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  if (!settings_.bag.empty()) open_bag();
  advertise();
  see_who_listens();
  interface_ = std::make_unique<DriverInterface>(
      loop_, [this] { return now(); }, settings_.telemetry, node_, private_node_, log_);
  burden_interface_ = std::make_unique<BurdenInterface>(
      loop_, [this] { return now(); }, private_node_, log_);
  publish_world();
  if (settings_.publish_clock) offer_services();
  if (settings_.has_arms) ROS_WARN("youBotHasArms is true, but no arm is simulated: it will not be found");
}

void BaseNode::open_bag() {
  try {
    bag_ = std::make_unique<BagWriter>(
        OutputOpener(settings_.scene.files).open("bag", settings_.bag, OutputFile::Access::kAnywhere));
  } catch (const std::runtime_error& error) {
    throw ParameterError(fmt::format("parameter ~bag: {}", error.what()));
  }
}

void BaseNode::advertise() {
  const std::uint32_t queue_size = settings_.publish_clock ? kRecorderQueueSize : kDriverQueueSize;
  loop_.visit_telemetry(ros::Time(), [&](const char* topic, const auto& make) {
    if (topic == std::string(kTransformsTopic) && !settings_.publish_tf) return;
    publications_.advertise<decltype(make())>(node_, topic, queue_size);
  });
  publications_.advertise<RollerSwitchStamped>(node_, kRollerSwitchesTopic, kRecorderQueueSize);
  publications_.advertise<visualization_msgs::MarkerArray>(node_, kContactMarkersTopic, kDriverQueueSize);
  publications_.advertise<LoadsStamped>(node_, kLoadsTopic, kRecorderQueueSize, true);
  publications_.advertise<geometry_msgs::WrenchStamped>(node_, kAppliedWrenchTopic, kRecorderQueueSize, true);
  publications_.advertise<diagnostic_msgs::DiagnosticArray>(node_, kDiagnosticsTopic, kDriverQueueSize);
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
  publications_.advertise<pr2_msgs::PowerBoardState>(node_, kDashboardTopic, kDriverQueueSize);
#endif
  // Latched, so that a node that comes later, perhaps while time stands still, knows the time at once.
  if (settings_.publish_clock) {
    const auto gain = [this](const std::string& node) {
      if (lockstep_.has_own_period()) followers_.add(node);
    };
    const auto lose = [this](const std::string& node) { followers_.remove(node); };
    publications_.advertise<rosgraph_msgs::Clock>(node_, kClockTopic, kRecorderQueueSize, true, gain, lose);
  }
}

void BaseNode::see_who_listens() {
  const bool switches_are_heard = publications_.heard(kRollerSwitchesTopic);
  telemetry_is_wanted_ = bag_ || switches_are_heard || publications_.heard(kContactMarkersTopic) ||
                         publications_.heard(kAppliedWrenchTopic);
  loop_.visit_telemetry(ros::Time(), [this](const char* topic, const auto&) {
    telemetry_is_wanted_ = telemetry_is_wanted_ || publications_.heard(topic);
  });
  periods_are_wanted_ = settings_.publish_clock && !lockstep_.has_own_period() &&
                        (keeps_pace_ || switches_are_heard || publications_.heard(kClockTopic));
}

void BaseNode::publish_world() {
  const auto world = loop_.telemetry().static_transforms(loop_.simulation(), ros::Time::now());
  if (world) static_transforms_.emplace().sendTransform(world->transforms);
}

void BaseNode::offer_services() {
  services_ = {private_node_.advertiseService(kPauseService, &BaseNode::pause, this),
               private_node_.advertiseService(kUnpauseService, &BaseNode::unpause, this),
               private_node_.advertiseService(kResetService, &BaseNode::reset, this)};
  step_service_.emplace(queue_);
}

void BaseNode::run() {
  loop_.stop_on(end_requested());
  try {
    go_on_to_the_end();
  } catch (const Stopped&) {  // by a signal, within a control period
    ros::shutdown();          // now, so that a last line goes where it is still printed
  } catch (const std::exception&) {
    const std::string name = bag_ ? bag_->keep_incomplete() : "";
    if (!name.empty()) ROS_ERROR("the bag, up to here, is kept as %s", name.c_str());
    throw;
  }
  if (bag_) bag_->commit();
}

void BaseNode::go_on_to_the_end() {
  const Scene& scene = settings_.scene;
  ROS_INFO("model %s by %s, control period %g s, %s", name_of(scene.model), loop_.simulation().method().c_str(),
           loop_.control_period(), settings_.publish_clock ? "master of simulated time" : "wall clock");
  const std::string told = advice(scene.robot, scene.floor, scene.model, integration_settings(scene.solver), 1);
  for (const std::string& warning : {unlikely_geometry(scene.robot), without_effect(scene), told}) {
    if (!warning.empty()) ROS_WARN_STREAM(warning);
  }
  if (settings_.publish_clock) announce_time();
  if (settings_.wait_for_subscribers) await_subscribers();
  wall_start_ = ros::Time::now();
  pacer_.start(loop_.time());
  publish_instant();
  while (node_.ok() && !ended_) {
    if (is_stepping()) {
      go_on_by_step();
    } else if (paused_) {
      tell_wait(fmt::format("time waits, paused at t = {:g} s, for ~unpause or ~step", loop_.time()));
      take_callbacks(kPatience);
    } else if (!lockstep_.waits(loop_.periods()) || await_command()) {
      notice_.over();
      go_on_when_due();
    }
  }
}

void BaseNode::await_subscribers() {
  const auto missing = [this] {
    std::string topics;
    publications_.visit([&](const std::string& topic, bool heard) {
      const bool waited_for = kNotWaitedFor.count(topic) == 0 && loop_.telemetry().recorded(topic);
      if (!heard && waited_for) topics += " " + topic;
    });
    return topics;
  };
  for (std::string topics = missing(); !topics.empty() && node_.ok(); topics = missing()) {
    tell_wait("~wait_for_subscribers: time starts when these topics have subscribers:" + topics);
    take_callbacks(0.01);
  }
  notice_.over();
  ros::WallDuration(kRecorderDelay).sleep();
}

/// Waits for callbacks, or `timeout` (s of wall time). They change nothing but what waits for the loop, and who
/// listens; the services of time are the exception, which the loop serves here, between control periods.
void BaseNode::take_callbacks(double timeout) {
  pacer_.idle([&] { queue_.callAvailable(ros::WallDuration(timeout)); });
}

/// Says what time waits for, where that takes long: on the console, and in diagnostics by the wall clock.
void BaseNode::tell_wait(const std::string& what) {
  const auto now = SteadyClock::now();
  if (notice_.what().empty()) wait_told_ = now;
  notice_.waits_for(what);
  if (now - wait_told_ < kDiagnosticsWhileWaiting) return;
  wait_told_ = now;
  publish_diagnostics(loop_.time());
}

/// Waits for the command message of the next period of lockstep; false if something else is to be seen to first.
bool BaseNode::await_command() {
  const auto start = SteadyClock::now();
  const auto none_left = [this] { return interface_->commands() == commands_taken_; };
  while (none_left() && !paused_ && !is_stepping() && node_.ok()) {
    const double left = lockstep_.patience() - std::chrono::duration<double>(SteadyClock::now() - start).count();
    if (left <= 0) {
      go_on_without_command();
      return lockstep_.started();
    }
    pacer_.idle([&] { queue_.callOne(ros::WallDuration(std::min(left, kPatience))); });
    if (!none_left() || !queue_.isEmpty()) continue;
    if (settings_.lockstep.end_with_commands && lockstep_.started() && !interface_->has_commander()) {
      ROS_INFO("nobody is left who commands: the node ends at t = %g s", loop_.time());
      ended_ = true;
      return false;
    }
    tell_wait(fmt::format("lockstep: time waits at t = {:g} s for a command on {}, {} or {}", loop_.time(), kTwistTopic,
                          kTorqueTopic, kVelocityTopic));
  }
  if (!none_left() && lockstep_.has_own_period()) {  // whoever commands may go on to, until it sleeps
    // At t = 0 /clock tells 1 ns, for zero is no time; a loop that sleeps from there would miss the first period by
    // that.
    if (idle_periods_ == 0) idle();
    followers_.await_rest();
    take_callbacks(0);
  }
  if (none_left() || paused_ || is_stepping()) return false;
  lockstep_.release(loop_.periods(), true);
  return true;
}

/// Nobody has commanded in time. Before the first command nothing is simulated: /clock alone goes on, for nodes that
/// sleep before they command, and how long that takes must not matter.
void BaseNode::go_on_without_command() {
  const std::string none =
      fmt::format("lockstep: no command for {:g} s at t = {:g} s", settings_.lockstep.timeout, loop_.time());
  if (lockstep_.ends(idle_periods_)) throw std::runtime_error(none + ": the node ends, by ~end_with_commands");
  if (lockstep_.idles()) return idle();
  if (!lockstep_.unanswered()) ROS_WARN("%s: time goes on without, by the wall clock, until one comes", none.c_str());
  lockstep_.release(loop_.periods(), false);
}

void BaseNode::idle() {
  ++idle_periods_;
  publish_telemetry();
  publish_stop();
}

/// Goes on to the next time when somebody could notice, if that is due; if not, takes what comes until then, but not
/// for long. To wake up for each control period would cost more than to simulate it.
void BaseNode::go_on_when_due() {
  const double wait = wait_for_periods_ahead();
  // In lockstep the command in hand is the only one for this control period.
  if (wait > 0 || (!settings_.lockstep.on && !queue_.isEmpty())) {
    take_callbacks(std::clamp(wait, 0.0, kPatience));
    if (paused_ || is_stepping() || wait_for_periods_ahead() > 0) return publish_diagnostics_when_due(now());
  }
  advance(periods_ahead());
  const double t = loop_.time();
  const double lost = pacer_.arrive(t);
  if (lost > 0 && !settings_.lockstep.on) {
    wall_start_ += ros::Duration(lost);
    loop_.bring_requests_forward();
    log_.warn("lag", fmt::format("too slow for the rate asked for: {:.3g} s are lost", lost));
  }
  publish_instant();
}

/// Goes on by a part of what ~step asks for, without waiting.
void BaseNode::go_on_by_step() {
  if (!paused_) return end_step("not paused: call ~pause first");
  if (!queue_.isEmpty()) take_callbacks(0);
  if (!is_stepping()) return;  // a callback has ended it
  const std::int64_t periods = std::min(step_service_->left(), periods_ahead());
  if (periods > 0) {
    advance(periods);
    publish_instant();
  }
  if (lockstep_.has_own_period()) announce_time();
  step_service_->advanced(periods, loop_.time());
}

void BaseNode::end_step(const char* reason) { step_service_->end(reason, loop_.time()); }

/// Control periods until somebody could notice.
std::int64_t BaseNode::periods_ahead() const {
  if (periods_are_wanted_) return 1;
  const double next = std::min(loop_.time() + kMaxAhead, diagnosing_.next());
  const std::int64_t periods = loop_.periods_until(telemetry_is_wanted_ ? std::min(next, loop_.next_instant()) : next);
  return lockstep_.has_own_period() ? std::min(periods, lockstep_.left(loop_.periods())) : periods;
}

/// Wall time until they have passed, s; not positive if they have.
double BaseNode::wait_for_periods_ahead() const {
  return pacer_.wait_for(loop_.time() + static_cast<double>(periods_ahead()) * loop_.control_period());
}

void BaseNode::advance(std::int64_t periods) {
  commands_taken_ = interface_->commands();
  try {
    loop_.advance_periods(periods);
  } catch (const std::domain_error& error) {
    throw std::runtime_error(fmt::format("{} after t = {} s", error.what(), loop_.time()));
  }
  const BaseDriver::Events events = loop_.take_events();
  if (events.base_lost) ROS_WARN("EtherCAT is lost: the base is not connected until reconnect is called");
  if (events.timed_out) {
    ROS_WARN("no command for %g s: the wheels are stopped", settings_.driver.command_timeout);
  }
  tell_tipping();
}

/// Says when the base comes to its tipping limit, where no real base would go on as this one does.
void BaseNode::tell_tipping() {
  const auto record = loop_.simulation().reaction_record();
  if (!record || record->tipped_at == tipping_told_) return;
  tipping_told_ = record->tipped_at;
  if (!tipping_told_) return;  // since ~reset
  log_.error("tipping", TippedOver(*tipping_told_, record->tipped).what() + std::string("; the simulation goes on"));
}

/// What is due at the present time: the switches up to now, and at their instants the rest.
void BaseNode::publish_instant() {
  const bool is_due = loop_.meet_instant();
  if (is_due) loop_.require_finite();
  const Events events = loop_.take_happenings();
  // With nobody to keep pace with, a /clock message each control period would cost more than the simulation itself.
  const bool goes_by_stops = lockstep_.has_own_period();
  if (settings_.publish_clock && !goes_by_stops && (keeps_pace_ || is_due || !events.switches.empty())) announce_time();
  record([&](BagWriter& bag) { bag.write(events); });
  for (const RollerSwitch& event : events.switches) {
    publications_.publish(kRollerSwitchesTopic, [&] { return roller_switch_message(event, stamp(event.t)); });
  }
  const auto publish = [this](const char* topic, const auto& make) { publications_.publish(topic, make); };
  for (const BurdenChange& change : events.burdens) Telemetry::visit(change, stamp(change.t), publish);
  if (is_due && telemetry_is_wanted_) {
    record_telemetry();
    publish_telemetry();
  }
  publish_diagnostics_when_due(loop_.time());
  if (goes_by_stops && lockstep_.begins(loop_.periods())) publish_stop();
}

/// Where a period of lockstep begins: the clock last, once all else has arrived.
void BaseNode::publish_stop() {
  followers_.await_rest();
  announce_time();
  followers_.let_clock_arrive();
}

void BaseNode::record_telemetry() {
  const Simulation& simulation = loop_.simulation();
  const double t = loop_.time();
  record([&](BagWriter& bag) {
    bag.write(loop_.telemetry(), simulation, loop_.driver().readings(), t);
    if (!loop_.telemetry().recorded(kContactsTopic)) return;
    bag.write_markers(t, [&] { return markers_.at(contacts_message(simulation, stamp_of(t)), simulation); });
  });
}

void BaseNode::publish_telemetry() {
  const double t = loop_.time();
  const Simulation& simulation = loop_.simulation();
  loop_.visit_telemetry(stamp(t), [this](const char* topic, const auto& make) {
    if (loop_.driver().present() || is_truth(topic)) publications_.publish(topic, make);
  });
  Telemetry::visit_push(simulation, stamp(t),
                        [this](const char* topic, const auto& make) { publications_.publish(topic, make); });
  publications_.publish(kContactMarkersTopic,
                        [&] { return markers_.at(contacts_message(simulation, stamp(t)), simulation, speed_.at(t)); });
}

/// Time t (s) is the loop's, or later within a long control period.
void BaseNode::publish_diagnostics_when_due(double t) {
  if (diagnosing_.meet(t)) publish_diagnostics(t);
}

void BaseNode::publish_diagnostics(double t) {
  const ros::Time now = stamp(t);
  const Pacer::Timing timing = pacer_.take_timing();
  publications_.publish(kDiagnosticsTopic, [&] {
    auto message = diagnostics_message(loop_.driver(), loop_.simulation(), timing, now);
    const bool lacks_commands = lockstep_.started() && lockstep_.unanswered();
    message.status.push_back(
        time_status(lacks_commands ? "lockstep: no command: time goes on without" : notice_.what()));
    if (!settings_.bag.empty()) message.status.push_back(bag_status(settings_.bag, bag_failure_));
    return message;
  });
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
  publications_.publish(kDashboardTopic, [&] { return dashboard_message(loop_.driver(), now); });
#endif
}

/// Has `write` write into the bag. If that fails, the file cannot become whole any more: the node says so, and ends if
/// the bag is required.
template <class Write>
void BaseNode::record(const Write& write) {
  if (!bag_) return;
  try {
    write(*bag_);
  } catch (const std::runtime_error& error) {
    bag_failure_ = error.what();
  }
  if (bag_failure_.empty()) return;
  bag_.reset();
  see_who_listens();
  publish_diagnostics(loop_.time());
  if (settings_.bag_required) {
    ros::WallDuration(kLastWord).sleep();
    throw std::runtime_error("the bag has failed: " + bag_failure_);
  }
  ROS_ERROR("the bag has failed, the node goes on without it: %s", bag_failure_.c_str());
}

void BaseNode::announce_time() {
  publications_.publish(kClockTopic, [this] {
    rosgraph_msgs::Clock message;
    message.clock = stamp(loop_.time());
    return message;
  });
}

ros::Time BaseNode::stamp(double t) const {
  if (!settings_.publish_clock) return wall_start_ + ros::Duration(t);
  return stamp_of(static_cast<double>(idle_periods_) * settings_.lockstep.period + t);
}

/// Simulated time at which what comes now arrives, s.
double BaseNode::now() const {
  if (lockstep_.has_own_period() && !lockstep_.waits(loop_.periods())) {  // within a period: from the next on
    return static_cast<double>(loop_.periods() + lockstep_.left(loop_.periods())) * loop_.control_period();
  }
  if (settings_.publish_clock || wall_start_.isZero()) return loop_.time();
  return std::max(loop_.time(), pacer_.now());
}

bool BaseNode::pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  end_step("ended by ~pause");
  paused_ = true;
  return true;
}

bool BaseNode::unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  end_step("ended by ~unpause");
  paused_ = false;
  pacer_.start(loop_.time());
  return true;
}

bool BaseNode::reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  if (bag_) {
    ROS_ERROR("~reset is refused while ~bag is written: its time would go back");
    return false;
  }
  end_step("ended by ~reset");
  loop_.reset();
  lockstep_.reset();
  idle_periods_ = 0;
  commands_taken_ = interface_->commands();
  diagnosing_.reset();
  pacer_.start(0);
  publish_instant();
  return true;
}

}  // namespace youbot_base_sim
