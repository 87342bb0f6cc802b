// The URDF against the contact geometry of the physics.

#include "youbot_base_sim/description/urdf.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {
namespace {

using Eigen::Vector3d;

// A parser for what urdf() writes: each joint, visual and inertial has a line of its own.
std::string attribute(const std::string& line, const std::string& name) {
  const auto start = line.find(" " + name + "=\"");
  if (start == std::string::npos) return "";
  const auto value = start + name.size() + 3;
  return line.substr(value, line.find('"', value) - value);
}

double number(const std::string& line, const std::string& name) { return std::stod(attribute(line, name)); }

Vector3d vector(const std::string& line, const std::string& name) {
  Vector3d v = Vector3d::Zero();
  std::istringstream(attribute(line, name)) >> v.x() >> v.y() >> v.z();
  return v;
}

Eigen::Isometry3d pose(const std::string& line) {
  const Vector3d rpy = vector(line, "rpy");
  return Eigen::Translation3d(vector(line, "xyz")) * Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) *
         Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) * Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX());
}

struct Document {
  explicit Document(const std::string& text) {
    std::istringstream lines(text);
    std::string line, link;
    while (std::getline(lines, line)) {
      if (line.find("<link ") != std::string::npos) {
        link = attribute(line, "name");
        links.push_back(link);
      }
      if (line.find("<joint ") != std::string::npos) joints[attribute(line, "name")] = line;
      if (line.find("<visual>") != std::string::npos) visuals[link].push_back(line);
      if (line.find("<inertial>") != std::string::npos) inertials[link] = line;
    }
  }

  std::vector<std::string> links;
  std::map<std::string, std::string> joints, inertials;
  std::map<std::string, std::vector<std::string>> visuals;
};

/// The corners of a mesh's triangles, with their normals, as a COLLADA file tells them.
struct Triangle {
  Vector3d corner[3], normal[3];

  Triangle moved(const Eigen::Isometry3d& pose) const {
    Triangle result;
    for (int k = 0; k < 3; ++k) {
      result.corner[k] = pose * corner[k];
      result.normal[k] = pose.linear() * normal[k];
    }
    return result;
  }

  /// Where the normal, which a renderer interpolates between the corners, points straight down, if anywhere.
  std::optional<Vector3d> bottom() const {
    if (normal[0].z() > -0.9) return std::nullopt;  // far from it, to save time
    Eigen::Matrix3d equations;
    for (int k = 0; k < 3; ++k) equations.col(k) << normal[k].x(), normal[k].y(), 1;
    const Vector3d weights = equations.fullPivLu().solve(Vector3d(0, 0, 1));
    if ((equations * weights - Vector3d(0, 0, 1)).norm() > 1e-9) return std::nullopt;  // a flat face
    const double slack = 1e-6;
    if (!(weights.minCoeff() >= -slack) || !(weights.maxCoeff() <= 1 + slack)) return std::nullopt;
    if (weights.dot(Vector3d(normal[0].z(), normal[1].z(), normal[2].z())) > 0) return std::nullopt;
    return weights[0] * corner[0] + weights[1] * corner[1] + weights[2] * corner[2];
  }
};

/// The numbers of a COLLADA file between `begin` and the next tag.
std::vector<double> numbers(const std::string& collada, const std::string& begin, std::size_t& at) {
  std::vector<double> result;
  at = collada.find(begin, at);
  if (at == std::string::npos) return result;
  const std::size_t start = collada.find('\n', at), end = collada.find('<', start);
  std::istringstream text(collada.substr(start, end - start));
  for (double number; text >> number;) result.push_back(number);
  at = end;
  return result;
}

std::vector<Triangle> triangles(const std::string& collada) {
  std::size_t at = 0;
  const std::vector<double> positions = numbers(collada, "positions_array", at);
  const std::vector<double> normals = numbers(collada, "normals_array", at);
  std::vector<Triangle> result;
  for (;;) {
    const std::vector<double> corners = numbers(collada, "<triangles", at);
    if (corners.empty()) return result;
    for (std::size_t k = 0; k < corners.size(); ++k) {
      if (k % 3 == 0) result.emplace_back();
      const auto corner = static_cast<std::size_t>(3 * corners[k]);
      result.back().corner[k % 3] = Eigen::Map<const Vector3d>(&positions.at(corner));
      result.back().normal[k % 3] = Eigen::Map<const Vector3d>(&normals.at(corner));
    }
  }
}

/// The base as a renderer has it: the URDF, and the meshes that it names.
struct Drawing {
  explicit Drawing(const RobotParameters& robot) : document(urdf_of(robot)) {
    for (const Part part : kParts) meshes[mesh_name(part, robot)] = triangles(mesh(part, robot));
  }

  static std::string urdf_of(const RobotParameters& robot, RollerJoints rollers = RollerJoints::kFixed) {
    return urdf(robot, rollers, [](Part part, const RobotParameters& drawn) { return mesh_name(part, drawn); });
  }

  /// All triangles of a roller's meshes in the frame of its wheel.
  std::vector<Triangle> roller(const std::string& name) const {
    const Eigen::Isometry3d link = pose(document.joints.at("roller_joint_" + name));
    std::vector<Triangle> result;
    for (const std::string& visual : document.visuals.at("roller_link_" + name)) {
      if (visual.find("<mesh ") == std::string::npos) continue;
      for (const Triangle& triangle : meshes.at(attribute(visual, "filename"))) {
        result.push_back(triangle.moved(link * pose(visual)));
      }
    }
    return result;
  }

  Document document;
  std::map<std::string, std::vector<Triangle>> meshes;
};

std::vector<RobotParameters> robots() {
  RobotParameters eight;
  eight.rollers = 8;
  eight.R = 0.1016;
  eight.R_d = 0.085;
  eight.h = 0.3;
  eight.l = 0.25;
  return {RobotParameters(), eight};
}

std::string contents(const std::string& file) {
  std::ifstream stream(YOUBOT_BASE_SIM_SOURCE_DIR "/" + file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(Urdf, FilesOfTheRepositoryShowThePapersRobot) {
  const RobotParameters robot;
  const auto uri = [](Part part, const RobotParameters& drawn) { return kPackageMeshes + mesh_name(part, drawn); };
  EXPECT_TRUE(contents("urdf/youbot_base.urdf") == urdf(robot, RollerJoints::kFixed, uri))
      << "update it: describe_base > urdf/youbot_base.urdf";
  for (const Part part : kParts) {
    EXPECT_TRUE(contents("meshes/" + mesh_name(part, robot)) == mesh(part, robot))
        << "update it: describe_base --meshes meshes";
    EXPECT_TRUE(in_package(part, robot));
  }
}

TEST(Urdf, MeshesOfOtherRobotsHaveOtherNames) {
  RobotParameters wide, round;
  wide.l = 0.2;
  round.R_d = 0.036;
  for (const Part part : kParts) {
    EXPECT_FALSE(in_package(part, round));
    EXPECT_EQ(in_package(part, wide), part != Part::kBody);
  }
}

TEST(Urdf, UrisAreThoseOfPaths) { EXPECT_EQ(file_uri("/a b/c%.obj"), "file:///a%20b/c%25.obj"); }

TEST(Urdf, HasTheDriversJointsAndEveryRoller) {
  for (const RobotParameters& robot : robots()) {
    const Document document(Drawing::urdf_of(robot));
    EXPECT_EQ(document.links.size(), 2u + kWheels * (2 + robot.rollers));
    EXPECT_EQ(document.joints.size(), 1u + kWheels * (2 + robot.rollers));
    for (int i = 0; i < kWheels; ++i) {
      const std::string wheel = kWheelNames[i];
      const std::string caster_joint = document.joints.at("caster_joint_" + wheel);
      EXPECT_EQ(attribute(caster_joint, "type"), "continuous");
      EXPECT_EQ(vector(caster_joint, "xyz"), Vector3d(robot.rho_X()[i], robot.rho_Y()[i], kAxleHeight));
      const std::string wheel_joint = document.joints.at("wheel_joint_" + wheel);
      EXPECT_EQ(attribute(wheel_joint, "type"), "continuous");
      EXPECT_NE(wheel_joint.find("<axis xyz=\"0 1 0\"/>"), std::string::npos);
      for (int k = 0; k < robot.rollers; ++k) {
        EXPECT_EQ(document.joints.count("roller_joint_" + wheel + "_" + std::to_string(k)), 1u);
      }
    }
  }
}

TEST(Urdf, RollersTurnOnRequest) {
  const RobotParameters robot;
  const Document fixed(Drawing::urdf_of(robot)), turning(Drawing::urdf_of(robot, RollerJoints::kTurning));
  ASSERT_EQ(fixed.joints.size(), turning.joints.size());
  for (const auto& [name, joint] : turning.joints) {
    const bool roller = name.find("roller") == 0;
    EXPECT_TRUE(pose(joint).isApprox(pose(fixed.joints.at(name)))) << name;
    EXPECT_EQ(attribute(fixed.joints.at(name), "type") == "fixed", roller || name == "base_footprint_joint") << name;
    if (!roller) continue;
    EXPECT_EQ(attribute(joint, "type"), "continuous") << name;
    EXPECT_NE(joint.find("<axis xyz=\"1 0 0\"/>"), std::string::npos) << name;  // e_i, the axis of gamma
  }
}

// The mesh's lowest point is that of the smooth surface that it stands for: where its normal points straight down.
TEST(Urdf, RollersTouchTheFloorWhereThePhysicsDoes) {
  for (const RobotParameters& robot : robots()) {
    const double tolerance = 2e-3 * robot.R;  // 0.1 mm on the paper's robot
    const Drawing drawing(robot);
    const RollerGeometry geometry(robot);
    for (int i = 0; i < kWheels; ++i) {
      const std::string wheel = kWheelNames[i];
      const Vector3d centre = vector(drawing.document.joints.at("caster_joint_" + wheel), "xyz");
      std::vector<std::vector<Triangle>> rollers;
      for (int k = 0; k < robot.rollers; ++k) rollers.push_back(drawing.roller(wheel + "_" + std::to_string(k)));
      for (int step = 0; step < 60; ++step) {
        const double phi = 2 * M_PI * (step + 0.4) / 60;
        const auto on_floor = geometry.roller_at(phi);
        const double phi_tilde = phi - static_cast<double>(on_floor) * geometry.pitch();
        const Vector3d contact =
            Vector3d(robot.rho_X()[i], robot.rho_Y()[i] + geometry.at(Wheels::Constant(phi_tilde)).Delta_Y[i],
                     floor_height(robot));
        const Eigen::Isometry3d turned = Eigen::Translation3d(centre) * Eigen::AngleAxisd(phi, Vector3d::UnitY());
        Vector3d lowest = Vector3d::Zero();
        int lowest_roller = -1;
        for (int k = 0; k < robot.rollers; ++k) {
          for (const Triangle& triangle : rollers[k]) {
            const Triangle moved = triangle.moved(turned);
            for (const Vector3d& corner : moved.corner) ASSERT_GT(corner.z(), floor_height(robot) - 1e-6);
            const auto bottom = moved.bottom();
            if (!bottom || bottom->z() > lowest.z()) continue;
            lowest = *bottom;
            lowest_roller = k;
          }
        }
        EXPECT_EQ(lowest_roller, wrapped(on_floor, robot.rollers)) << wheel << " at " << phi;
        EXPECT_LT((lowest - contact).norm(), tolerance) << wheel << " at " << phi << ": " << lowest.transpose();
      }
    }
  }
}

TEST(Urdf, HasTheRobotsMassAndMomentOfInertia) {
  for (const RobotParameters& robot : robots()) {
    const Document document(Drawing::urdf_of(robot));
    double mass = 0, moment = 0;
    for (const auto& [link, inertial] : document.inertials) {
      Vector3d centre = vector(inertial, "xyz");
      if (link != "base_link") {
        centre += vector(document.joints.at("caster_joint_" + link.substr(link.rfind('_') + 1)), "xyz");
        EXPECT_DOUBLE_EQ(number(inertial, "iyy"), robot.J_1);
      }
      EXPECT_GE(number(inertial, "ixx") + number(inertial, "iyy"), number(inertial, "izz"));
      EXPECT_GE(number(inertial, "ixx") + number(inertial, "izz"), number(inertial, "iyy"));
      mass += number(inertial, "value");
      moment += number(inertial, "izz") + number(inertial, "value") * centre.head<2>().squaredNorm();
    }
    EXPECT_DOUBLE_EQ(mass, robot.m_s());
    EXPECT_NEAR(moment, robot.I_s, 1e-8);
    EXPECT_EQ(document.inertials.count("base_footprint"), 0u) << "KDL warns about inertia of the root link";
  }
}

TEST(Urdf, DrawsUnusualRobots) {
  for (const int rollers : {3, 4, 30}) {
    for (const double R_d : {1e-3, 0.02, 0.0499}) {
      for (const double h : {0.01, 10.0}) {
        RobotParameters robot;
        robot.rollers = rollers;
        robot.R_d = R_d;
        robot.h = robot.l = h;
        for (const Part part : kParts) {
          const std::string text = mesh(part, robot);
          EXPECT_TRUE(text.find("nan") == std::string::npos && text.find("inf") == std::string::npos)
              << rollers << " " << R_d;
        }
        std::istringstream lines(Drawing::urdf_of(robot));
        std::string line;
        while (std::getline(lines, line)) {
          for (const std::string name : {"radius", "length", "izz"}) {
            EXPECT_TRUE(attribute(line, name).empty() || number(line, name) > 0) << line;
          }
          EXPECT_TRUE(line.find("<box ") == std::string::npos || vector(line, "size").minCoeff() > 0) << line;
          EXPECT_TRUE(line.find("\"nan") == std::string::npos && line.find(" nan") == std::string::npos) << line;
        }
      }
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim
