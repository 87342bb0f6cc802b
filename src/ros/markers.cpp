#include "youbot_base_sim/ros/markers.h"

#include <algorithm>

#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {

using visualization_msgs::Marker;

namespace {

constexpr double kShaft = 0.008, kHead = 0.018;  // of arrows, m
constexpr double kMinArrow = 1e-3;               // m: a shorter one could not be seen

}  // namespace

Eigen::Vector3d way_of(const Eigen::Vector3d& vector, double scale) {
  return std::min(vector.norm() * scale, kMaxArrow) * vector.stableNormalized();
}

std_msgs::ColorRGBA colour(double r, double g, double b, double a) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(r);
  message.g = static_cast<float>(g);
  message.b = static_cast<float>(b);
  message.a = static_cast<float>(a);
  return message;
}

geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose) {
  geometry_msgs::Pose message;
  message.position = vector_message<geometry_msgs::Point>(pose.translation());
  const Eigen::Quaterniond q(pose.linear());
  message.orientation.x = q.x();
  message.orientation.y = q.y();
  message.orientation.z = q.z();
  message.orientation.w = q.w();
  return message;
}

Marker& Markers::add(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& colour) {
  Marker& marker = array.markers.emplace_back();
  marker.header = header_;
  marker.ns = ns;
  marker.id = id;
  marker.type = type;
  marker.color = colour;
  marker.pose.orientation.w = 1;
  marker.frame_locked = true;  // or they lag behind the robot where rviz is slow
  return marker;
}

void Markers::remove(const std::string& ns, int id) {
  add(ns, id, Marker::CUBE, colour(1, 1, 1)).action = Marker::DELETE;
}

void Markers::add_arrow(const std::string& ns, int id, const Eigen::Vector3d& start, const Eigen::Vector3d& vector,
                        double scale, const std_msgs::ColorRGBA& colour) {
  add_way(ns, id, start, way_of(vector, scale), 1, colour);
}

void Markers::add_arrow_to(const std::string& ns, int id, const Eigen::Vector3d& end, const Eigen::Vector3d& vector,
                           double scale, const std_msgs::ColorRGBA& colour) {
  const Eigen::Vector3d way = way_of(vector, scale);
  add_way(ns, id, end - way, way, 2, colour);
}

void Markers::add_way(const std::string& ns, int id, const Eigen::Vector3d& start, const Eigen::Vector3d& way,
                      double width, const std_msgs::ColorRGBA& colour) {
  const double length = way.norm();
  if (length < kMinArrow) return remove(ns, id);
  Marker& marker = add(ns, id, Marker::ARROW, colour);
  marker.points = {vector_message<geometry_msgs::Point>(start), vector_message<geometry_msgs::Point>(start + way)};
  marker.scale.x = width * kShaft;
  marker.scale.y = width * kHead;
  marker.scale.z = std::min(1.5 * width * kHead, length / 2);
}

Marker& Markers::add_text(const std::string& ns, int id, const Eigen::Vector3d& position, const std::string& text,
                          const std_msgs::ColorRGBA& colour) {
  Marker& marker = add(ns, id, Marker::TEXT_VIEW_FACING, colour);
  marker.pose.position = vector_message<geometry_msgs::Point>(position);
  marker.scale.z = kLetter;
  marker.text = text;
  return marker;
}

}  // namespace youbot_base_sim
