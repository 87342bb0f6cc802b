#include "youbot_base_sim/ros/contact_markers.h"

#include <fmt/format.h>

#include <cmath>

#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

namespace {

using visualization_msgs::Marker;

std_msgs::ColorRGBA colour(double r, double g, double b) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(r);
  message.g = static_cast<float>(g);
  message.b = static_cast<float>(b);
  message.a = 1;
  return message;
}

const std_msgs::ColorRGBA kFriction = colour(1, 0.85, 0.1), kSlip = colour(0.85, 0.4, 1);
const std_msgs::ColorRGBA kSticks = colour(0.2, 0.8, 0.3), kSlides = colour(0.95, 0.15, 0.1);
const std_msgs::ColorRGBA kText = colour(1, 1, 1);

constexpr double kPoint = 0.014, kShaft = 0.008, kHead = 0.018, kLetter = 0.035;  // m
constexpr double kStatusHeight = 0.6, kLegendHeight = 0.54;                       // over the base's frame, m

geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose) {
  geometry_msgs::Pose message;
  message.position.x = pose.translation().x();
  message.position.y = pose.translation().y();
  message.position.z = pose.translation().z();
  const Eigen::Quaterniond q(pose.linear());
  message.orientation.x = q.x();
  message.orientation.y = q.y();
  message.orientation.z = q.z();
  message.orientation.w = q.w();
  return message;
}

class Markers {
 public:
  explicit Markers(const std_msgs::Header& header) : header_(header) {}

  Marker& add(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& colour) {
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

  /// What an id showed before is no longer there.
  void remove(const std::string& ns, int id) { add(ns, id, Marker::CUBE, kText).action = Marker::DELETE; }

  /// An arrow from `start` along `vector`, in its unit, of `scale` m for each; none where it could not be seen.
  void add_arrow(const std::string& ns, int id, const geometry_msgs::Point& start, const geometry_msgs::Vector3& vector,
                 double scale, const std_msgs::ColorRGBA& colour) {
    const double size = std::hypot(vector.x, vector.y), length = std::min(size * scale, kMaxArrow);
    if (length < 1e-3) return remove(ns, id);
    Marker& marker = add(ns, id, Marker::ARROW, colour);
    marker.points.resize(2, start);
    marker.points[1].x += vector.x / size * length;
    marker.points[1].y += vector.y / size * length;
    marker.scale.x = kShaft;
    marker.scale.y = kHead;
    marker.scale.z = std::min(1.5 * kHead, length / 2);
  }

  void add_text(const std::string& ns, int id, double height, const std::string& text,
                const std_msgs::ColorRGBA& colour) {
    Marker& marker = add(ns, id, Marker::TEXT_VIEW_FACING, colour);
    marker.pose.position.z = height;
    marker.scale.z = kLetter;
    marker.text = text;
  }

  visualization_msgs::MarkerArray array;

 private:
  std_msgs::Header header_;
};

void add_contact(Markers& markers, int i, const Contact& contact, const Simulation& simulation,
                 const MarkerOptions& options) {
  const std_msgs::ColorRGBA& state = contact.friction_share >= kSaturated ? kSlides : kSticks;
  Marker& point = markers.add("contact_points", i, Marker::SPHERE, state);
  point.pose.position = contact.position;
  point.scale.x = point.scale.y = point.scale.z = kPoint;
  markers.add_arrow("friction", i, contact.position, contact.friction_force, options.friction_scale, kFriction);
  markers.add_arrow("slip", i, contact.position, contact.slip_velocity, options.slip_scale, kSlip);
  if (options.roller_mesh.empty()) return;
  const RobotParameters& robot = simulation.scene().robot;
  const int standing[] = {contact.roller, contact.other_roller};
  for (int k = 0; k < 2; ++k) {
    const int id = 2 * i + k;
    if (standing[k] < 0) {
      markers.remove("rollers", id);
      continue;
    }
    Marker& roller = markers.add("rollers", id, Marker::MESH_RESOURCE, state);
    roller.mesh_resource = options.roller_mesh;
    roller.pose = pose_message(wheel_pose(robot, i, simulation.state().phi()[i]) * roller_pose(robot, i, standing[k]) *
                               Eigen::AngleAxisd(simulation.roller_angle(i, standing[k]), Eigen::Vector3d::UnitX()));
    roller.scale.x = roller.scale.y = roller.scale.z = 1.01;  // over the robot's own
  }
}

void add_legend(Markers& markers, const MarkerOptions& options) {
  const std::pair<std::string, std_msgs::ColorRGBA> lines[] = {
      {fmt::format("friction, {:.3g} N each 10 cm", 0.1 / options.friction_scale), kFriction},
      {fmt::format("slip, {:.3g} m/s each 10 cm", 0.1 / options.slip_scale), kSlip},
      {"roller on the floor", kSticks},
      {"at the limit of friction", kSlides}};
  int id = 0;
  for (const auto& [text, colour] : lines) {
    markers.add_text("legend", id, kLegendHeight - 1.1 * id * kLetter, text, colour);
    ++id;
  }
}

}  // namespace

visualization_msgs::MarkerArray contact_markers(const ContactsStamped& contacts, const Simulation& simulation,
                                                double real_time_factor, const MarkerOptions& options) {
  std_msgs::Header header = contacts.header;
  if (!options.frame.empty()) header.frame_id = options.frame;
  Markers markers(header);
  for (int i = 0; i < kWheels; ++i) add_contact(markers, i, contacts.contacts[i], simulation, options);
  markers.add_text("status", 0, kStatusHeight,
                   fmt::format("t = {:.1f} s, {:.2f} of real time, {} switches", contacts.t, real_time_factor,
                               simulation.statistics().switches),
                   kText);
  add_legend(markers, options);
  return markers.array;
}

}  // namespace youbot_base_sim
