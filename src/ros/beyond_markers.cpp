#include "youbot_base_sim/ros/beyond_markers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/load_messages.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

using Eigen::Vector3d;
using visualization_msgs::Marker;

namespace {

const std_msgs::ColorRGBA kReaction = colour(0.35, 0.75, 1), kOffFloor = colour(1, 0.45, 0.1);
const std_msgs::ColorRGBA kUphill = colour(0.95, 0.95, 0.95), kLoad = colour(0.75, 0.55, 0.3, 0.8);
const std_msgs::ColorRGBA kPush = colour(0.2, 0.95, 0.8), kText = colour(1, 1, 1);
const std_msgs::ColorRGBA kSlippery = colour(0.2, 0.5, 1, 0.65), kRough = colour(1, 0.6, 0.2, 0.5);

constexpr double kLoadDensity = 2500;                       // kg/m^3
constexpr double kMinBox = 0.02, kMaxBox = 0.5;             // m
constexpr double kStick = 0.006, kArc = 0.006;              // thickness, m
constexpr double kArcRadius = 0.12;                         // m
constexpr double kOverFloor = 1e-3;                         // m, or the floor's grid would cut through
constexpr double kUphillStart = 0.42, kUphillLength = 0.3;  // from O, m
const Vector3d kAxles{0, 0, kAxleHeight};                   // where O is in the base's frame

/// The size of a slope's angle, in degrees.
double degrees(double slope) { return std::abs(slope) * 180 / M_PI; }

bool shows_reactions(const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const AppliedLoads& applied = simulation.applied_loads();
  return beyond_the_paper(scene) || scene.robot.q != 0 || (scene.floor.f != scene.floor.f[0]).any() ||
         !applied.loads.empty() || !applied.wrenches.empty();
}

void add_reactions(Markers& markers, const ContactsStamped& contacts, double scale) {
  for (int i = 0; i < kWheels; ++i) {
    const Contact& contact = contacts.contacts[i];
    const Vector3d point(contact.position.x, contact.position.y, contact.position.z);
    markers.add_arrow("normal_reactions", i, point, {0, 0, contact.normal_force}, scale, kReaction);
    if (contact.normal_force > 0) {
      markers.remove("off_floor", i);
    } else {
      markers.add_text("off_floor", i, point + Vector3d(0, 0, 0.2), "off the floor", kOffFloor);
    }
  }
}

void add_slope(Markers& markers, const Simulation& simulation) {
  const FloorParameters& floor = simulation.scene().floor;
  if (floor.slope == 0) return;
  const double up = floor.uphill + (floor.slope < 0 ? M_PI : 0) - simulation.state().psi();
  const Vector3d direction(std::cos(up), std::sin(up), 0);
  const Vector3d on_floor(0, 0, floor_height(simulation.scene().robot) + 0.01);
  Marker& arrow = markers.add("slope", 0, Marker::ARROW, kUphill);
  arrow.points = {vector_message<geometry_msgs::Point>(on_floor + kUphillStart * direction),
                  vector_message<geometry_msgs::Point>(on_floor + (kUphillStart + kUphillLength) * direction)};
  arrow.scale.x = 0.02;
  arrow.scale.y = arrow.scale.z = 0.06;
  markers.add_text("slope", 1, on_floor + (kUphillStart + kUphillLength + 0.08) * direction + Vector3d(0, 0, 0.03),
                   fmt::format("uphill, {:.3g} deg", degrees(floor.slope)), kUphill);
}

// A corner of a patch, which fades from what lies within its soft edge to nothing outside.
struct Corner {
  double x, y, alpha;
};

void add_patch(Markers& markers, int id, const FloorPatch& patch, const FloorParameters& floor, double height,
               const std::string& frame) {
  const std_msgs::ColorRGBA& colour = patch.friction < floor.f.mean() ? kSlippery : kRough;
  const double half = patch.edge / 2, inner_x = std::min(half, (patch.x1 - patch.x0) / 2),
               inner_y = std::min(half, (patch.y1 - patch.y0) / 2);
  const std::array<Corner, 4> in = {Corner{patch.x0 + inner_x, patch.y0 + inner_y, 1},
                                    {patch.x1 - inner_x, patch.y0 + inner_y, 1},
                                    {patch.x1 - inner_x, patch.y1 - inner_y, 1},
                                    {patch.x0 + inner_x, patch.y1 - inner_y, 1}};
  const std::array<Corner, 4> out = {Corner{patch.x0 - half, patch.y0 - half, 0},
                                     {patch.x1 + half, patch.y0 - half, 0},
                                     {patch.x1 + half, patch.y1 + half, 0},
                                     {patch.x0 - half, patch.y1 + half, 0}};
  Marker& area = markers.add("patches", 2 * id, Marker::TRIANGLE_LIST, colour);
  area.header.frame_id = frame;
  area.scale.x = area.scale.y = area.scale.z = 1;
  const auto add_corner = [&](const Corner& corner) {
    area.points.push_back(vector_message<geometry_msgs::Point>({corner.x, corner.y, height}));
    area.colors.push_back(colour);
    area.colors.back().a *= static_cast<float>(corner.alpha);
  };
  const auto add_quadrangle = [&](const Corner& a, const Corner& b, const Corner& c, const Corner& d) {
    for (const Corner& corner : {a, b, c, a, c, d}) add_corner(corner);
  };
  add_quadrangle(in[0], in[1], in[2], in[3]);
  for (std::size_t k = 0; k < 4; ++k) add_quadrangle(out[k], out[(k + 1) % 4], in[(k + 1) % 4], in[k]);
  Marker& text =
      markers.add_text("patches", 2 * id + 1, {(patch.x0 + patch.x1) / 2, (patch.y0 + patch.y1) / 2, height + 0.03},
                       fmt::format("friction {:g}", patch.friction), kText);
  text.header.frame_id = frame;
}

/// An arc of three quarters about the vertical through `point`, in the sense of `torque`, and an arrow's head at its
/// end.
void add_arc(Markers& markers, int id, const Vector3d& point, double torque) {
  if (torque == 0) {
    markers.remove("wrenches", id);
    return;
  }
  constexpr int kParts = 24;
  const auto at = [&](double part) {
    const double angle = (torque > 0 ? 1 : -1) * 1.5 * M_PI * part;
    return vector_message<geometry_msgs::Point>(point + kArcRadius * Vector3d(std::cos(angle), std::sin(angle), 0));
  };
  Marker& arc = markers.add("wrenches", id, Marker::LINE_LIST, kPush);
  arc.scale.x = kArc;
  for (int k = 0; k < kParts; ++k) {
    arc.points.push_back(at(static_cast<double>(k) / kParts));
    arc.points.push_back(at(static_cast<double>(k + 1) / kParts));
  }
  const double sign = torque > 0 ? 1 : -1;
  for (const double side : {-1.0, 1.0}) {  // the arc ends at -90 deg turned by `sign`, where it goes along x
    arc.points.push_back(at(1));
    arc.points.push_back(
        vector_message<geometry_msgs::Point>(point + Vector3d(-0.03, -sign * kArcRadius + 0.02 * side, 0)));
  }
}

}  // namespace

void BeyondMarkers::add_to(Markers& markers, const ContactsStamped& contacts, const Simulation& simulation,
                           double force_scale, const std::string& world_frame) {
  if (shows_reactions(simulation)) add_reactions(markers, contacts, force_scale);
  add_slope(markers, simulation);
  const FloorParameters& floor = simulation.scene().floor;
  for (std::size_t k = 0; k < floor.patches.size() && !world_frame.empty(); ++k) {
    add_patch(markers, static_cast<int>(k), floor.patches[k], floor,
              floor_height(simulation.scene().robot) + kOverFloor * static_cast<double>(k + 1), world_frame);
  }
  add_loads(markers, simulation.applied_loads().loads);
  add_wrenches(markers, simulation, force_scale);
}

void BeyondMarkers::add_loads(Markers& markers, const std::vector<Load>& loads) {
  const int count = static_cast<int>(loads.size());
  max_loads_shown_ = std::max(max_loads_shown_, count);
  for (int k = 0; k < max_loads_shown_; ++k) {
    if (k >= count) {
      for (int part = 0; part < 3; ++part) markers.remove("loads", 3 * k + part);
      continue;
    }
    const Load& load = loads[static_cast<std::size_t>(k)];
    const Vector3d centre = load.position + kAxles;
    const double width = std::clamp(std::cbrt(load.mass / kLoadDensity), kMinBox, kMaxBox);
    Marker& box = markers.add("loads", 3 * k, Marker::CUBE, kLoad);
    box.pose.position = vector_message<geometry_msgs::Point>(centre);
    box.scale.x = box.scale.y = box.scale.z = width;
    Marker& stick = markers.add("loads", 3 * k + 1, Marker::LINE_LIST, kLoad);
    stick.scale.x = kStick;
    stick.points = {vector_message<geometry_msgs::Point>(centre),
                    vector_message<geometry_msgs::Point>({centre.x(), centre.y(), kAxleHeight})};
    markers.add_text("loads", 3 * k + 2, centre + Vector3d(0, 0, width / 2 + kLetter),
                     fmt::format("{:.4g} kg", load.mass), kText);
  }
}

void BeyondMarkers::add_wrenches(Markers& markers, const Simulation& simulation, double force_scale) {
  const std::vector<Wrench>& wrenches = simulation.applied_loads().wrenches;
  const int count = static_cast<int>(wrenches.size());
  max_wrenches_shown_ = std::max(max_wrenches_shown_, count);
  for (int k = 0; k < max_wrenches_shown_; ++k) {
    if (k >= count) {
      for (int part = 0; part < 3; ++part) markers.remove("wrenches", 3 * k + part);
      continue;
    }
    const Wrench& wrench = wrenches[static_cast<std::size_t>(k)];
    const Vector3d point = wrench.point + kAxles, force = platform_force(wrench, simulation.state().psi());
    markers.add_arrow_to("wrenches", 3 * k, point, force, force_scale, kPush);
    add_arc(markers, 3 * k + 1, point, wrench.torque);
    std::string text = force.norm() > 0 ? fmt::format("{:.4g} N", force.norm()) : "";
    if (wrench.torque != 0) text += fmt::format("{}{:.4g} N m", text.empty() ? "" : ", ", wrench.torque);
    if (text.empty()) {
      markers.remove("wrenches", 3 * k + 2);
    } else {
      const Vector3d over_start = point - way_of(force, force_scale) + Vector3d(0, 0, 1.2 * kLetter);
      markers.add_text("wrenches", 3 * k + 2, over_start, text, kPush);
    }
  }
}

std::vector<std::pair<std::string, std_msgs::ColorRGBA>> BeyondMarkers::legend(const Simulation& simulation,
                                                                               double force_scale) {
  std::vector<std::pair<std::string, std_msgs::ColorRGBA>> lines;
  if (shows_reactions(simulation)) {
    lines.emplace_back(fmt::format("normal reaction, {:.3g} N each 10 cm", 0.1 / force_scale), kReaction);
  }
  if (!simulation.applied_loads().wrenches.empty()) {
    lines.emplace_back(fmt::format("push, {:.3g} N each 10 cm", 0.1 / force_scale), kPush);
  }
  if (const double slope = simulation.scene().floor.slope; slope != 0) {
    lines.emplace_back(fmt::format("the floor slopes by {:.3g} deg, drawn level", degrees(slope)), kUphill);
  }
  return lines;
}

std::string BeyondMarkers::warning(const Simulation& simulation) {
  const auto record = simulation.reaction_record();
  if (!record || record->tipping == Side::kNone) return "";
  if (record->tipping == Side::kOff) return "LIFTED OFF THE FLOOR";
  return fmt::format("TIPPING: the wheels of the {} side bear all", name_of(record->tipping));
}

}  // namespace youbot_base_sim
