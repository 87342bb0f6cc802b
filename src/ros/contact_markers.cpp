#include "youbot_base_sim/ros/contact_markers.h"

#include <fmt/format.h>

#include <filesystem>

#include "youbot_base_sim/description/meshes.h"
#include "youbot_base_sim/ros/node_constants.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

using visualization_msgs::Marker;

namespace {

const std_msgs::ColorRGBA kFriction = colour(1, 0.85, 0.1), kSlip = colour(0.85, 0.4, 1);
const std_msgs::ColorRGBA kSticks = colour(0.2, 0.8, 0.3), kSlides = colour(0.95, 0.15, 0.1);
const std_msgs::ColorRGBA kLifted = colour(0.5, 0.5, 0.5), kText = colour(1, 1, 1);

constexpr double kPoint = 0.014;         // m
constexpr double kLegendHeight = 0.425;  // of its lowest line over the base's frame, m
constexpr double kLine = 1.1 * kLetter;  // m
constexpr int kMaxLines = 7;             // of the legend

Eigen::Vector3d vector(const geometry_msgs::Vector3& message) { return {message.x, message.y, message.z}; }

void add_contact(Markers& markers, int i, const Contact& contact, const Simulation& simulation,
                 const MarkerOptions& options) {
  const std_msgs::ColorRGBA& state = contact.normal_force <= 0              ? kLifted
                                     : contact.friction_share >= kSaturated ? kSlides
                                                                            : kSticks;
  const Eigen::Vector3d at(contact.position.x, contact.position.y, contact.position.z);
  Marker& point = markers.add("contact_points", i, Marker::SPHERE, state);
  point.pose.position = contact.position;
  point.scale.x = point.scale.y = point.scale.z = kPoint;
  markers.add_arrow("friction", i, at, vector(contact.friction_force), options.friction_scale, kFriction);
  markers.add_arrow("slip", i, at, vector(contact.slip_velocity), options.slip_scale, kSlip);
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

/// From its lowest line upwards, and the status above it.
void add_legend(Markers& markers, const Simulation& simulation, const MarkerOptions& options,
                const std::string& status) {
  std::vector<std::pair<std::string, std_msgs::ColorRGBA>> lines =
      BeyondMarkers::legend(simulation, options.friction_scale);
  lines.insert(lines.begin(), {{fmt::format("friction, {:.3g} N each 10 cm", 0.1 / options.friction_scale), kFriction},
                               {fmt::format("slip, {:.3g} m/s each 10 cm", 0.1 / options.slip_scale), kSlip},
                               {"roller on the floor", kSticks},
                               {"at the limit of friction", kSlides}});
  double height = kLegendHeight + kLine * static_cast<double>(lines.size());
  const std::string warning = BeyondMarkers::warning(simulation);
  markers.add_text("status", 0, {0, 0, height + 0.6 * kLine}, status, kText);
  if (warning.empty()) {
    markers.remove("status", 1);
  } else {
    markers.add_text("status", 1, {0, 0, height + 1.6 * kLine}, warning, kSlides);
  }
  int id = 0;
  for (const auto& [text, colour] : lines) markers.add_text("legend", id++, {0, 0, height -= kLine}, text, colour);
  while (id < kMaxLines) markers.remove("legend", id++);
}

}  // namespace

MarkerOptions marker_options(const RobotParameters& robot, bool has_world) {
  MarkerOptions options;
  if (has_world) {
    options.frame = kTruthFrame;
    options.world_frame = kWorldFrame;
  }
  const std::string mesh = mesh_name(Part::kRoller, robot);
  if (in_package(Part::kRoller, robot)) {
    options.roller_mesh = kPackageMeshes + mesh;
  } else if (std::filesystem::exists(mesh_cache() / mesh)) {  // where describe_base has been asked for this robot
    options.roller_mesh = file_uri(mesh_cache() / mesh);
  }
  return options;
}

visualization_msgs::MarkerArray ContactMarkers::at(const ContactsStamped& contacts, const Simulation& simulation,
                                                   std::optional<double> real_time_factor) {
  std_msgs::Header header = contacts.header;
  if (!options_.frame.empty()) header.frame_id = options_.frame;
  Markers markers(header);
  for (int i = 0; i < kWheels; ++i) add_contact(markers, i, contacts.contacts[i], simulation, options_);
  beyond_.add_to(markers, contacts, simulation, options_.friction_scale, options_.world_frame);
  const std::string rate = real_time_factor ? fmt::format("{:.2f} of real time, ", *real_time_factor) : "";
  add_legend(markers, simulation, options_,
             fmt::format("t = {:.1f} s, {}{} switches", contacts.t, rate, simulation.statistics().switches));
  return markers.array;
}

}  // namespace youbot_base_sim
