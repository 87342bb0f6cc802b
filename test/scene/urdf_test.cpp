// The URDF against the contact geometry of the physics.

#include "youbot_base_sim/scene/urdf.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "youbot_base_sim/physics/roller_geometry.h"

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

/// The middle circle of one of a roller's discs, in the frame of the wheel.
struct Circle {
  Vector3d centre, normal;
  double radius;

  /// The point in direction theta, rad.
  Vector3d at(double theta) const {
    const Vector3d u = normal.unitOrthogonal();
    return centre + radius * (std::cos(theta) * u + std::sin(theta) * normal.cross(u));
  }

  /// The point that is farthest from the axle.
  Vector3d outermost() const {
    const auto distance = [this](double theta) { return std::hypot(at(theta).x(), at(theta).z()); };
    double best = 0, step = 0.01;
    for (double theta = 0; theta < 2 * M_PI; theta += step) {
      if (distance(theta) > distance(best)) best = theta;
    }
    for (; step > 1e-9; step /= 2) {
      if (distance(best + step) > distance(best)) best += step;
      if (distance(best - step) > distance(best)) best -= step;
    }
    return at(best);
  }
};

std::vector<Circle> circles(const Document& document, const std::string& roller) {
  const Eigen::Isometry3d link = pose(document.joints.at("roller_joint_" + roller));
  std::vector<Circle> result;
  for (const std::string& visual : document.visuals.at("roller_link_" + roller)) {
    if (visual.find("rubber") == std::string::npos) continue;
    const Eigen::Isometry3d disc = link * pose(visual);
    result.push_back({disc.translation(), disc.linear().col(2), number(visual, "radius")});
  }
  return result;
}

std::vector<RobotParameters> robots() {
  RobotParameters eight;
  eight.rollers = 8;
  eight.R = 0.1016;
  eight.R_d = 0.085;
  eight.h = 0.3;
  eight.l = 0.25;
  return {RobotParameters(), eight};
}

TEST(Urdf, FileOfTheRepositoryShowsThePapersRobot) {
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/urdf/youbot_base.urdf");
  std::stringstream text;
  text << file.rdbuf();
  EXPECT_EQ(text.str(), urdf(RobotParameters())) << "update it: describe_base > urdf/youbot_base.urdf";
}

TEST(Urdf, HasTheDriversJointsAndEveryRoller) {
  for (const RobotParameters& robot : robots()) {
    const Document document(urdf(robot));
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
  const Document fixed(urdf(robot)), turning(urdf(robot, RollerJoints::kTurning));
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

TEST(Urdf, RollersTouchTheFloorWhereThePhysicsDoes) {
  for (const RobotParameters& robot : robots()) {
    const Document document(urdf(robot));
    const RollerGeometry geometry(robot);
    for (int i = 0; i < kWheels; ++i) {
      for (int k = 0; k < robot.rollers; ++k) {
        const std::string roller = kWheelNames[i] + ("_" + std::to_string(k));
        double first = 0, last = 0;
        for (const Circle& circle : circles(document, roller)) {
          const Vector3d touch = circle.outermost();
          EXPECT_NEAR(std::hypot(touch.x(), touch.z()), robot.R, 1e-9) << roller;
          // The wheel angle at which this point is at the bottom.
          const double phi = std::atan2(touch.x(), -touch.z());
          const double phi_tilde = std::remainder(phi - k * geometry.pitch(), 2 * M_PI);
          EXPECT_NEAR(touch.y(), geometry.at(Wheels::Constant(phi_tilde)).Delta_Y[i], 1e-8) << roller;
          first = std::min(first, phi_tilde);
          last = std::max(last, phi_tilde);
        }
        EXPECT_NEAR(first, -last, 1e-6);
        EXPECT_GT(last, 0.9 * geometry.pitch() / 2) << "rollers are drawn to their ends";
        EXPECT_LT(last, geometry.pitch() / 2);
      }
    }
  }
}

TEST(Urdf, LowestPointOfARollerIsOnTheFloor) {
  for (const RobotParameters& robot : robots()) {
    const Document document(urdf(robot));
    for (int k = 0; k < robot.rollers; ++k) {
      const Eigen::AngleAxisd turn(k * 2 * M_PI / robot.rollers, Vector3d::UnitY());
      for (const std::string wheel : kWheelNames) {
        double lowest = 0;
        for (const Circle& circle : circles(document, wheel + "_" + std::to_string(k))) {
          lowest =
              std::min(lowest, (turn * circle.centre).z() - circle.radius * (turn * circle.normal).head<2>().norm());
        }
        EXPECT_NEAR(lowest, -robot.R, 1e-9) << wheel << k;
      }
    }
  }
}

TEST(Urdf, RollersOnTheFloorFormADiamond) {
  const Document document(urdf(RobotParameters()));
  const std::map<std::string, double> slopes = {{"fl", -1}, {"fr", 1}, {"bl", 1}, {"br", -1}};
  for (const auto& [wheel, slope] : slopes) {
    const Eigen::Isometry3d link = pose(document.joints.at("roller_joint_" + wheel + "_0"));
    EXPECT_LT((link.translation() - Vector3d(0, 0, -0.0355)).norm(), 1e-9);
    EXPECT_NEAR(link.linear()(1, 0) / link.linear()(0, 0), slope, 1e-9) << wheel;
    EXPECT_NEAR(link.linear()(2, 0), 0, 1e-9) << wheel;
  }
}

TEST(Urdf, HasTheRobotsMassAndMomentOfInertia) {
  for (const RobotParameters& robot : robots()) {
    const Document document(urdf(robot));
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
        std::istringstream lines(urdf(robot));
        std::string line;
        while (std::getline(lines, line)) {
          if (line.find("<cylinder ") != std::string::npos) {
            EXPECT_GT(number(line, "radius"), 0) << line;
            EXPECT_GT(number(line, "length"), 0) << line;
          }
          if (line.find("<box ") != std::string::npos) {
            EXPECT_GT(vector(line, "size").minCoeff(), 0) << line;
          }
          if (line.find("<mass ") != std::string::npos) {
            EXPECT_GT(number(line, "izz"), 0) << line;
          }
          EXPECT_TRUE(line.find("\"nan") == std::string::npos && line.find(" nan") == std::string::npos) << line;
        }
      }
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim
