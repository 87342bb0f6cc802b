#include "youbot_base_sim/ros/burden_interface.h"

#include <fmt/format.h>

#include "youbot_base_sim/ros/burden_messages.h"
#include "youbot_base_sim/ros/node_constants.h"

namespace youbot_base_sim {

namespace {

constexpr char kTooMany[] = "too many requests wait for time to go on";

}  // namespace

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
  if (!loop_.push(now_(), wrench)) {
    return log_.warn(kWrenchTopic, fmt::format("~{}: {}: refused", kWrenchTopic, kTooMany));
  }
  if (wrench.force.z() != 0 && loop_.simulation().scene().robot.normal_reactions == NormalReactions::kStatic) {
    log_.warn("vertical force", fmt::format("~{}: wrench.force.z = {}: has no effect unless robot.normal_reactions is "
                                            "dynamic",
                                            kWrenchTopic, wrench.force.z()));
  }
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
