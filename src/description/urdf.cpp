#include "youbot_base_sim/description/urdf.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/scene/frames.h"

namespace youbot_base_sim {
namespace {

using Eigen::Vector3d;

/// Ten digits; numbers below 1e-12 are rounding errors and become zero.
std::string number(double x) { return fmt::format("{:.10g}", std::abs(x) < 1e-12 ? 0.0 : x); }

std::string triple(const Vector3d& v) { return number(v.x()) + " " + number(v.y()) + " " + number(v.z()); }

std::string origin(const Vector3d& xyz = Vector3d::Zero(), const Vector3d& rpy = Vector3d::Zero()) {
  const std::string turned = rpy.isZero(0) ? "" : fmt::format(" rpy=\"{}\"", triple(rpy));
  return fmt::format("<origin xyz=\"{}\"{}/>", triple(xyz), turned);
}

std::string visual(const std::string& mesh) {
  return fmt::format("    <visual>{}<geometry><mesh filename=\"{}\"/></geometry></visual>\n", origin(), mesh);
}

std::string collision(const std::string& origin, const std::string& shape) {
  return fmt::format("    <collision>{}<geometry>{}</geometry></collision>\n", origin, shape);
}

std::string inertial(const Vector3d& centre, double mass, const Vector3d& moments) {
  return fmt::format(
      "    <inertial>{}<mass value=\"{}\"/>"
      "<inertia ixx=\"{}\" ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/></inertial>\n",
      origin(centre), number(mass), number(moments.x()), number(moments.y()), number(moments.z()));
}

std::string link(const std::string& name, const std::string& content) {
  if (content.empty()) return fmt::format("  <link name=\"{}\"/>\n", name);
  return fmt::format("  <link name=\"{}\">\n{}  </link>\n", name, content);
}

std::string joint(const std::string& name, const char* type, const std::string& parent, const std::string& child,
                  const std::string& content) {
  return fmt::format("  <joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/>{}</joint>\n", name,
                     type, parent, child, content);
}

std::string turning(const char* axis, double damping, double friction) {
  std::string dynamics;
  if (damping != 0) dynamics += fmt::format(" damping=\"{}\"", number(damping));
  if (friction != 0) dynamics += fmt::format(" friction=\"{}\"", number(friction));
  return fmt::format("<axis xyz=\"{}\"/>{}", axis, dynamics.empty() ? "" : "<dynamics" + dynamics + "/>");
}

/// Moment of inertia of a wheel about a diameter, kg m^2. The paper does not give it: that of a disc.
double wheel_moment(const RobotParameters& robot, const Dimensions& size) {
  return robot.J_1 / 2 + robot.m_1 * size.half_width * size.half_width / 3;
}

std::string base_link(const RobotParameters& robot, const Dimensions& size, const std::string& mesh) {
  std::string content = visual(mesh);
  for (const Vector3d& box : {size.hull, size.flanks}) {
    content += collision(origin({0, 0, size.middle}), fmt::format("<box size=\"{}\"/>", triple(box)));
  }
  const Vector3d squares = Vector3d{size.hull.x(), size.flanks.y(), size.hull.z()}.array().square();
  Vector3d moments = robot.m / 12 * (squares.sum() - squares.array()).matrix();
  // I_s = 4 I_1 + 4 m_1 (h^2 + l^2) + I_C + m (a_X^2 + a_Y^2) (paper, after (4.5))
  const double I_C = robot.I_s - robot.m * (robot.a_X * robot.a_X + robot.a_Y * robot.a_Y) -
                     kWheels * (wheel_moment(robot, size) + robot.m_1 * (robot.h * robot.h + robot.l * robot.l));
  if (I_C > 0) moments *= I_C / moments.z();
  content += inertial({robot.a_X, robot.a_Y, kAxleHeight + robot.a_Z}, robot.m, moments);
  return link("base_link", content);
}

std::string wheel_link(const RobotParameters& robot, const Dimensions& size, const std::string& name,
                       const std::string& mesh) {
  const Vector3d along_y{M_PI_2, 0, 0};  // a cylinder's axis is z
  const double I_1 = wheel_moment(robot, size);
  return link(name, visual(mesh) +
                        collision(origin(Vector3d::Zero(), along_y),
                                  fmt::format("<cylinder radius=\"{}\" length=\"{}\"/>", number(robot.R),
                                              number(2 * size.half_width))) +
                        inertial(Vector3d::Zero(), robot.m_1, {I_1, robot.J_1, I_1}));
}

std::string roller_origin(const RobotParameters& robot, int i, int k) {
  const Eigen::Isometry3d pose = roller_pose(robot, i, k);
  const Eigen::Matrix3d turn = pose.linear();
  return origin(pose.translation(),
                {std::atan2(turn(2, 1), turn(2, 2)), std::asin(-turn(2, 0)), std::atan2(turn(1, 0), turn(0, 0))});
}

}  // namespace

std::string urdf(const RobotParameters& robot, RollerJoints rollers, const MeshUri& mesh_uri) {
  const RobotParameters widest = with_rollers_at(robot.roller_angle.abs().maxCoeff(), robot);
  const Motor motor;
  const std::string limit =
      fmt::format("<limit effort=\"{}\" velocity=\"{}\"/>", number(motor.max_torque()), number(motor.max_rate()));
  std::string document =
      "<?xml version=\"1.0\"?>\n"
      "<!-- The youBot's base as it is simulated; written by describe_base. -->\n"
      "<robot name=\"youbot_base\">\n";

  document += link("base_footprint", "");
  document += joint("base_footprint_joint", "fixed", "base_footprint", "base_link", origin());
  document += base_link(robot, Dimensions(widest), mesh_uri(Part::kBody, widest));
  for (int i = 0; i < kWheels; ++i) {
    const std::string wheel = kWheelNames[i];
    const RobotParameters drawn = with_rollers_at(robot.roller_angle[i], robot);
    document += joint("caster_joint_" + wheel, "continuous", "base_link", "caster_link_" + wheel,
                      origin({robot.rho_X()[i], robot.rho_Y()[i], kAxleHeight}) + turning("0 0 1", 0, 0));
    document += link("caster_link_" + wheel, "");
    document += joint("wheel_joint_" + wheel, "continuous", "caster_link_" + wheel, "wheel_link_" + wheel,
                      origin() + turning("0 1 0", robot.mu_1[i], robot.dry_friction[i]) + limit);
    document += wheel_link(robot, Dimensions(drawn), "wheel_link_" + wheel,
                           mesh_uri(robot.tan_delta()[i] < 0 ? Part::kWheelLeft : Part::kWheelRight, drawn));
    const std::string roller_mesh = mesh_uri(Part::kRoller, drawn);
    for (int k = 0; k < robot.rollers; ++k) {
      const std::string roller = fmt::format("{}_{}", wheel, k);
      const bool fixed = rollers == RollerJoints::kFixed;
      document += joint(
          "roller_joint_" + roller, fixed ? "fixed" : "continuous", "wheel_link_" + wheel, "roller_link_" + roller,
          roller_origin(robot, i, k) + (fixed ? "" : turning("1 0 0", robot.mu_2[i], robot.roller_dry_friction[i])));
      document += link("roller_link_" + roller, visual(roller_mesh));
    }
  }
  return document + "</robot>\n";
}

}  // namespace youbot_base_sim
