#include "youbot_base_sim/description/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <map>
#include <vector>

#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {

namespace {

using Eigen::Vector3d;

/// Red, green, blue, 0 .. 1.
using Colour = std::array<double, 3>;

constexpr Colour kRubber = {0.16, 0.16, 0.18}, kStripe = {0.75, 0.75, 0.72}, kMetal = {0.72, 0.74, 0.78},
                 kDark = {0.1, 0.1, 0.11}, kOrange = {0.95, 0.36, 0.03}, kPlate = {0.85, 0.86, 0.88};

/// Lengths below a nanometre are rounding errors.
double rounded(double x) { return std::abs(x) < 1e-9 ? 0.0 : x; }

/// A list of vectors, to six digits: a thousandth of a millimetre on a robot of a metre.
std::string source(const char* id, const std::vector<Vector3d>& vectors) {
  std::string numbers;
  for (const Vector3d& v : vectors) {
    numbers += fmt::format("{:.6g} {:.6g} {:.6g}\n", rounded(v.x()), rounded(v.y()), rounded(v.z()));
  }
  return fmt::format(
      "<source id=\"{0}\"><float_array id=\"{0}_array\" count=\"{1}\">\n{2}"
      "</float_array><technique_common><accessor source=\"#{0}_array\" count=\"{3}\" stride=\"3\">"
      "<param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/>"
      "</accessor></technique_common></source>\n",
      id, 3 * vectors.size(), numbers, vectors.size());
}

std::string effect(int k, const Colour& colour) {
  return fmt::format(
      "<effect id=\"effect_{}\"><profile_COMMON><technique sid=\"common\"><phong>"
      "<ambient><color>{:g} {:g} {:g} 1</color></ambient><diffuse><color>{:g} {:g} {:g} 1</color></diffuse>"
      "<specular><color>0.2 0.2 0.2 1</color></specular><shininess><float>20</float></shininess>"
      "</phong></technique></profile_COMMON></effect>\n",
      k, 0.6 * colour[0], 0.6 * colour[1], 0.6 * colour[2], colour[0], colour[1], colour[2]);
}

/// A painted surface of quadrilaterals, with a normal at each vertex for smooth shading.
class Mesh {
 public:
  struct Vertex {
    Vector3d position;  ///< m
    Vector3d normal;    ///< of length 1, outward
  };

  /// Adds a sheet of rows x columns vertices, vertex(row, column). Rows or columns may coincide, as in a disc's middle.
  template <class MakeVertex>
  void add_sheet(const Colour& colour, int rows, int columns, const MakeVertex& vertex) {
    const int first = static_cast<int>(positions_.size());
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const auto [position, normal] = vertex(row, column);
        positions_.push_back(position);
        normals_.push_back(normal);
      }
    }
    for (int row = 0; row + 1 < rows; ++row) {
      for (int column = 0; column + 1 < columns; ++column) {
        const int corner = first + row * columns + column;
        add_face(colour, {corner, corner + 1, corner + columns + 1, corner + columns});
      }
    }
  }

  /// The text of its COLLADA file.
  std::string collada() const {
    std::string effects, materials, triangles, bindings;
    int k = 0;
    for (const auto& [colour, faces] : triangles_) {
      effects += effect(k, colour);
      materials += fmt::format("<material id=\"material_{0}\"><instance_effect url=\"#effect_{0}\"/></material>\n", k);
      bindings += fmt::format("<instance_material symbol=\"paint_{0}\" target=\"#material_{0}\"/>", k);
      triangles += fmt::format(
          "<triangles material=\"paint_{}\" count=\"{}\"><input semantic=\"VERTEX\" source=\"#vertices\" offset=\"0\"/>"
          "<input semantic=\"NORMAL\" source=\"#normals\" offset=\"0\"/><p>\n",
          k++, faces.size());
      for (const auto& [a, b, c] : faces) triangles += fmt::format("{} {} {}\n", a, b, c);
      triangles += "</p></triangles>\n";
    }
    return "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
           "<!-- Written by describe_base. -->\n"
           "<COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n"
           "<asset><unit name=\"meter\" meter=\"1\"/><up_axis>Z_UP</up_axis></asset>\n"
           "<library_effects>\n" +
           effects + "</library_effects>\n<library_materials>\n" + materials +
           "</library_materials>\n<library_geometries><geometry id=\"mesh\"><mesh>\n" +
           source("positions", positions_) + source("normals", normals_) +
           "<vertices id=\"vertices\"><input semantic=\"POSITION\" source=\"#positions\"/></vertices>\n" + triangles +
           "</mesh></geometry></library_geometries>\n"
           "<library_visual_scenes><visual_scene id=\"scene\"><node><instance_geometry url=\"#mesh\"><bind_material>"
           "<technique_common>" +
           bindings +
           "</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>\n"
           "<scene><instance_visual_scene url=\"#scene\"/></scene>\n</COLLADA>\n";
  }

 private:
  /// Turns the face so that its corners run counter-clockwise, seen from outside.
  void add_face(const Colour& colour, std::array<int, 4> face) {
    const auto [a, b, c, d] = face;
    const Vector3d turn = (positions_[c] - positions_[a]).cross(positions_[d] - positions_[b]);
    if (turn.dot(normals_[a] + normals_[b] + normals_[c] + normals_[d]) < 0) std::reverse(face.begin(), face.end());
    add_triangle(colour, {face[0], face[1], face[2]});
    add_triangle(colour, {face[0], face[2], face[3]});
  }

  void add_triangle(const Colour& colour, const std::array<int, 3>& triangle) {
    const auto [a, b, c] = triangle;
    if (positions_[a] == positions_[b] || positions_[b] == positions_[c] || positions_[c] == positions_[a]) return;
    triangles_[colour].push_back(triangle);
  }

  std::vector<Vector3d> positions_, normals_;
  std::map<Colour, std::vector<std::array<int, 3>>> triangles_;  // numbers of their vertices
};

constexpr int kRings = 29;       // of a roller: its chords are within 0.01 mm
constexpr int kSides = 40;       // of a roller: within 0.05 mm
constexpr int kStripeSides = 4;  // of those, in each of two stripes
constexpr int kSidesOfArm = 16;  // of a plate's outline, for each roller
constexpr int kSidesOfHub = 48;

/// The circle on a roller that touches the floor at some wheel angle, and its outward normals.
struct Circle {
  double position;  // along the roller's axis from its middle, m
  double radius;    // m
  double slope;     // the part of a normal that is along the axis
};

/// At the wheel angle phi~ from where the roller points straight down. The contact point lies r below the roller's axis
/// at R_d tan(phi~) / cos(delta) from its middle (paper, section 3). sin(phi~) cos(delta) is the sine of the axis's
/// inclination to the floor, and of the circle's plane to the vertical.
Circle contact_circle(const RobotParameters& robot, double phi_tilde) {
  const double r = robot.R - robot.R_d / std::cos(phi_tilde);
  const double cos_delta = robot.cos_delta()[0], slope = std::sin(phi_tilde) * cos_delta;
  return {robot.R_d * std::tan(phi_tilde) / cos_delta + r * slope, r * std::sqrt(1 - slope * slope), slope};
}

/// A share of a roller's surface, from one of its sides to another.
void add_roller(Mesh& mesh, const Colour& colour, const RobotParameters& robot, int from, int to) {
  const double edge = Dimensions(robot).roller_edge;
  const auto radial = [&](int column) {
    const double theta = 2 * M_PI * (from + column) / kSides;
    return Vector3d{0, std::cos(theta), std::sin(theta)};
  };
  mesh.add_sheet(colour, kRings, to - from + 1, [&](int row, int column) {
    const Circle circle = contact_circle(robot, edge * (2.0 * row / (kRings - 1) - 1));
    const Vector3d out = radial(column);
    return Mesh::Vertex{circle.position * Vector3d::UnitX() + circle.radius * out,
                        circle.slope * Vector3d::UnitX() + std::sqrt(1 - circle.slope * circle.slope) * out};
  });
  for (const int end : {1, -1}) {
    const Circle circle = contact_circle(robot, end * edge);
    mesh.add_sheet(colour, 2, to - from + 1, [&](int row, int column) {
      return Mesh::Vertex{circle.position * Vector3d::UnitX() + row * circle.radius * radial(column),
                          end * Vector3d::UnitX()};
    });
  }
}

/// A disc about the axle: `radius(angle)` is its outline, and angles count from straight down as the wheel's does.
template <class Radius>
void add_disc(Mesh& mesh, const Colour& colour, double y, double thickness, int sides, const Radius& radius) {
  const auto rim = [&](int column) -> Vector3d {
    const double angle = 2 * M_PI * column / sides;
    return radius(angle) * Vector3d{std::sin(angle), 0, -std::cos(angle)};
  };
  for (const int face : {1, -1}) {
    mesh.add_sheet(colour, 2, sides + 1, [&](int row, int column) {
      return Mesh::Vertex{row * rim(column) + (y + face * thickness / 2) * Vector3d::UnitY(), face * Vector3d::UnitY()};
    });
  }
  mesh.add_sheet(colour, 2, sides + 1, [&](int row, int column) {
    const Vector3d along = rim(column + 1) - rim(column - 1);
    return Mesh::Vertex{rim(column) + (y + (row - 0.5) * thickness) * Vector3d::UnitY(),
                        Vector3d::UnitY().cross(along).normalized()};
  });
}

/// Hub and side plates. An arm of each plate holds the pin of each roller.
void add_wheel(Mesh& mesh, const RobotParameters& robot, double tan_delta) {
  const Dimensions size(robot);
  add_disc(mesh, kMetal, 0, 2 * size.half_width, kSidesOfHub, [&](double) { return size.hub_radius; });
  add_disc(mesh, kDark, 0, 2.05 * size.half_width, kSidesOfHub, [&](double) { return 0.6 * size.hub_radius; });
  const double tip = std::min(std::hypot(robot.R_d, size.rim_y) + 1.5 * size.pin_radius, 0.99 * robot.R);
  const double valley = std::min(1.2 * size.hub_radius, 0.9 * tip);
  for (const int side : {1, -1}) {
    const double y = side * size.rim_y;
    const double pin = std::atan2(y / tan_delta, robot.R_d);
    add_disc(mesh, kMetal, y, size.rim_thickness, kSidesOfArm * robot.rollers, [&](double angle) {
      const double on_arm = (1 + std::cos(robot.rollers * (angle - pin))) / 2;
      return valley + (tip - valley) * on_arm * on_arm;
    });
  }
}

void add_box(Mesh& mesh, const Colour& colour, const Vector3d& centre, const Vector3d& size) {
  for (int face = 0; face < 6; ++face) {
    const Vector3d normal = (face < 3 ? 1 : -1) * Vector3d::Unit(face % 3);
    const Vector3d along = Vector3d::Unit((face + 1) % 3), across = Vector3d::Unit((face + 2) % 3);
    mesh.add_sheet(colour, 2, 2, [&](int row, int column) {
      const Vector3d corner = normal + (2 * row - 1) * along + (2 * column - 1) * across;
      return Mesh::Vertex{centre + size.cwiseProduct(corner) / 2, normal};
    });
  }
}

/// A strip of the deck from one point of it to another.
void add_strip(Mesh& mesh, const Vector3d& from, const Vector3d& to, double width) {
  const Vector3d across = width / 2 * Vector3d::UnitZ().cross((to - from).normalized());
  mesh.add_sheet(kDark, 2, 2, [&](int row, int column) {
    return Mesh::Vertex{(row == 0 ? from : to) + (column == 0 ? across : Vector3d(-across)), Vector3d::UnitZ()};
  });
}

/// The body, and on it a plate to load, on which a chevron points to the front.
void add_body(Mesh& mesh, const RobotParameters& robot) {
  const Dimensions size(robot);
  const double thickness = 0.08 * robot.R;
  const Vector3d middle{0, 0, size.middle}, plate{0.75 * size.hull.x(), 0.7 * size.hull.y(), thickness};
  add_box(mesh, kOrange, middle, size.hull);
  add_box(mesh, kDark, middle, size.flanks);
  add_box(mesh, kPlate, {0, 0, size.top}, plate);
  const double arm = 0.25 * std::min(plate.x(), plate.y());
  const Vector3d tip{0.42 * plate.x(), 0, size.top + 0.51 * thickness};
  for (const int side : {1, -1}) add_strip(mesh, tip, tip + Vector3d(-arm, side * arm, 0), 0.3 * arm);
}

}  // namespace

Dimensions::Dimensions(const RobotParameters& robot) {
  roller_edge = std::min(M_PI / robot.rollers, 0.95 * std::acos(robot.R_d / robot.R));
  const Circle end = contact_circle(robot, roller_edge);
  rim_y = end.position * robot.sin_delta().abs()[0] + end.radius * (robot.cos_delta()[0] + 0.1);
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
  constexpr std::array<const char*, std::size(kParts)> kNames = {"roller", "wheel_left", "wheel_right", "body"};
  const std::string body = part == Part::kBody ? fmt::format("_h{}_l{}", robot.h, robot.l) : "";
  const std::string rollers = robot.roller_angle[0] == 45 ? "" : fmt::format("_a{}", robot.roller_angle[0]);
  return fmt::format("{}_R{}_Rd{}_n{}{}{}.dae", kNames[static_cast<std::size_t>(part)], robot.R, robot.R_d,
                     robot.rollers, rollers, body);
}

std::string mesh(Part part, const RobotParameters& robot) {
  Mesh mesh;
  if (part == Part::kWheelLeft || part == Part::kWheelRight) {
    add_wheel(mesh, robot, robot.tan_delta()[part == Part::kWheelLeft ? 0 : 1]);
  } else if (part == Part::kBody) {
    add_body(mesh, robot);
  } else {
    for (const int side : {0, kSides / 2}) {
      add_roller(mesh, kStripe, robot, side, side + kStripeSides);
      add_roller(mesh, kRubber, robot, side + kStripeSides, side + kSides / 2);
    }
  }
  return mesh.collada();
}

std::filesystem::path mesh_cache() {
  if (const char* ros_home = std::getenv("ROS_HOME")) return std::filesystem::path(ros_home) / "youbot_base_sim";
  const char* home = std::getenv("HOME");
  return home && *home ? std::filesystem::path(home) / ".ros" / "youbot_base_sim" : "";
}

std::string file_uri(const std::string& path) {
  std::string uri = "file://";
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    uri += std::isalnum(byte) || std::strchr("/._-~", c) ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return uri;
}

}  // namespace youbot_base_sim
