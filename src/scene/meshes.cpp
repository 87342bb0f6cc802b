#include "youbot_base_sim/scene/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mesh.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

namespace {

using Eigen::Vector3d;

constexpr int kRings = 29;       // of a roller: its chords are within 0.01 mm
constexpr int kSides = 40;       // of a roller: within 0.05 mm
constexpr int kStripeSides = 4;  // of those, in each of two stripes
constexpr int kSidesOfArm = 16;  // of a plate's outline, for each roller
constexpr int kSidesOfHub = 48;
constexpr int kSidesOfCorner = 6;  // of the body, a quarter turn

/// The circle on a roller that touches the floor at some wheel angle, and its outward normals.
struct Circle {
  double position;  // along the roller's axis from its middle, m
  double radius;    // m
  double slope;     // the part of a normal that is along the axis
};

/// At the wheel angle phi~ from where the roller points straight down. The contact point lies r below the roller's axis
/// at R_d tan(phi~) / cos(delta) from its middle (paper, section 3). The axis is inclined to the floor, and the
/// circle's plane to the vertical, by an angle whose sine is sin(phi~) cos(delta).
Circle contact_circle(const RobotParameters& robot, double phi_tilde) {
  const double r = robot.R - robot.R_d / std::cos(phi_tilde);
  const double slope = std::sin(phi_tilde) * kCosDelta;
  return {robot.R_d * std::tan(phi_tilde) / kCosDelta + r * slope, r * std::sqrt(1 - slope * slope), slope};
}

/// A share of a roller's surface, from one of its sides to another.
void add_roller(Mesh& mesh, const RobotParameters& robot, int from, int to) {
  const double edge = Dimensions(robot).roller_edge;
  const auto radial = [&](int column) {
    const double theta = 2 * M_PI * (from + column) / kSides;
    return Vector3d{0, std::cos(theta), std::sin(theta)};
  };
  mesh.add_sheet(kRings, to - from + 1, [&](int row, int column) {
    const Circle circle = contact_circle(robot, edge * (2.0 * row / (kRings - 1) - 1));
    const Vector3d out = radial(column);
    return Mesh::Vertex{circle.position * Vector3d::UnitX() + circle.radius * out,
                        circle.slope * Vector3d::UnitX() + std::sqrt(1 - circle.slope * circle.slope) * out};
  });
  for (const int end : {1, -1}) {
    const Circle circle = contact_circle(robot, end * edge);
    mesh.add_sheet(2, to - from + 1, [&](int row, int column) {
      return Mesh::Vertex{circle.position * Vector3d::UnitX() + row * circle.radius * radial(column),
                          end * Vector3d::UnitX()};
    });
  }
}

/// A disc about the axle: `radius(angle)` is its outline, and angles count from straight down as the wheel's does.
template <class Radius>
void add_disc(Mesh& mesh, double y, double thickness, int sides, const Radius& radius) {
  const auto out = [&](double angle) { return Vector3d{std::sin(angle), 0, -std::cos(angle)}; };
  const auto rim = [&](int column) -> Vector3d {
    return radius(2 * M_PI * column / sides) * out(2 * M_PI * column / sides);
  };
  for (const int face : {1, -1}) {
    mesh.add_sheet(2, sides + 1, [&](int row, int column) {
      return Mesh::Vertex{row * rim(column) + (y + face * thickness / 2) * Vector3d::UnitY(), face * Vector3d::UnitY()};
    });
  }
  mesh.add_sheet(2, sides + 1, [&](int row, int column) {
    const Vector3d along = rim(column + 1) - rim(column - 1);
    return Mesh::Vertex{rim(column) + (y + (row - 0.5) * thickness) * Vector3d::UnitY(),
                        Vector3d::UnitY().cross(along).normalized()};
  });
}

/// Hub and side plates. An arm of each plate holds the pin of each roller.
void add_wheel(Mesh& mesh, const RobotParameters& robot, double tan_delta) {
  const Dimensions size(robot);
  add_disc(mesh, 0, 2 * size.half_width, kSidesOfHub, [&](double) { return size.hub_radius; });
  const double tip = std::min(std::hypot(robot.R_d, size.rim_y) + 1.5 * size.pin_radius, 0.99 * robot.R);
  const double valley = std::min(1.2 * size.hub_radius, 0.9 * tip);
  for (const int side : {1, -1}) {
    const double y = side * size.rim_y;
    const double pin = std::atan2(y / tan_delta, robot.R_d);
    add_disc(mesh, y, size.rim_thickness, kSidesOfArm * robot.rollers, [&](double angle) {
      const double on_arm = (1 + std::cos(robot.rollers * (angle - pin))) / 2;
      return valley + (tip - valley) * on_arm * on_arm;
    });
  }
}

/// A box about the origin with rounded edges.
void add_rounded_box(Mesh& mesh, const Vector3d& size, double corner, double fillet) {
  constexpr int kColumns = 4 * (kSidesOfCorner + 1) + 1;
  const auto normal = [](int column) {
    const int quarter = column / (kSidesOfCorner + 1), step = column % (kSidesOfCorner + 1);
    const double angle = M_PI_2 * (quarter + static_cast<double>(step) / kSidesOfCorner);
    return Vector3d{std::cos(angle), std::sin(angle), 0};
  };
  const auto outline = [&](int column) -> Vector3d {
    const int quarter = column / (kSidesOfCorner + 1) % 4;
    const double x = quarter == 0 || quarter == 3 ? 1 : -1, y = quarter < 2 ? 1 : -1;
    return Vector3d(x * (size.x() / 2 - corner), y * (size.y() / 2 - corner), 0) + corner * normal(column);
  };
  // Rows from the middle of the underside, around both fillets, to the middle of the top.
  mesh.add_sheet(2 * kSidesOfCorner + 4, kColumns, [&](int row, int column) {
    const bool over = row > kSidesOfCorner + 1;
    if (row == 0 || row == 2 * kSidesOfCorner + 3) {
      return Mesh::Vertex{{0, 0, (over ? 0.5 : -0.5) * size.z()}, (over ? 1 : -1) * Vector3d::UnitZ()};
    }
    const double tilt = M_PI_2 * ((row - 1 - (over ? 1 : 0)) / static_cast<double>(kSidesOfCorner) - 1);
    const Vector3d out = std::cos(tilt) * normal(column) + std::sin(tilt) * Vector3d::UnitZ();
    const double height = (over ? 1 : -1) * (size.z() / 2 - fillet);
    return Mesh::Vertex{outline(column) + fillet * (out - normal(column)) + height * Vector3d::UnitZ(), out};
  });
}

}  // namespace

Dimensions::Dimensions(const RobotParameters& robot) {
  roller_edge = std::min(M_PI / robot.rollers, 0.95 * std::acos(robot.R_d / robot.R));
  const Circle end = contact_circle(robot, roller_edge);
  rim_y = (end.position + end.radius) * kCosDelta + 0.1 * end.radius;
  rim_thickness = 0.05 * robot.R;
  half_width = rim_y + rim_thickness / 2;
  hub_radius = std::max(2.1 * robot.R_d - 1.1 * robot.R, 0.2 * robot.R_d);
  pin_radius = 0.3 * end.radius;

  const double bottom = kAxleHeight - 0.3 * robot.R;
  top = kAxleHeight + 1.7 * robot.R;
  hull = {2 * (robot.h + 0.85 * robot.R), 2 * std::max(robot.l - half_width - 0.05 * robot.R, 0.1 * robot.l),
          top - bottom};
  flanks = {2 * std::max(robot.h - 1.15 * robot.R, 0.1 * robot.h), 2 * robot.l, 0.8 * hull.z()};
  middle = (top + bottom) / 2;
}

std::string mesh_name(Part part, const RobotParameters& robot) {
  const std::string wheel = fmt::format("R{}_Rd{}_n{}", robot.R, robot.R_d, robot.rollers);
  const std::string base = fmt::format("{}_h{}_l{}", wheel, robot.h, robot.l);
  switch (part) {
    case Part::kRoller:
      return "roller_" + wheel + ".obj";
    case Part::kRollerStripe:
      return "roller_stripe_" + wheel + ".obj";
    case Part::kWheelLeft:
      return "wheel_left_" + wheel + ".obj";
    case Part::kWheelRight:
      return "wheel_right_" + wheel + ".obj";
    case Part::kHull:
      return "hull_" + base + ".obj";
    case Part::kFlanks:
      return "flanks_" + base + ".obj";
  }
  return "";
}

std::string mesh(Part part, const RobotParameters& robot) {
  const Dimensions size(robot);
  const double corner = 0.2 * size.hull.y();
  Mesh mesh;
  switch (part) {
    case Part::kRoller:
      add_roller(mesh, robot, kStripeSides, kSides / 2);
      add_roller(mesh, robot, kSides / 2 + kStripeSides, kSides);
      break;
    case Part::kRollerStripe:
      add_roller(mesh, robot, 0, kStripeSides);
      add_roller(mesh, robot, kSides / 2, kSides / 2 + kStripeSides);
      break;
    case Part::kWheelLeft:
      add_wheel(mesh, robot, tan_delta()[0]);
      break;
    case Part::kWheelRight:
      add_wheel(mesh, robot, tan_delta()[1]);
      break;
    case Part::kHull:
      add_rounded_box(mesh, size.hull, corner, 0.15 * size.hull.z());
      break;
    case Part::kFlanks:
      add_rounded_box(mesh, size.flanks, std::min(0.1 * size.flanks.x(), 0.1 * size.flanks.y()),
                      0.05 * size.flanks.z());
      break;
  }
  return mesh.obj();
}

bool in_package(Part part, const RobotParameters& robot) {
  return mesh_name(part, robot) == mesh_name(part, RobotParameters());
}

}  // namespace youbot_base_sim
