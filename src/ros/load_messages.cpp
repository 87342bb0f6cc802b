#include "youbot_base_sim/ros/load_messages.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/node_constants.h"
#include "youbot_base_sim/scene/frames.h"
#include "youbot_base_sim/scene/load_schedule.h"
#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

namespace {

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

/// Position of the origin of base_link, from O at the height of the axles, m.
const Eigen::Vector3d kBaseLinkOrigin{0, 0, -kAxleHeight};

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
  wrench.point = kBaseLinkOrigin;
  for (int k = 0; k < 3; ++k) {
    check(fmt::format("wrench.force.{}", "xyz"[k]), wrench.force[k], kWrenchForces, complaint);
  }
  check("wrench.torque.z", wrench.torque, kWrenchTorques, complaint);
  const double tilting[] = {message.wrench.torque.x, message.wrench.torque.y};
  for (int k = 0; k < 2 && complaint.empty(); ++k) {
    if (tilting[k] == 0) continue;
    complaint = fmt::format("wrench.torque.{} = {}: must be 0, as only torques about the vertical axis act", "xy"[k],
                            tilting[k]);
  }
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
    for (int k = 0; k < 3; ++k) check(name + "position." + "xyz"[k], load.position[k], kLoadPositions, complaint);
    check(name + "inertia", load.inertia, kLoadInertias, complaint);
    load.position += kBaseLinkOrigin;
  }
  return loads;
}

Eigen::Vector3d platform_force(const Wrench& wrench, double psi) {
  if (!wrench.fixed) return wrench.force;
  return Eigen::AngleAxisd(-psi, Eigen::Vector3d::UnitZ()) * wrench.force;
}

geometry_msgs::WrenchStamped wrench_message(const std::vector<Wrench>& wrenches, double psi, const ros::Time& stamp) {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
  for (const Wrench& wrench : wrenches) {
    const Eigen::Vector3d one = platform_force(wrench, psi);
    force += one;
    torque += (wrench.point - kBaseLinkOrigin).cross(one) + wrench.torque * Eigen::Vector3d::UnitZ();
  }
  geometry_msgs::WrenchStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = kBaseLinkFrame;
  message.wrench.force = vector_message<geometry_msgs::Vector3>(force);
  message.wrench.torque = vector_message<geometry_msgs::Vector3>(torque);
  return message;
}

LoadsStamped loads_message(const std::vector<Load>& loads, const ros::Time& stamp) {
  LoadsStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = kBaseLinkFrame;
  for (const Load& load : loads) {
    Payload& payload = message.loads.emplace_back();
    payload.mass = load.mass;
    payload.position = vector_message<geometry_msgs::Point>(load.position - kBaseLinkOrigin);
    payload.inertia = load.inertia;
  }
  return message;
}

}  // namespace youbot_base_sim
