#include "youbot_base_sim/ros/base_node.h"

#include <fmt/format.h>
#include <rosgraph_msgs/Clock.h>

#include <cmath>

#include "youbot_base_sim/ros/parameters.h"

namespace youbot_base_sim {

namespace {

constexpr char kTwistTopic[] = "cmd_vel";
constexpr char kClockTopic[] = "/clock";

constexpr double kMostLag = 1.0;        // s of wall time, before the loop stops catching up
constexpr double kRecorderDelay = 0.2;  // s of wall time from a recorder's subscription to its first message at most
constexpr auto kHintAfter = std::chrono::seconds(5);  // of waiting for anything without a word
constexpr auto kSilence = std::chrono::seconds(1);    // between two warnings about the same thing
constexpr std::uint32_t kDriverQueue = 1;             // of the driver's publishers: the latest counts
constexpr std::uint32_t kRecorderQueue = 1000;

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

Telemetry::Options telemetry_options(const BaseNode::Settings& settings) {
  Telemetry::Options options;
  options.kinematics.wheel_radius = settings.driver_wheel_radius;
  options.rollers = settings.publish_rollers;
  return options;
}

Scene read_scene(Parameters& parameters) {
  const std::string path = parameters.text("scene", "");
  SceneOverrides overrides;
  overrides.model = parameters.text("model", "");
  overrides.control_period = parameters.number("control_period", -1, 1e-6, 10, "s");
  Scene scene;
  try {
    if (!overrides.model.empty()) scene.model = model_from_name(overrides.model);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~{}", error.what()));  // "model = ..."
  }
  try {
    if (!path.empty()) scene = load_scene(path, overrides);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~scene: {}", error.what()));
  }
  if (overrides.control_period > 0) scene.solver.control_period = overrides.control_period;
  if (!(scene.solver.control_period > 0)) scene.solver.control_period = 1e-3;
  scene.drive = std::monostate();
  return scene;
}

/// Refuses what makes no sense without being the master of time.
void check_time(const BaseNode::Settings& settings) {
  bool use_sim_time = false;
  ros::param::get("/use_sim_time", use_sim_time);
  if (settings.publish_clock) {
    if (!use_sim_time) ROS_WARN("/use_sim_time is not set: nodes that start now will not follow the clock of this one");
    return;
  }
  if (use_sim_time) {
    throw ParameterError(
        "parameter ~publish_clock = false: must be true where /use_sim_time is true, or nobody knows the time");
  }
  if (settings.real_time_factor != 1) {
    throw refusal("real_time_factor", fmt::format("{:g}", settings.real_time_factor),
                  "1 unless ~publish_clock is true: the wall clock has its own rate");
  }
  if (settings.lockstep) throw refusal("lockstep", "true", "false unless ~publish_clock is true");
  if (!settings.bag.empty()) {
    throw refusal("bag", settings.bag, "left out unless ~publish_clock is true: use rosbag record");
  }
  if (settings.start_paused) throw refusal("start_paused", "true", "false unless ~publish_clock is true");
}

}  // namespace

BaseNode::Settings BaseNode::read_settings() {
  Parameters parameters(ros::NodeHandle("~"));
  Settings settings;
  settings.scene = read_scene(parameters);
  const double most_rate = 1 / settings.scene.solver.control_period;
  settings.publish_rate = parameters.number("publish_rate", std::min(settings.publish_rate, most_rate), 1e-3,
                                            most_rate * (1 + 1e-9), "Hz: at most once a control period");
  settings.publish_clock = parameters.flag("publish_clock", settings.publish_clock);
  settings.real_time_factor = parameters.number("real_time_factor", settings.real_time_factor, 0, 1e6, "");
  settings.lockstep = parameters.flag("lockstep", settings.lockstep);
  settings.wait_for_subscribers = parameters.flag("wait_for_subscribers", settings.wait_for_subscribers);
  settings.start_paused = parameters.flag("start_paused", settings.start_paused);
  settings.publish_tf = parameters.flag("publish_tf", settings.publish_tf);
  settings.world_tf = parameters.flag("world_tf", settings.world_tf);
  settings.publish_rollers = parameters.flag("publish_rollers", settings.publish_rollers);
  settings.driver_wheel_radius = parameters.number("driver_wheel_radius", settings.driver_wheel_radius, 1e-3, 1, "m");
  settings.bag = parameters.text("bag", settings.bag);
  parameters.refuse_others();
  check_time(settings);
  return settings;
}

BaseNode::BaseNode(const Settings& settings)
    : settings_(settings),
      kinematics_(telemetry_options(settings).kinematics),
      drive_(settings.scene.solver.control_period),
      simulation_(settings.scene, [this](double, const State& state) { return drive_.sample(state.dphi()); }),
      telemetry_(simulation_, telemetry_options(settings)),
      pacer_(settings.real_time_factor, settings.lockstep ? 0 : kMostLag),
      private_node_("~"),
      paused_(settings.start_paused) {
  node_.setCallbackQueue(&queue_);
  private_node_.setCallbackQueue(&queue_);
  if (!settings_.bag.empty()) open_bag();
  hold_wheels();
  advertise();
  subscribe();
  if (settings_.world_tf) publish_world();
  if (settings_.publish_clock) offer_services();
}

void BaseNode::open_bag() {
  try {
    bag_ = std::make_unique<BagWriter>(settings_.bag, telemetry_options(settings_));
  } catch (const std::runtime_error& error) {
    throw ParameterError(fmt::format("parameter ~bag: {}", error.what()));
  }
}

void BaseNode::advertise() {
  const std::uint32_t queue = settings_.publish_clock ? kRecorderQueue : kDriverQueue;
  telemetry_.visit(ros::Time(), [&](const char* topic, const auto& make) {
    if (topic == std::string("/tf") && !settings_.publish_tf) return;
    publishers_[topic] = node_.advertise<decltype(make())>(topic, queue);
  });
  publishers_[Telemetry::kSwitches] = node_.advertise<RollerSwitchStamped>(Telemetry::kSwitches, kRecorderQueue);
  // Latched, so that a node that comes later, perhaps while time stands still, knows the time at once.
  if (settings_.publish_clock) {
    publishers_[kClockTopic] = node_.advertise<rosgraph_msgs::Clock>(kClockTopic, kRecorderQueue, true);
  }
}

/// Where the scene's fixed frame lies for those who know only odometry's: the odometry starts at zero.
void BaseNode::publish_world() {
  const State& start = settings_.scene.initial;
  tf2_msgs::TFMessage message;
  message.transforms.push_back(
      transform_message(kWorldFrame, kOdometryFrame, {start.x(), start.y(), start.psi()}, ros::Time::now()));
  static_transforms_ = node_.advertise<tf2_msgs::TFMessage>("/tf_static", 1, true);
  static_transforms_.publish(message);
}

void BaseNode::subscribe() {
  constexpr std::uint32_t kQueue = 1000;
  // Without it Nagle's algorithm may hold a command back for 40 ms.
  const auto hints = ros::TransportHints().tcpNoDelay();
  subscribers_ = {node_.subscribe(kTorqueTopic, kQueue, &BaseNode::take_torques, this, hints),
                  node_.subscribe(kVelocityTopic, kQueue, &BaseNode::take_velocities, this, hints),
                  node_.subscribe(kTwistTopic, kQueue, &BaseNode::take_twist, this, hints)};
}

void BaseNode::offer_services() {
  services_ = {private_node_.advertiseService("pause", &BaseNode::pause, this),
               private_node_.advertiseService("unpause", &BaseNode::unpause, this),
               private_node_.advertiseService("reset", &BaseNode::reset, this),
               private_node_.advertiseService("step", &BaseNode::step, this)};
}

void BaseNode::run() {
  ROS_INFO("model %s, control period %g s, %s", name_of(settings_.scene.model), settings_.scene.solver.control_period,
           settings_.publish_clock ? "master of simulated time" : "wall clock");
  announce_time();
  if (settings_.wait_for_subscribers) await_subscribers();
  wall_start_ = ros::Time::now();
  pacer_.start(simulation_.time());
  publish_instant();
  while (node_.ok()) {
    if (paused_) {
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

bool BaseNode::take_commands() {
  if (!settings_.lockstep) {
    queue_.callAvailable(ros::WallDuration(0));
    return !paused_;
  }
  Hint hint;
  while (commands_left_ == 0 && !paused_ && node_.ok()) {
    queue_.callOne(ros::WallDuration(0.1));
    if (hint.due()) ROS_INFO("lockstep: waiting for a command at t = %g s", simulation_.time());
  }
  if (commands_left_ == 0 || paused_) return false;
  --commands_left_;
  return true;
}

void BaseNode::advance() {
  simulation_.advance_period();
  const double lost = pacer_.wait_until(simulation_.time());
  if (lost > 0 && !settings_.lockstep) {
    wall_start_ += ros::Duration(lost);
    warn("lag", fmt::format("too slow for the rate asked for: {:.3g} s are lost", lost));
  }
  publish_instant();
}

/// What is due at the present time: the switches of the control period that has ended, and every 1 / publish_rate the
/// rest. The instants are multiples of that period, each rounded up to the end of a control period.
void BaseNode::publish_instant() {
  const double t = simulation_.time();
  const double due = static_cast<double>(instants_) / settings_.publish_rate;
  const bool is_due = t >= due - 1e-6 * settings_.scene.solver.control_period;
  const std::vector<RollerSwitch> switches = simulation_.take_switches();
  // With nobody to keep pace with, a /clock message each control period would cost more than the simulation itself.
  if (settings_.lockstep || settings_.real_time_factor > 0 || is_due || !switches.empty()) announce_time();
  if (bag_) bag_->write(switches);
  for (const RollerSwitch& event : switches) {
    publish(Telemetry::kSwitches, [&] { return roller_switch_message(event, stamp(event.t)); });
  }
  if (!is_due) return;
  ++instants_;
  if (bag_) bag_->write(simulation_);
  telemetry_.update(simulation_);
  telemetry_.visit(stamp(t), [this](const char* topic, const auto& make) { publish(topic, make); });
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

void BaseNode::take_torques(const brics_actuator::JointTorques& message) {
  obey(kTorqueTopic, wheel_command(message), &WheelDrive::command_torque);
}

void BaseNode::take_velocities(const brics_actuator::JointVelocities& message) {
  obey(kVelocityTopic, wheel_command(message), &WheelDrive::command_velocity);
}

void BaseNode::take_twist(const geometry_msgs::Twist& message) {
  WheelCommand command;
  if (const auto velocity = commanded_velocity(message)) {
    const Wheels rates = kinematics_.wheel_rates(*velocity);
    for (int i = 0; i < kWheels; ++i) command.values[i] = rates[i];
  } else {
    command.complaints.push_back(
        {"value", fmt::format("({}, {}, {}) is not finite: refused, the base goes on as before", message.linear.x,
                              message.linear.y, message.angular.z)});
  }
  obey(kTwistTopic, command, &WheelDrive::command_velocity);
}

void BaseNode::obey(const char* topic, const WheelCommand& command, bool (WheelDrive::*set)(int, double)) {
  ++commands_left_;
  const auto complain = [&](const Complaint& complaint) {
    warn(topic + complaint.subject, fmt::format("{}: {}", topic, complaint.text));
  };
  for (const Complaint& complaint : command.complaints) complain(complaint);
  for (int i = 0; i < kWheels; ++i) {
    if (!command.values[i] || (drive_.*set)(i, *command.values[i])) continue;
    complain({wheel_joint(i) + " limit",
              fmt::format("{}: {} is beyond the motor's limit: clipped to it", wheel_joint(i), *command.values[i])});
  }
}

void BaseNode::hold_wheels() {
  for (int i = 0; i < kWheels; ++i) drive_.command_velocity(i, 0);
}

/// Says it once a second at most for each subject. (ROS_WARN_THROTTLE goes by simulated time, which may stand still.)
void BaseNode::warn(const std::string& subject, const std::string& text) {
  const auto now = SteadyClock::now();
  const auto [last, is_first] = last_warning_.emplace(subject, now);
  if (!is_first && now - last->second < kSilence) return;
  last->second = now;
  ROS_WARN_STREAM(text);
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
  drive_.reset();
  hold_wheels();
  telemetry_.reset(simulation_);
  instants_ = 0;
  pacer_.start(0);
  publish_instant();
  return true;
}

bool BaseNode::step(Step::Request& request, Step::Response& response) {
  response.success = paused_;
  if (paused_) {
    for (std::uint32_t k = 0; k < request.periods && node_.ok(); ++k) {
      simulation_.advance_period();
      publish_instant();
    }
  } else {
    response.message = "not paused: call ~pause first";
  }
  response.t = simulation_.time();
  return true;
}

}  // namespace youbot_base_sim
