// Prints the URDF of the base that a scene simulates, and writes the meshes that it draws; or its kinematics.

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "youbot_base_sim/description/meshes.h"
#include "youbot_base_sim/description/urdf.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/text/command_line.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;

struct Arguments {
  std::string scene;  // empty also for a launch file's argument that is not set
  bool turning_rollers = false, kinematics = false;
  std::string meshes;  // folder; empty: the package has them, or the cache
};

const Usage kUsage = {"describe_base [SCENE.yaml] [options]",
                      "Prints the URDF of a scene's base (or --scene SCENE.yaml); without one, of the paper's robot.",
                      "",
                      "  describe_base > base.urdf\n"
                      "  describe_base my_scene.yaml --turning-rollers --meshes meshes > my_base.urdf\n"
                      "  describe_base config/robots/clearpath_ridgeback.yaml --kinematics\n"};

/// Reads the command line; false if all that was wanted was help. Throws std::runtime_error.
bool read_arguments(int argc, char** argv, Arguments& arguments) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("turning-rollers", po::bool_switch(&arguments.turning_rollers),
     "continuous roller joints, for a node that publishes the rollers' joint states; without it they are fixed, and "
     "the driver's eight joint states are enough")
    ("kinematics", po::bool_switch(&arguments.kinematics),
     "print, in place of the URDF, what controllers and filters of others have to be configured with for this base")
    ("meshes", po::value(&arguments.meshes)->value_name("FOLDER"),
     "write all meshes into this folder. Without it, parts of the paper's robot use the package's meshes; others are "
     "written to $ROS_HOME/youbot_base_sim, or ~/.ros/youbot_base_sim. rviz must find that folder on its machine");
  // clang-format on
  return parse(argc, argv, kUsage, options, {"scene", po::value(&arguments.scene), 1, false});
}

/// Writes the mesh of a part. Returns its URI.
std::string write_mesh(Part part, const RobotParameters& robot, const std::filesystem::path& given_folder) {
  if (given_folder.empty()) throw OutputError("HOME is not set: --meshes must say where the meshes go");
  const std::filesystem::path path = std::filesystem::absolute(given_folder) / mesh_name(part, robot);
  const std::string folder = path.parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw OutputError(fmt::format("{}: cannot be made: {}", quote_path(folder), error.message()));
  OutputFile file(path);
  file.write(mesh(part, robot));
  file.commit();
  return file_uri(path);
}

/// Lengths and factors in the names of other packages, as YAML. Rollers without friction move the base laterally by
/// sin(pi/n) / (pi/n) / tan(roller_angle) of the rims' way (docs/model.md); of different angles the mean counts.
std::string kinematics(const RobotParameters& robot) {
  const double tau = (robot.tan_delta() * Wheels{-1, 1, 1, -1}).mean(), pitch = M_PI / robot.rollers;
  const double lateral = std::sin(pitch) / pitch / tau, lengths = robot.l + tau * robot.h;
  return fmt::format(
      "# effective wheel radius: forward {0:.6g} m, lateral {1:.6g} m; l + h tan(roller_angle): {2:.6g} m\n"
      "mecanum_drive_controller:\n"
      "  ros__parameters:  # of ros2_controllers\n"
      "    kinematics: {{wheels_radius: {0:.6g}, sum_of_robot_center_projection_on_X_Y_axis: {2:.6g}}}\n"
      "  # of its forks, and of ROS 1, which reads the lengths from this robot's URDF:\n"
      "  wheel_radius: {0:.6g}\n  wheel_separation_x: {3:.6g}\n  wheel_separation_y: {4:.6g}\n"
      "  wheel_radius_multiplier: 1\n  wheel_separation_x_multiplier: {5:.6g}\n  wheel_separation_y_multiplier: 1\n"
      "# none of them knows: multiply linear.y of odometry by {6:.6g}, and divide that of commands by it\n"
      "ekf_localization_node:  # of robot_localization: velocities forward, lateral and in yaw\n"
      "  odom0_config: [false, false, false, false, false, false, true, true, false, false, false, true, false, false, "
      "false]\n",
      robot.R, robot.R * lateral, lengths, 2 * robot.h, 2 * robot.l, tau, lateral);
}

/// The URDF, whose meshes are written unless the package has them. Throws std::runtime_error.
std::string describe(const Arguments& arguments) {
  const RobotParameters robot = arguments.scene.empty() ? RobotParameters() : load_scene(arguments.scene).robot;
  if (arguments.kinematics) return kinematics(robot);
  const auto uri = [&](Part part, const RobotParameters& drawn) {
    if (!arguments.meshes.empty()) return write_mesh(part, drawn, arguments.meshes);
    return in_package(part, drawn) ? kPackageMeshes + mesh_name(part, drawn) : write_mesh(part, drawn, mesh_cache());
  };
  return urdf(robot, arguments.turning_rollers ? RollerJoints::kTurning : RollerJoints::kFixed, uri);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  std::string document;
  return run_offline_program(
      "describe_base",
      [&] {
        const bool ready = read_arguments(argc, argv, arguments);
        if (ready) document = describe(arguments);
        return ready;
      },
      [&] {
        std::fputs(document.c_str(), stdout);
        return kDone;
      });
}
