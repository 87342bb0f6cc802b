#include "youbot_base_sim/ros/driver_interface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/ros/node_constants.h"

namespace youbot_base_sim {

namespace {

constexpr char kNoBase[] = "No base initialized!";  // the driver's words

const std::string kTooMany = fmt::format("{} requests wait for time to advance: refused", BaseRequests::kMaxWaiting);

/// Faults of a request. `complaint` says why they cannot be; empty: they can.
Faults faults_of(const SetFaults::Request& request, std::string& complaint) {
  const auto checked = [&complaint](const std::string& name, double value, double max, const char* unit) {
    const bool holds = value >= 0 && value <= max;
    if (complaint.empty() && !holds) {
      complaint = fmt::format("{} = {}: must be from 0 to {:g}{}", name, value, max, unit);
    }
    return value;
  };
  Faults faults;
  faults.ethercat_lost = request.ethercat_lost;
  for (int i = 0; i < kWheels; ++i) {
    faults.silent[i] = request.silent[i];
    faults.encoder_slip[i] = checked(fmt::format("encoder_slip[{}]", i), request.encoder_slip[i], 1, "");
  }
  faults.encoder_noise = checked("encoder_noise", request.encoder_noise, 10, " rad");
  faults.command_delay = checked("command_delay", request.command_delay, kMaxCommandDelay, " s");
  return faults;
}

}  // namespace

DriverInterface::DriverInterface(BaseLoop& loop, const NodeClock& clock, const BaseSettings& settings,
                                 ros::NodeHandle& node, ros::NodeHandle& private_node, ThrottledLog& log)
    : loop_(loop), clock_(clock), log_(log), warns_of_signs_(settings.telemetry.driver_velocity_sign) {
  subscribe<brics_actuator::JointTorques>(node, kTorqueTopic, [](const auto& m) { return wheel_command(m); });
  subscribe<brics_actuator::JointVelocities>(node, kVelocityTopic, [](const auto& m) { return wheel_command(m); });
  subscribe<geometry_msgs::Twist>(node, kTwistTopic, [kinematics = settings.sensors.kinematics](const auto& m) {
    return wheel_command(m, kinematics);
  });
  wrench_subscriber_ = private_node.subscribe(kWrenchTopic, kCommandQueueSize, &DriverInterface::receive_wrench, this,
                                              ros::TransportHints().tcpNoDelay());
  services_ = {offer_switch<SwitchOff>(node, kSwitchOffService, "Switch off the base motors"),
               offer_switch<SwitchOn>(node, kSwitchOnService, "Switch on the base motors"),
               node.advertiseService(kReconnectService, &DriverInterface::reconnect, this),
               private_node.advertiseService(kSetFaultsService, &DriverInterface::set_faults, this),
               private_node.advertiseService(kSetLoadsService, &DriverInterface::set_loads, this)};
}

template <class Message>
void DriverInterface::subscribe(ros::NodeHandle& node, const char* topic,
                                const std::function<WheelCommand(const Message&)>& read) {
  const boost::function<void(const boost::shared_ptr<const Message>&)> take =
      [this, topic, read](const boost::shared_ptr<const Message>& message) { receive(topic, read(*message)); };
  // Without the hint Nagle's algorithm may hold a command back for 40 ms.
  command_subscribers_.push_back(
      node.subscribe<Message>(topic, kCommandQueueSize, take, ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay()));
}

bool DriverInterface::has_commander() const {
  return std::any_of(command_subscribers_.begin(), command_subscribers_.end(),
                     [](const ros::Subscriber& subscriber) { return subscriber.getNumPublishers() > 0; });
}

void DriverInterface::receive(const char* topic, const WheelCommand& command) {
  commanded_ = true;
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
    const char* unit = set_point->mode == DriveMode::kTorque ? "N m" : "rad/s";
    complain(wheel_joint(i) + " limit",
             fmt::format("{}: {:.7g} {} is beyond the motor's limit: clipped to {:.5g} {}", wheel_joint(i),
                         set_point->value, unit, motor.limited(*set_point).value, unit));
  }
  if (names_any) loop_.push(now, command.set_points);
}

void DriverInterface::receive_wrench(const geometry_msgs::WrenchStamped& message) {
  std::string complaint;
  const Wrench wrench = wrench_of(message, complaint);
  if (!complaint.empty()) return log_.warn(kWrenchTopic, fmt::format("~{}: {}: refused", kWrenchTopic, complaint));
  if (!request(wrench)) return;
  if (wrench.force.z() != 0 && loop_.simulation().scene().robot.normal_reactions == NormalReactions::kStatic) {
    log_.warn("vertical force", fmt::format("~{}: wrench.force.z = {}: has no effect unless robot.normal_reactions is "
                                            "dynamic",
                                            kWrenchTopic, wrench.force.z()));
  }
}

/// Enqueues a request other than a command; false if it is refused.
bool DriverInterface::request(const BaseRequest& request) {
  const bool taken = loop_.push(clock_.arrival(), request);
  if (!taken) log_.error("too many", kTooMany);
  return taken;
}

/// A service of the driver for a request that needs a base. `line`: for the log, the driver's.
template <class Request>
ros::ServiceServer DriverInterface::offer_switch(ros::NodeHandle& node, const char* service, const char* line) {
  using std_srvs::Empty;
  return node.advertiseService<Empty::Request, Empty::Response>(service,
                                                                [this, line](Empty::Request&, Empty::Response&) {
                                                                  ROS_INFO_STREAM(line);
                                                                  if (loop_.present(clock_.arrival()))
                                                                    return request(Request());
                                                                  log_.error("no base", kNoBase);
                                                                  return false;
                                                                });
}

/// True whether or not there is a base then, as the driver's is.
bool DriverInterface::reconnect(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  if (!request(Reconnect())) return false;
  if (loop_.present(clock_.arrival())) {
    ROS_INFO("Base is initialized.");
  } else {
    ROS_ERROR("Base could not be initialized: EtherCAT is lost");
  }
  return true;
}

bool DriverInterface::set_faults(SetFaults::Request& asked, SetFaults::Response& response) {
  const Faults faults = faults_of(asked, response.message);
  if (response.message.empty() && !request(faults)) response.message = kTooMany;
  response.success = response.message.empty();
  return true;
}

bool DriverInterface::set_loads(SetLoads::Request& asked, SetLoads::Response& response) {
  const std::vector<Load> loads = loads_of(asked, response.message);
  if (response.message.empty()) response.message = loop_.refusal(loads);
  if (response.message.empty() && !request(LoadsRequest{loads, static_cast<bool>(asked.at_rest)})) {
    response.message = kTooMany;
  }
  response.success = response.message.empty();
  return true;
}

}  // namespace youbot_base_sim
