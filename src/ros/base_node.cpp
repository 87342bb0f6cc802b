#include "youbot_base_sim/ros/base_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/ros/diagnostics.h"
#include "youbot_base_sim/ros/parameters.h"
#include "youbot_base_sim/ros/program.h"

namespace youbot_base_sim {

namespace {

constexpr double kRecorderDelay = 0.2;  // s of wall time from a recorder's subscription to its first message at most
constexpr double kFlushDelay = 0.2;     // s of wall time for the last message to leave before the node ends
constexpr double kMaxAhead = 0.02;      // s of simulated time that may pass at once, unless a control period is longer

/// Topics that time does not wait for: their content comes again, or is kept for subscribers that come later.
const std::set<std::string> kNotWaitedFor = {kDiagnosticsTopic, kDashboardTopic, kContactMarkersTopic, kLoadsTopic,
                                             kAppliedWrenchTopic};

/// Whether a topic comes from elsewhere than the driver.
bool is_truth(const std::string& topic) {
  return topic == kGroundTruthTopic || topic == kContactsTopic || topic == kImuTopic;
}

}  // namespace

BaseNode::BaseNode(const BaseSettings& settings)
    : settings_(settings),
      loop_(settings),
      telemetry_(settings.scene, settings.telemetry),
      markers_(settings.markers),
      diagnosing_(kDiagnosticsRate),
      private_node_("~"),
      publications_([this] { update_subscriptions(); }),
      clock_(ClockPolicy::make(settings_, loop_, publications_)) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  if (!settings_.bag.empty()) open_bag();
  advertise();
  update_subscriptions();
  interface_ = std::make_unique<DriverInterface>(
      loop_, [this] { return clock_->arrival(); }, settings_, node_, private_node_, log_);
  publish_world();
  if (clock_->is_master()) offer_time_services();
  if (settings_.has_arms) ROS_WARN("youBotHasArms is true, but no arm is simulated: it will not be found");
}

void BaseNode::open_bag() {
  try {
    bag_.writer = std::make_unique<BagWriter>(
        OutputOpener(settings_.scene.files).open("bag", settings_.bag, OutputFile::Access::kAnywhere));
  } catch (const std::runtime_error& error) {
    throw ParameterError(fmt::format("parameter ~bag: {}", error.what()));
  }
}

void BaseNode::advertise() {
  const std::uint32_t queue_size = clock_->queue_size();
  telemetry_.visit(loop_.simulation(), loop_.sensors(), ros::Time(), [&](const char* topic, const auto& make) {
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
  clock_->advertise(node_);
}

void BaseNode::update_subscriptions() {
  wanted_.telemetry = bag_.writer || publications_.heard(kRollerSwitchesTopic) ||
                      publications_.heard(kContactMarkersTopic) || publications_.heard(kAppliedWrenchTopic);
  telemetry_.visit(loop_.simulation(), loop_.sensors(), ros::Time(), [this](const char* topic, const auto&) {
    wanted_.telemetry = wanted_.telemetry || publications_.heard(topic);
  });
  wanted_.periods = clock_->wants_each_period();
}

void BaseNode::publish_world() {
  const auto world = telemetry_.static_transforms(loop_.simulation(), ros::Time::now());
  if (world) static_transforms_.emplace().sendTransform(world->transforms);
}

void BaseNode::offer_time_services() {
  time_services_.emplace(
      private_node_, queue_, settings_.start_paused,
      TimeServices::Loop{[this] { return loop_.time(); }, [this] { clock_->start(); }, [this] { return reset(); }});
}

void BaseNode::run() {
  loop_.stop_on(end_requested());
  try {
    run_loop();
  } catch (const Stopped&) {  // by a signal, within a control period
    ros::shutdown();          // now, so that a last line goes where it is still printed
  } catch (const std::exception&) {
    const std::string name = bag_.writer ? bag_.writer->keep_incomplete() : "";
    if (!name.empty()) ROS_ERROR("the bag, up to here, is kept as %s", name.c_str());
    throw;
  }
  if (bag_.writer) bag_.writer->commit();
}

void BaseNode::run_loop() {
  report_start();
  clock_->announce();
  if (settings_.wait_for_subscribers) await_subscribers();
  clock_->start();
  publish_instant();
  while (node_.ok() && !ended_) {
    if (stepping()) {
      advance_by_step();
    } else if (paused()) {
      report_wait(fmt::format("time waits, paused at t = {:g} s, for ~unpause or ~step", loop_.time()));
      take_callbacks(kPollInterval);
    } else if (clock_->await(*this)) {
      notice_.over();
      advance_when_due();
    }
  }
}

void BaseNode::report_start() {
  const Scene& scene = settings_.scene;
  ROS_INFO("model %s by %s, control period %g s, %s", name_of(scene.model), loop_.simulation().method().c_str(),
           loop_.control_period(), clock_->name());
  const std::string advised = advice(scene.robot, scene.floor, scene.model, integration_settings(scene.solver), 1);
  for (const std::string& warning : {unlikely_geometry(scene.robot), without_effect(scene), advised}) {
    if (!warning.empty()) ROS_WARN_STREAM(warning);
  }
}

void BaseNode::await_subscribers() {
  const auto missing = [this] {
    std::string topics;
    publications_.visit([&](const std::string& topic, bool heard) {
      const bool waited_for = kNotWaitedFor.count(topic) == 0 && telemetry_.recorded(topic);
      if (!heard && waited_for) topics += " " + topic;
    });
    return topics;
  };
  for (std::string topics = missing(); !topics.empty() && node_.ok(); topics = missing()) {
    report_wait("~wait_for_subscribers: time starts when these topics have subscribers:" + topics);
    take_callbacks(0.01);
  }
  notice_.over();
  ros::WallDuration(kRecorderDelay).sleep();
}

/// Waits for callbacks, or `timeout` (s of wall time). They change nothing but what waits for the loop, and which
/// topics are heard; the services of time are the exception, which the loop serves here, between control periods.
void BaseNode::take_callbacks(double timeout) {
  clock_->pacer().idle([&] { queue_.callAvailable(ros::WallDuration(timeout)); });
}

/// Logs on the console and, by the wall clock, in diagnostics.
void BaseNode::report_wait(const std::string& what) {
  const WaitNotice::Due due = notice_.waits_for(what);
  if (due.console) ROS_INFO_STREAM(what);
  if (due.diagnostics) publish_diagnostics(loop_.time());
}

/// Advances to the next time that could be noticed, if that is due; if not, takes callbacks until then, but not for
/// long. To wake up for each control period would cost more than to simulate it.
void BaseNode::advance_when_due() {
  const double wait = wait_for_periods_ahead();
  if (wait > 0 || (clock_->takes_late_messages() && !queue_.isEmpty())) {
    take_callbacks(std::clamp(wait, 0.0, kPollInterval));
    if (paused() || stepping() || wait_for_periods_ahead() > 0) {
      return publish_diagnostics_when_due(clock_->arrival());
    }
  }
  advance(periods_ahead());
  const double lost = clock_->arrive();
  if (lost > 0) log_.warn("lag", fmt::format("too slow for the rate asked for: {:.3g} s are lost", lost));
  publish_instant();
}

/// Advances by a part of what ~step asks for, without waiting.
void BaseNode::advance_by_step() {
  if (!paused()) return time_services_->end_step("not paused: call ~pause first");
  if (!queue_.isEmpty()) take_callbacks(0);
  if (!stepping()) return;  // a callback has ended it
  const std::int64_t periods = std::min(time_services_->left(), periods_ahead());
  if (periods > 0) {
    advance(periods);
    publish_instant();
  }
  clock_->end_of_step();
  time_services_->advanced(periods);
}

/// Control periods until it could be noticed.
std::int64_t BaseNode::periods_ahead() const {
  if (wanted_.periods) return 1;
  const double next = std::min(loop_.time() + kMaxAhead, diagnosing_.next());
  return clock_->bounded(loop_.periods_until(wanted_.telemetry ? std::min(next, loop_.next_instant()) : next));
}

/// Wall time until they have passed, s; not positive if they have.
double BaseNode::wait_for_periods_ahead() {
  return clock_->pacer().wait_for(loop_.time() + static_cast<double>(periods_ahead()) * loop_.control_period());
}

void BaseNode::advance(std::int64_t periods) {
  interface_->forget_commands();
  try {
    loop_.advance_periods(periods);
  } catch (const std::domain_error& error) {
    throw std::runtime_error(fmt::format("{} after t = {} s", error.what(), loop_.time()));
  }
  const BaseDriver::Events events = loop_.take_driver_events();
  if (events.base_lost) ROS_WARN("EtherCAT is lost: the base is not connected until reconnect is called");
  if (events.timed_out) {
    ROS_WARN("no command for %g s: the wheels are stopped", settings_.driver.command_timeout);
  }
  log_tipping();
}

/// Logs that the base reached its tipping limit, beyond which a real base would move differently.
void BaseNode::log_tipping() {
  const auto record = loop_.simulation().reaction_record();
  if (!record || record->tipped_at == tipping_logged_) return;
  tipping_logged_ = record->tipped_at;
  if (!tipping_logged_) return;  // since ~reset
  log_.error("tipping", TippedOver(*tipping_logged_, record->tipped).what() + std::string("; the simulation goes on"));
}

/// What is due at the present time: the switches up to now, and at their instants the rest.
void BaseNode::publish_instant() {
  const bool is_due = loop_.meet_instant();
  if (is_due) loop_.require_finite();
  const Events events = loop_.take_events();
  clock_->begin_publishing(is_due, !events.switches.empty());
  record([&](BagWriter& bag) { bag.write(events); });
  for (const RollerSwitch& event : events.switches) {
    publications_.publish(kRollerSwitchesTopic, [&] { return roller_switch_message(event, clock_->stamp(event.t)); });
  }
  const auto publish = [this](const char* topic, const auto& make) { publications_.publish(topic, make); };
  for (const LoadChange& change : events.load_changes) Telemetry::visit(change, clock_->stamp(change.t), publish);
  if (is_due && wanted_.telemetry) {
    record_telemetry();
    publish_telemetry();
  }
  publish_diagnostics_when_due(loop_.time());
  clock_->end_publishing();
}

void BaseNode::record_telemetry() {
  const Simulation& simulation = loop_.simulation();
  const double t = loop_.time();
  record([&](BagWriter& bag) {
    bag.write(telemetry_, simulation, loop_.sensors(), t);
    if (!telemetry_.recorded(kContactsTopic)) return;
    bag.write_markers(t, [&] { return markers_.at(contacts_message(simulation, stamp_of(t)), simulation); });
  });
}

void BaseNode::publish_telemetry() {
  const ros::Time stamp = clock_->stamp(loop_.time());
  const Simulation& simulation = loop_.simulation();
  const auto publish = [this](const char* topic, const auto& make) { publications_.publish(topic, make); };
  telemetry_.visit(simulation, loop_.sensors(), stamp, [&](const char* topic, const auto& make) {
    if (loop_.driver().present() || is_truth(topic)) publish(topic, make);
  });
  Telemetry::visit_push(simulation, stamp, publish);
  publish(kContactMarkersTopic,
          [&] { return markers_.at(contacts_message(simulation, stamp), simulation, clock_->speed()); });
}

/// Time t (s) is the loop's, or later within a long control period.
void BaseNode::publish_diagnostics_when_due(double t) {
  if (diagnosing_.meet(t)) publish_diagnostics(t);
}

void BaseNode::publish_diagnostics(double t) {
  const ros::Time now = clock_->stamp(t);
  const Pacer::Timing timing = clock_->pacer().take_timing();
  publications_.publish(kDiagnosticsTopic, [&] {
    auto message = diagnostics_message(loop_.driver(), loop_.simulation(), timing, now);
    const std::string lack = clock_->lack();
    message.status.push_back(time_status(lack.empty() ? notice_.what() : lack));
    if (!settings_.bag.empty()) message.status.push_back(bag_status(settings_.bag, bag_.failure));
    return message;
  });
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
  publications_.publish(kDashboardTopic, [&] { return dashboard_message(loop_.driver(), now); });
#endif
}

/// Calls `write` for the bag. If that fails, the file cannot be completed any more: the node says so, and ends if the
/// bag is required.
template <class Write>
void BaseNode::record(const Write& write) {
  if (!bag_.writer) return;
  try {
    write(*bag_.writer);
  } catch (const std::runtime_error& error) {
    bag_.failure = error.what();
  }
  if (bag_.failure.empty()) return;
  bag_.writer.reset();
  update_subscriptions();
  publish_diagnostics(loop_.time());
  if (settings_.bag_required) {
    ros::WallDuration(kFlushDelay).sleep();
    throw std::runtime_error("the bag has failed: " + bag_.failure);
  }
  ROS_ERROR("the bag has failed, the node goes on without it: %s", bag_.failure.c_str());
}

bool BaseNode::reset() {
  if (bag_.writer) {
    ROS_ERROR("~reset is refused while ~bag is written: its time would go back");
    return false;
  }
  time_services_->end_step("ended by ~reset");
  loop_.reset();
  clock_->reset();
  interface_->forget_commands();
  diagnosing_.reset();
  publish_instant();
  return true;
}

}  // namespace youbot_base_sim
