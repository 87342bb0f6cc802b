#include "youbot_base_sim/ros/view/contact_markers.h"

#include <fmt/format.h>
#include <tf2/LinearMath/Quaternion.h>
#include <tf2_geometry_msgs/tf2_geometry_msgs.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "youbot_base_sim/description/meshes.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

using Eigen::Vector3d;
using visualization_msgs::Marker;

namespace {

std_msgs::ColorRGBA colour(double r, double g, double b, double a = 1) {
  std_msgs::ColorRGBA message;
  message.r = static_cast<float>(r);
  message.g = static_cast<float>(g);
  message.b = static_cast<float>(b);
  message.a = static_cast<float>(a);
  return message;
}

const std_msgs::ColorRGBA kText = colour(1, 1, 1);
const std_msgs::ColorRGBA kFriction = colour(1, 0.85, 0.1), kSlip = colour(0.85, 0.4, 1);
const std_msgs::ColorRGBA kSticks = colour(0.1, 0.8, 0.6), kSlides = colour(1, 0.42, 0.25);
const std_msgs::ColorRGBA kLifted = colour(0.5, 0.5, 0.5);
const std_msgs::ColorRGBA kReaction = colour(0.35, 0.75, 1), kOffFloor = colour(1, 0.45, 0.1);
const std_msgs::ColorRGBA kUphill = colour(0.95, 0.95, 0.95), kLoad = colour(0.75, 0.55, 0.3, 0.8);
const std_msgs::ColorRGBA kPush = colour(0.2, 0.95, 0.8);
const std_msgs::ColorRGBA kSlippery = colour(0.2, 0.5, 1, 0.65), kRough = colour(1, 0.6, 0.2, 0.5);

constexpr double kSaturated = 0.99;                         // share of its limit from which friction is drawn as at it
constexpr double kShaft = 0.008, kHead = 0.018;             // of arrows, m
constexpr double kMinArrow = 1e-3;                          // m: a shorter one could not be seen
constexpr double kLetter = 0.035;                           // height of text, m
constexpr double kPoint = 0.014;                            // m
constexpr double kLegendHeight = 0.425;                     // of its lowest line over the base's frame, m
constexpr double kLine = 1.1 * kLetter;                     // m
constexpr int kMaxLines = 7;                                // of the legend
constexpr double kLoadDensity = 2500;                       // kg/m^3
constexpr double kMinBox = 0.02, kMaxBox = 0.5;             // m
constexpr double kStick = 0.006, kArc = 0.006;              // thickness, m
constexpr double kArcRadius = 0.12;                         // m
constexpr double kOverFloor = 1e-3;                         // m, or the floor's grid would cut through
constexpr double kUphillStart = 0.42, kUphillLength = 0.3;  // from O, m
const Vector3d kAxles{0, 0, kAxleHeight};                   // O in the base's frame

geometry_msgs::Point point(const Vector3d& position) { return vector_message<geometry_msgs::Point>(position); }

/// The arrow of a vector, `scale` m for each of its unit.
Vector3d arrow_of(const Vector3d& vector, double scale) {
  return std::min(vector.norm() * scale, kMaxArrow) * vector.stableNormalized();
}

geometry_msgs::Pose pose_message(const Eigen::Isometry3d& pose) {
  geometry_msgs::Pose message;
  message.position = point(pose.translation());
  const Eigen::Quaterniond q(pose.linear());
  message.orientation = tf2::toMsg(tf2::Quaternion(q.x(), q.y(), q.z(), q.w()));
  return message;
}

/// A marker array in the making. Markers are in the frame of `header`, with which they move, unless changed.
struct Markers {
  Marker& add(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& colour, double scale = 0) {
    Marker& marker = array.markers.emplace_back();
    marker.header = header;
    marker.ns = ns;
    marker.id = id;
    marker.type = type;
    marker.color = colour;
    marker.pose.orientation.w = 1;
    marker.scale.x = marker.scale.y = marker.scale.z = scale;
    marker.frame_locked = true;  // or they lag behind the robot where rviz is slow
    return marker;
  }

  Marker& remove(const std::string& ns, int id) {
    Marker& marker = add(ns, id, Marker::CUBE, colour(1, 1, 1));
    marker.action = Marker::DELETE;
    return marker;
  }

  /// Removes, of at most `most` things shown so far with three ids each, those after the first `count`.
  void remove_after(const std::string& ns, std::size_t count, std::size_t& most) {
    most = std::max(most, count);
    for (std::size_t id = 3 * count; id < 3 * most; ++id) remove(ns, static_cast<int>(id));
  }

  /// Removes it if it could not be seen.
  Marker& add_arrow(const std::string& ns, int id, const Vector3d& start, const Vector3d& arrow,
                    const std_msgs::ColorRGBA& colour, double thickness = 1) {
    const double length = arrow.norm();
    if (length < kMinArrow) return remove(ns, id);
    Marker& marker = add(ns, id, Marker::ARROW, colour);
    marker.points = {point(start), point(start + arrow)};
    marker.scale.x = thickness * kShaft;
    marker.scale.y = thickness * kHead;
    marker.scale.z = std::min(1.5 * thickness * kHead, length / 2);
    return marker;
  }

  /// Removes it if the text is empty.
  Marker& add_text(const std::string& ns, int id, const Vector3d& position, const std::string& text,
                   const std_msgs::ColorRGBA& colour) {
    if (text.empty()) return remove(ns, id);
    Marker& marker = add(ns, id, Marker::TEXT_VIEW_FACING, colour);
    marker.pose.position = point(position);
    marker.scale.z = kLetter;
    marker.text = text;
    return marker;
  }

  std_msgs::Header header;
  visualization_msgs::MarkerArray array = {};
};

void add_contact(Markers& markers, int i, const Contact& contact, const Simulation& simulation,
                 const MarkerOptions& options) {
  const std_msgs::ColorRGBA& state = contact.normal_force <= 0              ? kLifted
                                     : contact.friction_share >= kSaturated ? kSlides
                                                                            : kSticks;
  markers.add("contact_points", i, Marker::SPHERE, state, kPoint).pose.position = contact.position;
  const Vector3d at = vector_of(contact.position);
  markers.add_arrow("friction", i, at, arrow_of(vector_of(contact.friction_force), options.friction_scale), kFriction);
  markers.add_arrow("slip", i, at, arrow_of(vector_of(contact.slip_velocity), options.slip_scale), kSlip);
  if (options.roller_meshes[i].empty()) return;
  const RobotParameters& robot = simulation.scene().robot;
  const int standing[] = {contact.roller, contact.other_roller};
  for (int k = 0; k < 2; ++k) {
    const int id = 2 * i + k;
    if (standing[k] < 0) {
      markers.remove("rollers", id);
      continue;
    }
    Marker& roller = markers.add("rollers", id, Marker::MESH_RESOURCE, state, 1.01);  // over the robot's own
    roller.mesh_resource = options.roller_meshes[i];
    roller.pose = pose_message(wheel_pose(robot, i, simulation.state().phi()[i]) * roller_pose(robot, i, standing[k]) *
                               Eigen::AngleAxisd(simulation.roller_angle(i, standing[k]), Vector3d::UnitX()));
  }
}

bool shows_reactions(const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const AppliedLoads& applied = simulation.applied_loads();
  return beyond_the_paper(scene) || scene.robot.q != 0 || (scene.floor.f != scene.floor.f[0]).any() ||
         !applied.loads.empty() || !applied.wrenches.empty();
}

void add_reaction(Markers& markers, int i, const Contact& contact, double scale) {
  const Vector3d at = vector_of(contact.position);
  markers.add_arrow("normal_reactions", i, at, arrow_of({0, 0, contact.normal_force}, scale), kReaction);
  markers.add_text("off_floor", i, at + Vector3d(0, 0, 0.2), contact.normal_force > 0 ? "" : "off the floor",
                   kOffFloor);
}

void add_slope(Markers& markers, const Simulation& simulation) {
  const FloorParameters& floor = simulation.scene().floor;
  if (floor.slope == 0) return;
  const double up = floor.uphill + (floor.slope < 0 ? M_PI : 0) - simulation.state().psi();
  const Vector3d direction(std::cos(up), std::sin(up), 0);
  const Vector3d on_floor(0, 0, floor_height(simulation.scene().robot) + 0.01);
  Marker& arrow = markers.add("slope", 0, Marker::ARROW, kUphill, 0.06);
  arrow.points = {point(on_floor + kUphillStart * direction),
                  point(on_floor + (kUphillStart + kUphillLength) * direction)};
  arrow.scale.x = 0.02;
  markers.add_text("slope", 1, on_floor + (kUphillStart + kUphillLength + 0.08) * direction + Vector3d(0, 0, 0.03),
                   fmt::format("uphill, {:.3g} deg", std::abs(floor.slope) * 180 / M_PI), kUphill);
}

/// The patch, to the middle of its soft edge.
void add_patch(Markers& markers, int id, const FloorPatch& patch, const FloorParameters& floor, double height,
               const std::string& frame) {
  const Vector3d middle((patch.x0 + patch.x1) / 2, (patch.y0 + patch.y1) / 2, height);
  Marker& area =
      markers.add("patches", 2 * id, Marker::CUBE, patch.friction < floor.f.mean() ? kSlippery : kRough, 1e-4);
  area.header.frame_id = frame;
  area.pose.position = point(middle);
  area.scale.x = patch.x1 - patch.x0;
  area.scale.y = patch.y1 - patch.y0;
  const std::string text = fmt::format("friction {:g}", patch.friction);
  markers.add_text("patches", 2 * id + 1, middle + Vector3d(0, 0, 0.03), text, kText).header.frame_id = frame;
}

void add_load(Markers& markers, int k, const Load& load) {
  const Vector3d centre = load.position + kAxles;
  const double width = std::clamp(std::cbrt(load.mass / kLoadDensity), kMinBox, kMaxBox);
  markers.add("loads", 3 * k, Marker::CUBE, kLoad, width).pose.position = point(centre);
  Marker& stick = markers.add("loads", 3 * k + 1, Marker::LINE_LIST, kLoad);
  stick.scale.x = kStick;
  stick.points = {point(centre), point({centre.x(), centre.y(), kAxleHeight})};
  markers.add_text("loads", 3 * k + 2, centre + Vector3d(0, 0, width / 2 + kLetter),
                   fmt::format("{:.4g} kg", load.mass), kText);
}

/// Three quarters of a circle about the vertical through `centre`, in the sense of `torque`, with an arrow's head.
void add_arc(Markers& markers, int id, const Vector3d& centre, double torque) {
  if (torque == 0) {
    markers.remove("wrenches", id);
    return;
  }
  constexpr int kParts = 24;
  const double sign = torque > 0 ? 1 : -1;
  const auto at = [&](int part) {
    const double angle = sign * 1.5 * M_PI * (static_cast<double>(part) / kParts);
    return point(centre + kArcRadius * Vector3d(std::cos(angle), std::sin(angle), 0));
  };
  Marker& arc = markers.add("wrenches", id, Marker::LINE_STRIP, kPush);
  arc.scale.x = kArc;
  for (int k = 0; k < kParts; ++k) arc.points.push_back(at(k));
  for (const double side : {-1.0, 1.0}) {  // the arc ends at -90 deg turned by `sign`, where it goes along x
    arc.points.push_back(at(kParts));
    arc.points.push_back(point(centre + Vector3d(-0.03, -sign * kArcRadius + 0.02 * side, 0)));
  }
}

void add_wrench(Markers& markers, int k, const Wrench& wrench, double psi, double force_scale) {
  const Vector3d end = wrench.point + kAxles, force = platform_force(wrench, psi), arrow = arrow_of(force, force_scale);
  markers.add_arrow("wrenches", 3 * k, end - arrow, arrow, kPush, 2);
  add_arc(markers, 3 * k + 1, end, wrench.torque);
  std::string text = force.norm() > 0 ? fmt::format("{:.4g} N", force.norm()) : "";
  if (wrench.torque != 0) text += fmt::format("{}{:.4g} N m", text.empty() ? "" : ", ", wrench.torque);
  markers.add_text("wrenches", 3 * k + 2, end - arrow + Vector3d(0, 0, 1.2 * kLetter), text, kPush);
}

/// Says that the base tips or is off the floor; else empty.
std::string warning(const Simulation& simulation) {
  const auto record = simulation.reaction_record();
  if (!record || record->tipping == Side::kNone) return "";
  if (record->tipping == Side::kOff) return "LIFTED OFF THE FLOOR";
  return fmt::format("TIPPING: the wheels of the {} side carry all", name_of(record->tipping));
}

/// The legend, from its lowest line upwards, and the status above it.
void add_legend(Markers& markers, const Simulation& simulation, const MarkerOptions& options,
                const std::string& status) {
  const std::string of_force = fmt::format("{:.3g} cm each 10 N", 1e3 * options.friction_scale);
  std::vector<std::pair<std::string, std_msgs::ColorRGBA>> lines = {
      {"friction, " + of_force, kFriction},
      {fmt::format("slip, {:.3g} cm each cm/s", options.slip_scale), kSlip},
      {"roller on the floor", kSticks},
      {"at the limit of friction", kSlides}};
  if (shows_reactions(simulation)) lines.emplace_back("normal reaction, " + of_force, kReaction);
  if (!simulation.applied_loads().wrenches.empty()) lines.emplace_back("push, " + of_force, kPush);
  if (const double slope = std::abs(simulation.scene().floor.slope) * 180 / M_PI; slope != 0) {
    lines.emplace_back(fmt::format("the floor slopes by {:.3g} deg, drawn level", slope), kUphill);
  }
  double height = kLegendHeight + kLine * static_cast<double>(lines.size());
  markers.add_text("status", 0, {0, 0, height + 0.6 * kLine}, status, kText);
  markers.add_text("status", 1, {0, 0, height + 1.6 * kLine}, warning(simulation), kSlides);
  int id = 0;
  for (const auto& [text, colour] : lines) markers.add_text("legend", id++, {0, 0, height -= kLine}, text, colour);
  while (id < kMaxLines) markers.remove("legend", id++);
}

}  // namespace

MarkerOptions marker_options(const RobotParameters& robot, bool has_world, const FrameNames& frames) {
  MarkerOptions options;
  if (has_world) {
    options.frame = frames.truth;
    options.world_frame = frames.world;
  }
  for (int i = 0; i < kWheels; ++i) {
    const RobotParameters drawn = with_rollers_at(robot.roller_angle[i], robot);
    const std::string mesh = mesh_name(Part::kRoller, drawn);
    if (in_package(Part::kRoller, drawn)) {
      options.roller_meshes[i] = kPackageMeshes + mesh;
    } else if (std::filesystem::exists(mesh_cache() / mesh)) {  // where describe_base has been asked for this robot
      options.roller_meshes[i] = file_uri(mesh_cache() / mesh);
    }
  }
  return options;
}

visualization_msgs::MarkerArray ContactMarkers::at(const ContactsStamped& contacts, const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const auto& [loads, wrenches] = simulation.applied_loads();
  Markers markers{contacts.header};
  if (!options_.frame.empty()) markers.header.frame_id = options_.frame;
  for (int i = 0; i < kWheels; ++i) add_contact(markers, i, contacts.contacts[i], simulation, options_);
  for (int i = 0; i < kWheels && shows_reactions(simulation); ++i) {
    add_reaction(markers, i, contacts.contacts[i], options_.friction_scale);
  }
  add_slope(markers, simulation);
  int patch_id = 0, load_id = 0, wrench_id = 0;
  for (const FloorPatch& patch : scene.floor.patches) {
    if (options_.world_frame.empty()) break;
    const double height = floor_height(scene.robot) + kOverFloor * (patch_id + 1);
    add_patch(markers, patch_id++, patch, scene.floor, height, options_.world_frame);
  }
  for (const Load& load : loads) add_load(markers, load_id++, load);
  markers.remove_after("loads", loads.size(), most_loads_);
  for (const Wrench& wrench : wrenches) {
    add_wrench(markers, wrench_id++, wrench, simulation.state().psi(), options_.friction_scale);
  }
  markers.remove_after("wrenches", wrenches.size(), most_wrenches_);
  add_legend(markers, simulation, options_,
             fmt::format("t = {:.1f} s, {} switches", contacts.t, simulation.statistics().switches));
  return markers.array;
}

}  // namespace youbot_base_sim
