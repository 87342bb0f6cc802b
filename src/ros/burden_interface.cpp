#include "youbot_base_sim/ros/burden_interface.h"

#include <fmt/format.h>

#include <cmath>

#include "youbot_base_sim/ros/node_constants.h"
#include "youbot_base_sim/scene/burden_plan.h"
#include "youbot_base_sim/scene/frames.h"
#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

constexpr char kTooMany[] = "too many requests wait for time to go on";

/// Appends to `complaint`, if that is empty, that `number` is not in its range.
void check(const std::string& name, double number, const Range& range, std::string& complaint) {
  if (complaint.empty() && !contains(range, number)) {
    complaint = fmt::format("{} = {}: must be {}", name, number, text_of(range));
  }
}

template <class Message>
Eigen::Vector3d vector(const Message& message) {
  return {message.x, message.y, message.z};
}

}  // namespace

Wrench wrench_of(const geometry_msgs::WrenchStamped& message, std::string& complaint) {
  Wrench wrench;
  const std::string& frame = message.header.frame_id;
  wrench.fixed = frame == kWorldFrame || frame == kOdometryFrame;
  if (!wrench.fixed && !frame.empty() && frame != kBaseLinkFrame && frame != kBaseFrame) {
    complaint = fmt::format("header.frame_id = {}: must be {}, {} or {}", quote(frame), kBaseLinkFrame, kWorldFrame,
                            kOdometryFrame);
  }
  wrench.force = vector(message.wrench.force);
  wrench.torque = message.wrench.torque.z;
  wrench.point = {0, 0, -kAxleHeight};
  for (int k = 0; k < 3; ++k) {
    check(fmt::format("wrench.force.{}", "xyz"[k]), wrench.force[k], kWrenchForces, complaint);
  }
  check("wrench.torque.z", wrench.torque, kWrenchTorques, complaint);
  check("wrench.torque.x", message.wrench.torque.x, {0, 0, "N m"}, complaint);
  check("wrench.torque.y", message.wrench.torque.y, {0, 0, "N m"}, complaint);
  return wrench;
}

std::vector<Load> loads_of(const SetLoads::Request& request, std::string& complaint) {
  std::vector<Load> loads;
  for (const Payload& message : request.loads) {
    const std::string name = fmt::format("loads[{}].", loads.size());
    Load& load = loads.emplace_back();
    load.mass = message.mass;
    load.position = vector(message.position);
    load.inertia = message.inertia;
    check(name + "mass", load.mass, kLoadMasses, complaint);
    for (int k = 0; k < 3; ++k) check(name + "position." + "xyz"[k], load.position[k], kBurdenPositions, complaint);
    check(name + "inertia", load.inertia, kLoadInertias, complaint);
    load.position[2] -= kAxleHeight;
  }
  return loads;
}

BurdenInterface::BurdenInterface(BaseLoop& loop, const std::function<double()>& now, ros::NodeHandle& private_node,
                                 ThrottledLog& log)
    : loop_(loop), now_(now), log_(log) {
  subscriber_ = private_node.subscribe(kWrenchTopic, kCommandQueueSize, &BurdenInterface::receive, this,
                                       ros::TransportHints().tcpNoDelay());
  service_ = private_node.advertiseService(kSetLoadsService, &BurdenInterface::set_loads, this);
}

void BurdenInterface::receive(const geometry_msgs::WrenchStamped& message) {
  std::string complaint;
  const Wrench wrench = wrench_of(message, complaint);
  if (!complaint.empty()) return log_.warn(kWrenchTopic, fmt::format("~{}: {}: refused", kWrenchTopic, complaint));
  if (!loop_.push(now_(), wrench)) log_.warn(kWrenchTopic, fmt::format("~{}: {}: refused", kWrenchTopic, kTooMany));
}

bool BurdenInterface::set_loads(SetLoads::Request& request, SetLoads::Response& response) {
  const std::vector<Load> loads = loads_of(request, response.message);
  if (response.message.empty()) response.message = loop_.refusal(loads);
  if (response.message.empty() && !loop_.push(now_(), loads, request.at_rest)) {
    response.message = kTooMany;
  }
  response.success = response.message.empty();
  return true;
}

}  // namespace youbot_base_sim
