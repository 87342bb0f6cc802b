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
constexpr auto kHintAfter = std::chrono::seconds(5);  // of waiting for anything without a word
constexpr double kPatience = 0.1;                     // s of wall time between two looks whether ROS goes on
constexpr double kMaxAhead = 0.02;  // s of simulated time that may pass at once, unless a control period is longer
constexpr double kSlack = 1e-6;     // of a control period, for rounding

/// Topics that time does not wait for: what they tell comes again, or is kept for whoever comes later.
const std::set<std::string> kNotWaitedFor = {kDiagnosticsTopic, kDashboardTopic, kContactMarkersTopic, kLoadsTopic,
                                             kAppliedWrenchTopic};

/// Whether a topic tells what happens rather than what the driver knows of it.
bool is_truth(const std::string& topic) { return topic == kGroundTruthTopic || topic == kContactsTopic; }

/// Is due every few seconds of a wait, but not at its beginning.
class Hint {
 public:
  bool due() {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < kHintAfter) return false;
    last_ = now;
    return true;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace

BaseNode::BaseNode(const BaseSettings& settings)
    : settings_(settings),
      keeps_pace_(settings.lockstep || settings.real_time_factor > 0),
      loop_(settings),
      pacer_(settings.real_time_factor, settings.lockstep ? 0 : kMaxLag),
      diagnosing_(kDiagnosticsRate, kSlack * loop_.control_period()),
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
      loop_, [this] { return now(); }, settings_.telemetry.kinematics, node_, private_node_, log_);
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
    publications_.advertise<rosgraph_msgs::Clock>(node_, kClockTopic, kRecorderQueueSize, true);
  }
}

void BaseNode::see_who_listens() {
  const bool switches_are_heard = publications_.heard(kRollerSwitchesTopic);
  telemetry_is_wanted_ = bag_ || switches_are_heard || publications_.heard(kContactMarkersTopic) ||
                         publications_.heard(kAppliedWrenchTopic);
  loop_.visit_telemetry(ros::Time(), [this](const char* topic, const auto&) {
    telemetry_is_wanted_ = telemetry_is_wanted_ || publications_.heard(topic);
  });
  periods_are_wanted_ =
      settings_.publish_clock && (keeps_pace_ || switches_are_heard || publications_.heard(kClockTopic));
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
  for (const std::string& warning : {unlikely_geometry(scene.robot), told}) {
    if (!warning.empty()) ROS_WARN_STREAM(warning);
  }
  if (settings_.publish_clock) announce_time();
  if (settings_.wait_for_subscribers) await_subscribers();
  wall_start_ = ros::Time::now();
  pacer_.start(loop_.time());
  publish_instant();
  while (node_.ok()) {
    if (is_stepping()) {
      go_on_by_step();
    } else if (paused_) {
      take_callbacks(kPatience);
    } else if (!settings_.lockstep || await_command()) {
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
  Hint hint;
  for (std::string topics = missing(); !topics.empty() && node_.ok(); topics = missing()) {
    take_callbacks(0.01);
    if (hint.due()) ROS_INFO_STREAM("time starts when these topics have subscribers:" << topics);
  }
  ros::WallDuration(kRecorderDelay).sleep();
}

/// Waits for callbacks, or `timeout` (s of wall time). They change nothing but what waits for the loop, and who
/// listens; the services of time are the exception, which the loop serves here, between control periods.
void BaseNode::take_callbacks(double timeout) {
  pacer_.idle([&] { queue_.callAvailable(ros::WallDuration(timeout)); });
}

/// Waits for the command message of the next control period; false if something else is to be seen to first.
bool BaseNode::await_command() {
  Hint hint;
  const auto none_left = [this] { return interface_->commands() == commands_taken_; };
  while (none_left() && !paused_ && !is_stepping() && node_.ok()) {
    pacer_.idle([this] { queue_.callOne(ros::WallDuration(kPatience)); });
    if (hint.due()) ROS_INFO("lockstep: waiting for a command at t = %g s", loop_.time());
  }
  return !none_left() && !paused_ && !is_stepping();
}

/// Goes on to the next time when somebody could notice, if that is due; if not, takes what comes until then, but not
/// for long. To wake up for each control period would cost more than to simulate it.
void BaseNode::go_on_when_due() {
  const double wait = wait_for_periods_ahead();
  // In lockstep the command in hand is the only one for this control period.
  if (wait > 0 || (!settings_.lockstep && !queue_.isEmpty())) {
    take_callbacks(std::clamp(wait, 0.0, kPatience));
    if (paused_ || is_stepping() || wait_for_periods_ahead() > 0) return publish_diagnostics_when_due(now());
  }
  advance(periods_ahead());
  const double t = loop_.time();
  const double lost = pacer_.arrive(t);
  if (lost > 0 && !settings_.lockstep) {
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
  step_service_->advanced(periods, loop_.time());
}

void BaseNode::end_step(const char* reason) { step_service_->end(reason, loop_.time()); }

/// Control periods until somebody could notice.
std::int64_t BaseNode::periods_ahead() const {
  if (periods_are_wanted_) return 1;
  const double next = std::min(loop_.time() + kMaxAhead, diagnosing_.next());
  return loop_.periods_until(telemetry_is_wanted_ ? std::min(next, loop_.next_instant()) : next);
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
}

/// What is due at the present time: the switches up to now, and at their instants the rest.
void BaseNode::publish_instant() {
  const bool is_due = loop_.meet_instant();
  if (is_due) loop_.require_finite();
  const Events events = loop_.take_happenings();
  // With nobody to keep pace with, a /clock message each control period would cost more than the simulation itself.
  if (settings_.publish_clock && (keeps_pace_ || is_due || !events.switches.empty())) announce_time();
  record([&](BagWriter& bag) { bag.write(events); });
  for (const RollerSwitch& event : events.switches) {
    publications_.publish(kRollerSwitchesTopic, [&] { return roller_switch_message(event, stamp(event.t)); });
  }
  const auto publish = [this](const char* topic, const auto& make) { publications_.publish(topic, make); };
  for (const BurdenChange& change : events.burdens) Telemetry::visit(change, stamp(change.t), publish);
  if (is_due && telemetry_is_wanted_) publish_telemetry();
  publish_diagnostics_when_due(loop_.time());
}

void BaseNode::publish_telemetry() {
  const double t = loop_.time();
  const Simulation& simulation = loop_.simulation();
  const auto contacts = [&] { return contacts_message(simulation, stamp(t)); };
  record([&](BagWriter& bag) {
    bag.write(loop_.telemetry(), simulation, loop_.driver().readings(), t);
    if (!loop_.telemetry().recorded(kContactsTopic)) return;
    bag.write_markers(t, [&] { return markers_.at(contacts(), simulation); });
  });
  loop_.visit_telemetry(stamp(t), [this](const char* topic, const auto& make) {
    if (loop_.driver().present() || is_truth(topic)) publications_.publish(topic, make);
  });
  Telemetry::visit_push(simulation, stamp(t),
                        [this](const char* topic, const auto& make) { publications_.publish(topic, make); });
  publications_.publish(kContactMarkersTopic, [&] { return markers_.at(contacts(), simulation, speed_.at(t)); });
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
  return settings_.publish_clock ? stamp_of(t) : wall_start_ + ros::Duration(t);
}

/// Simulated time at which what comes now arrives, s.
double BaseNode::now() const {
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
  diagnosing_.reset();
  pacer_.start(0);
  publish_instant();
  return true;
}

}  // namespace youbot_base_sim
