#pragma once

#include <Eigen/Dense>
#include <filesystem>
#include <string>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// The parts of the base that are drawn by a mesh, in the frame of their link, for a robot `with_rollers_at` one angle.
enum class Part {
  kRoller,      ///< its axis is x; two stripes along it show how it turns
  kWheelLeft,   ///< hub and side plates of a wheel whose rollers on the floor point as the left front one's
  kWheelRight,  ///< the same for the right front one's
  kBody
};
constexpr Part kParts[] = {Part::kRoller, Part::kWheelLeft, Part::kWheelRight, Part::kBody};

/// The robot with rollers at |angle| (degrees) on all wheels: that of a wheel to draw, or the largest for the body.
inline RobotParameters with_rollers_at(double angle, RobotParameters robot) {
  robot.roller_angle = std::abs(angle);
  return robot;
}

/// Sizes of the drawing that the parameters leave open, m.
struct Dimensions {
  explicit Dimensions(const RobotParameters& robot);

  double roller_edge;  ///< phi~ at a roller's ends, rad
  double rim_y;        ///< middle of the plates that hold the rollers, along the axle
  double rim_thickness, half_width, hub_radius, pin_radius;
  Eigen::Vector3d hull, flanks;  ///< boxes of the body: between left and right wheels, between front and rear wheels
  double middle, top;            ///< heights of the body over the frame base_link
};

/// The name of a part's mesh file: made of the parameters that the mesh depends on, so that one name means one mesh.
std::string mesh_name(Part part, const RobotParameters& robot);

/// Its contents: COLLADA, m. Rollers are barrels whose envelope, on a turning wheel, is the cylinder of radius R: the
/// circle that touches the floor at any wheel angle touches this cylinder from inside.
std::string mesh(Part part, const RobotParameters& robot);

/// The folder of the meshes of the paper's robot, which are installed with the package.
constexpr char kPackageMeshes[] = "package://youbot_base_sim/meshes/";

/// True if the part is one of the paper's robot.
inline bool in_package(Part part, const RobotParameters& robot) {
  return mesh_name(part, robot) == mesh_name(part, RobotParameters());
}

/// The folder of the others: $ROS_HOME/youbot_base_sim, or ~/.ros/youbot_base_sim; empty if neither is known.
std::filesystem::path mesh_cache();

/// The URI of a file by its absolute path.
std::string file_uri(const std::string& path);

}  // namespace youbot_base_sim
