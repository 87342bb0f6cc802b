#include "youbot_base_sim/ros/driver_interface.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

namespace youbot_base_sim {

namespace {

constexpr char kNoBase[] = "No base initialized!";  // the driver's words

const std::string kTooMany = fmt::format("{} requests wait for time to advance", BaseRequests::kMaxWaiting);

// Without it Nagle's algorithm may hold a command back for 40 ms.
const ros::TransportHints kNoDelay = ros::TransportHints().tcpNoDelay();

}  // namespace

DriverInterface::DriverInterface(BaseLoop& loop, NodeClock& clock, const BaseSettings& settings, ros::NodeHandle& node,
                                 ros::NodeHandle& private_node, ThrottledLog& log)
    : loop_(loop),
      clock_(clock),
      log_(log),
      frames_(settings.telemetry.frames),
      warns_of_signs_(settings.telemetry.driver_velocity_sign) {
  subscribe<brics_actuator::JointTorques>(node, kTorqueTopic, [](const auto& m) { return wheel_command(m); });
  subscribe<brics_actuator::JointVelocities>(node, kVelocityTopic, [](const auto& m) { return wheel_command(m); });
  subscribe<geometry_msgs::Twist>(node, kTwistTopic, [kinematics = settings.sensors.kinematics](const auto& m) {
    return wheel_command(m, kinematics);
  });
  wrench_subscriber_ =
      private_node.subscribe(kWrenchTopic, kCommandQueueSize, &DriverInterface::receive_wrench, this, kNoDelay);
  const auto loads = [this](const SetLoads::Request& asked) {
    LoadsRequest request{loads_of(asked), static_cast<bool>(asked.at_rest)};
    if (const std::string reason = loop_.refusal(request.loads); !reason.empty()) throw std::runtime_error(reason);
    return request;
  };
  const auto state = [this](const SetState::Request& asked) { return state_of(asked, frames_, odom_pose()); };
  services_ = {offer_switch<SwitchOff>(node, kSwitchOffService, "Switch off the base motors"),
               offer_switch<SwitchOn>(node, kSwitchOnService, "Switch on the base motors"),
               node.advertiseService(kReconnectService, &DriverInterface::reconnect, this),
               offer<SetFaults>(private_node, kSetFaultsService, &SetFaults::Response::message, faults_of),
               offer<SetLoads>(private_node, kSetLoadsService, &SetLoads::Response::message, loads),
               offer<SetState>(private_node, kSetStateService, &SetState::Response::status_message, state)};
  if (!settings.listen_to_initialpose) return;
  initialpose_subscriber_ =
      node.subscribe(kInitialPoseTopic, kCommandQueueSize, &DriverInterface::receive_initialpose, this, kNoDelay);
}

template <class Message, class Read>
void DriverInterface::subscribe(ros::NodeHandle& node, const char* topic, const Read& read) {
  using Event = ros::MessageEvent<const Message>;
  const auto take = [this, topic, read](const Event& event) {
    commander_ = event.getPublisherName();
    clock_.note_command(commander_);
    receive(topic, read(*event.getMessage()));
  };
  command_subscribers_.push_back(
      node.subscribe<Message, const Event&>(topic, kCommandQueueSize, take, ros::VoidConstPtr(), kNoDelay));
}

bool DriverInterface::has_commander() const {
  return std::any_of(command_subscribers_.begin(), command_subscribers_.end(),
                     [](const ros::Subscriber& subscriber) { return subscriber.getNumPublishers() > 0; });
}

void DriverInterface::receive(const char* topic, const WheelCommand& command) {
  const double now = clock_.arrival();
  if (!loop_.present(now)) return log_.error("no base", kNoBase);
  const auto complain = [&](const std::string& subject, const std::string& text) {
    log_.warn(topic + subject, fmt::format("{}: {}", topic, text));
  };
  if (warns_of_signs_ && topic == std::string(kVelocityTopic) && (command.set_points[0] || command.set_points[2])) {
    warns_of_signs_ = false;
    ROS_WARN(
        "%s beside joint velocities with ~joint_velocity_sign = driver_exact: on wheel_joint_fl and _bl the two have "
        "opposite signs, and a loop closed over both has positive feedback; consistent has one sign for all",
        topic);
  }
  for (const Complaint& complaint : command.complaints) complain(complaint.subject, complaint.text);
  const Motor& motor = loop_.driver().motor();
  bool names_any = false;
  for (int i = 0; i < kWheels; ++i) {
    const auto& set_point = command.set_points[i];
    names_any = names_any || set_point;
    if (!set_point || motor.can(*set_point)) continue;
    const char* unit = text_of(set_point->mode).unit;
    complain(wheel_joint(i) + " limit",
             fmt::format("{}: {:.7g} {} is beyond the motor's limit: clipped to {:.5g} {}", wheel_joint(i),
                         set_point->value, unit, motor.limited(*set_point).value, unit));
  }
  if (names_any) loop_.push(now, command.set_points);
}

void DriverInterface::receive_wrench(const geometry_msgs::WrenchStamped& message) {
  try {
    const Wrench wrench = wrench_of(message, frames_, odom_pose()[2]);
    request(wrench);
    if (wrench.force.z() == 0) return;
    if (loop_.simulation().scene().robot.normal_reactions == NormalReactions::kDynamic) return;
    log_.warn("vertical force",
              fmt::format("~{}: wrench.force.z = {}: has no effect unless robot.normal_reactions is dynamic",
                          kWrenchTopic, wrench.force.z()));
  } catch (const std::runtime_error& error) {
    log_.warn(kWrenchTopic, fmt::format("~{}: {}: rejected", kWrenchTopic, error.what()));
  }
}

void DriverInterface::receive_initialpose(const geometry_msgs::PoseWithCovarianceStamped& message) {
  const std::string reason = refusal([&] { return state_of(message, frames_, odom_pose()); });
  if (!reason.empty()) log_.warn(kInitialPoseTopic, fmt::format("{}: {}: rejected", kInitialPoseTopic, reason));
}

/// Enqueues a request other than a command. Throws std::runtime_error if it is refused.
void DriverInterface::request(const BaseRequest& request) {
  if (!loop_.push(clock_.arrival(), request)) throw std::runtime_error(kTooMany);
}

/// A service of the driver that needs a base. `line`: for the log, the driver's. What it throws, roscpp sends to the
/// caller and logs: std_srvs/Empty has no room for a reason.
template <class Request>
ros::ServiceServer DriverInterface::offer_switch(ros::NodeHandle& node, const char* service, const char* line) {
  const auto serve = [this, line](std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
    ROS_INFO_STREAM(line);
    if (!loop_.present(clock_.arrival())) throw std::runtime_error(kNoBase);
    request(Request());
    return true;
  };
  return node.advertiseService<std_srvs::Empty::Request, std_srvs::Empty::Response>(service, serve);
}

/// True whether or not there is a base then, as the driver's is.
bool DriverInterface::reconnect(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  request(Reconnect());
  if (loop_.present(clock_.arrival())) {
    ROS_INFO("Base is initialized.");
  } else {
    ROS_ERROR("Base could not be initialized: EtherCAT is lost");
  }
  return true;
}

/// A service that enqueues what `make_request` makes of what is asked; `message` says why not.
template <class Service, class MakeRequest>
ros::ServiceServer DriverInterface::offer(ros::NodeHandle& private_node, const char* service,
                                          std::string Service::Response::*message, MakeRequest make_request) {
  const auto serve = [=](typename Service::Request& asked, typename Service::Response& response) {
    response.*message = refusal([&] { return make_request(asked); });
    response.success = (response.*message).empty();
    return true;
  };
  return private_node.advertiseService<typename Service::Request, typename Service::Response>(service, serve);
}

/// Enqueues what `make_request` returns. Returns why not, where that throws or too many wait; else an empty text.
template <class MakeRequest>
std::string DriverInterface::refusal(const MakeRequest& make_request) {
  try {
    request(make_request());
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

}  // namespace youbot_base_sim
