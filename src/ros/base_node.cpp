#include "youbot_base_sim/ros/base_node.h"

#include <fmt/format.h>
#include <rosgraph_msgs/Clock.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "youbot_base_sim/ros/diagnostics.h"
#include "youbot_base_sim/ros/parameters.h"

namespace youbot_base_sim {

namespace {

constexpr double kMostLag = 1.0;        // s of wall time, before the loop stops catching up
constexpr double kRecorderDelay = 0.2;  // s of wall time from a recorder's subscription to its first message at most
constexpr auto kHintAfter = std::chrono::seconds(5);  // of waiting for anything without a word
constexpr double kSlack = 1e-6;                       // of a control period, for rounding

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
      driver_(settings.driver, settings.scene.initial.phi()),
      simulation_(settings.scene, [this](double t, const State& state) { return driver_.sample(t, state.dphi()); }),
      telemetry_(simulation_, read_motors(), settings.telemetry),
      pacer_(settings.real_time_factor, settings.lockstep ? 0 : kMostLag),
      publishing_(settings.publish_rate, kSlack * settings.scene.solver.control_period),
      listening_(settings.command_rate > 0 ? settings.command_rate : 1 / settings.scene.solver.control_period,
                 kSlack * settings.scene.solver.control_period),
      diagnosing_(kDiagnosticsRate, kSlack * settings.scene.solver.control_period),
      private_node_("~"),
      paused_(settings.start_paused),
      takes_commands_as_they_come_(!settings.publish_clock && settings.command_rate == 0) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  if (!settings_.bag.empty()) open_bag();
  advertise();
  const auto restart_odometry = [this] {
    telemetry_.update(simulation_, read_motors());
    telemetry_.restart_odometry();
  };
  interface_ = std::make_unique<DriverInterface>(driver_, settings_.telemetry.kinematics,
                                                 DriverInterface::Owner{[this] {
                                                                          if (takes_commands_as_they_come_) catch_up();
                                                                          return simulation_.time();
                                                                        },
                                                                        restart_odometry},
                                                 node_, private_node_, log_);
  if (settings_.world_tf) publish_world();
  if (settings_.publish_clock) offer_services();
  if (settings_.has_arms) ROS_WARN("youBotHasArms is true, but no arm is simulated: it will not be found");
}

MotorReadings BaseNode::read_motors() { return driver_.read(simulation_.state().phi(), simulation_.state().dphi()); }

void BaseNode::open_bag() {
  try {
    bag_ = std::make_unique<BagWriter>(settings_.bag);
  } catch (const std::runtime_error& error) {
    throw ParameterError(fmt::format("parameter ~bag: {}", error.what()));
  }
}

void BaseNode::advertise() {
  const std::uint32_t queue = settings_.publish_clock ? kRecorderQueueSize : kDriverQueueSize;
  telemetry_.visit(ros::Time(), [&](const char* topic, const auto& make) {
    if (topic == std::string(kTransformsTopic) && !settings_.publish_tf) return;
    publishers_[topic] = node_.advertise<decltype(make())>(topic, queue);
  });
  publishers_[kRollerSwitchesTopic] = node_.advertise<RollerSwitchStamped>(kRollerSwitchesTopic, kRecorderQueueSize);
  publishers_[kDiagnosticsTopic] =
      node_.advertise<diagnostic_msgs::DiagnosticArray>(kDiagnosticsTopic, kDriverQueueSize);
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
  publishers_[kDashboardTopic] = node_.advertise<pr2_msgs::PowerBoardState>(kDashboardTopic, kDriverQueueSize);
#endif
  // Latched, so that a node that comes later, perhaps while time stands still, knows the time at once.
  if (settings_.publish_clock) {
    publishers_[kClockTopic] = node_.advertise<rosgraph_msgs::Clock>(kClockTopic, kRecorderQueueSize, true);
  }
}

/// Where the scene's fixed frame lies for those who know only odometry's: the odometry starts at zero.
void BaseNode::publish_world() {
  const State& start = settings_.scene.initial;
  static_transforms_.emplace().sendTransform(
      transform_message(kWorldFrame, kOdometryFrame, {start.x(), start.y(), start.psi()}, ros::Time::now()));
}

void BaseNode::offer_services() {
  services_ = {private_node_.advertiseService(kPauseService, &BaseNode::pause, this),
               private_node_.advertiseService(kUnpauseService, &BaseNode::unpause, this),
               private_node_.advertiseService(kResetService, &BaseNode::reset, this),
               private_node_.advertiseService(kStepService, &BaseNode::step, this)};
}

void BaseNode::run() {
  ROS_INFO("model %s, control period %g s, %s", name_of(settings_.scene.model), settings_.scene.solver.control_period,
           settings_.publish_clock ? "master of simulated time" : "wall clock");
  if (settings_.publish_clock) announce_time();
  if (settings_.wait_for_subscribers) await_subscribers();
  wall_start_ = ros::Time::now();
  pacer_.start(simulation_.time());
  publish_instant();
  while (node_.ok()) {
    if (takes_commands_as_they_come_) {
      go_by_wall_clock();
    } else if (paused_) {
      queue_.callAvailable(ros::WallDuration(0.1));
    } else if (take_commands()) {
      advance();
    }
  }
  if (bag_) bag_->commit();
}

void BaseNode::await_subscribers() {
  const auto missing = [this] {
    std::string topics;
    for (const auto& [topic, publisher] : publishers_) {
      if (topic == kDiagnosticsTopic || topic == kDashboardTopic) continue;
      if (publisher.getNumSubscribers() == 0) topics += " " + topic;
    }
    return topics;
  };
  Hint hint;
  for (std::string topics = missing(); !topics.empty() && node_.ok(); topics = missing()) {
    queue_.callAvailable(ros::WallDuration(0.01));
    if (hint.due()) ROS_INFO_STREAM("time starts when these topics have subscribers:" << topics);
  }
  ros::WallDuration(kRecorderDelay).sleep();
}

/// Sleeps until somebody could notice: until a command comes, which has the simulation catch up first, or until there
/// is something to publish. To wake up for each control period would cost more than to simulate it.
void BaseNode::go_by_wall_clock() {
  const double period = settings_.scene.solver.control_period;
  const double end = std::ceil(publishing_.next() / period - kSlack) * period;
  queue_.callAvailable(ros::WallDuration(std::max(0.0, end - pacer_.now())));
  catch_up();
}

void BaseNode::catch_up() {
  if (wall_start_.isZero()) return;  // still waiting for subscribers
  const double period = settings_.scene.solver.control_period;
  while (simulation_.time() + period <= pacer_.now() && node_.ok()) advance();
}

bool BaseNode::take_commands() {
  if (!settings_.lockstep) {
    if (listening_.meet(simulation_.time()) && !queue_.isEmpty()) queue_.callAvailable(ros::WallDuration(0));
    return !paused_;
  }
  Hint hint;
  const auto none_left = [this] { return interface_->commands() == commands_taken_; };
  while (none_left() && !paused_ && node_.ok()) {
    queue_.callOne(ros::WallDuration(0.1));
    if (hint.due()) ROS_INFO("lockstep: waiting for a command at t = %g s", simulation_.time());
  }
  if (none_left() || paused_) return false;
  ++commands_taken_;
  return true;
}

/// Goes on to the end of the control period; waits and publishes only if somebody could notice.
void BaseNode::advance() {
  advance_period();
  const double t = simulation_.time();
  const bool listens = !takes_commands_as_they_come_ && listening_.due(t);
  if (!settings_.publish_clock && !publishing_.due(t) && !listens) return;
  const double lost = pacer_.wait_until(t);
  if (lost > 0 && !settings_.lockstep) {
    wall_start_ += ros::Duration(lost);
    log_.warn("lag", fmt::format("too slow for the rate asked for: {:.3g} s are lost", lost));
  }
  publish_instant();
}

void BaseNode::advance_period() {
  const bool was_present = driver_.present(), was_timed_out = driver_.timed_out();
  simulation_.advance_periods(1);
  if (was_present && !driver_.present()) {
    ROS_WARN("EtherCAT is lost: the base is not connected until reconnect is called");
  }
  if (!was_timed_out && driver_.timed_out()) {
    ROS_WARN("no command for %g s: the wheels are stopped", settings_.driver.command_timeout);
  }
}

/// What is due at the present time: the switches of the control period that has ended, and at their instants the rest.
void BaseNode::publish_instant() {
  const double t = simulation_.time();
  const bool is_due = publishing_.meet(t);
  const std::vector<RollerSwitch> switches = simulation_.take_switches();
  // With nobody to keep pace with, a /clock message each control period would cost more than the simulation itself.
  const bool keeps_pace = settings_.lockstep || settings_.real_time_factor > 0;
  if (settings_.publish_clock && (keeps_pace || is_due || !switches.empty())) announce_time();
  if (bag_) bag_->write(switches);
  for (const RollerSwitch& event : switches) {
    publish(kRollerSwitchesTopic, [&] { return roller_switch_message(event, stamp(event.t)); });
  }
  if (is_due) {
    telemetry_.update(simulation_, read_motors());
    if (bag_) bag_->write(telemetry_, t);
    telemetry_.visit(stamp(t), [this](const char* topic, const auto& make) {
      if (driver_.present() || topic == std::string(kGroundTruthTopic)) publish(topic, make);
    });
  }
  if (diagnosing_.meet(t)) publish_diagnostics();
}

void BaseNode::publish_diagnostics() {
  const ros::Time now = stamp(simulation_.time());
  const Pacer::Timing timing = pacer_.take_timing();
  publish(kDiagnosticsTopic, [&] { return diagnostics_message(driver_, simulation_, timing, now); });
#ifdef YOUBOT_BASE_SIM_PR2_MSGS
  publish(kDashboardTopic, [&] { return dashboard_message(driver_, now); });
#endif
}

void BaseNode::announce_time() {
  publish(kClockTopic, [this] {
    rosgraph_msgs::Clock message;
    message.clock = stamp(simulation_.time());
    return message;
  });
}

template <class Make>
void BaseNode::publish(const char* topic, const Make& make) {
  const auto found = publishers_.find(topic);
  if (found == publishers_.end()) return;
  const ros::Publisher& publisher = found->second;
  if (publisher.isLatched() || publisher.getNumSubscribers() > 0) publisher.publish(make());
}

ros::Time BaseNode::stamp(double t) const {
  return settings_.publish_clock ? stamp_of(t) : wall_start_ + ros::Duration(t);
}

bool BaseNode::pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  paused_ = true;
  return true;
}

bool BaseNode::unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  paused_ = false;
  pacer_.start(simulation_.time());
  return true;
}

bool BaseNode::reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  simulation_.reset();
  driver_ = BaseDriver(settings_.driver, simulation_.state().phi());
  telemetry_ = Telemetry(simulation_, read_motors(), settings_.telemetry);
  for (Schedule* schedule : {&publishing_, &listening_, &diagnosing_}) schedule->reset();
  listening_.meet(0);  // which this is
  pacer_.start(0);
  publish_instant();
  return true;
}

bool BaseNode::step(Step::Request& request, Step::Response& response) {
  response.success = paused_;
  if (paused_) {
    for (std::uint32_t k = 0; k < request.periods && node_.ok(); ++k) {
      advance_period();
      publish_instant();
    }
  } else {
    response.message = "not paused: call ~pause first";
  }
  response.t = simulation_.time();
  return true;
}

}  // namespace youbot_base_sim
