// Prints the URDF of the base that a scene simulates.

#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/scene/urdf.h"

namespace {

constexpr char kUsage[] =
    "usage: describe_base [--turning-rollers] [SCENE.yaml]\n"
    "Prints the URDF of the base that the scene simulates; without a scene, of the paper's robot.\n"
    "\n"
    "  --turning-rollers   continuous roller joints, for a node that publishes the rollers' joint states; without it\n"
    "                      they are fixed, and the driver's eight joint states are enough\n";

int refuse(const std::string& reason) {
  fmt::print(stderr, "describe_base: {}\n", reason);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  std::string scene;
  auto rollers = RollerJoints::kFixed;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--help" || argument == "-h") {
      std::fputs(kUsage, stdout);
      return 0;
    }
    if (argument == "--turning-rollers") {
      rollers = RollerJoints::kTurning;
    } else if (argument.rfind("-", 0) == 0) {
      return refuse(fmt::format("unknown option {}; see --help", argument));
    } else if (!scene.empty()) {
      return refuse("takes one scene at most; see --help");
    } else {
      scene = argument;  // empty where it is a launch file's argument that nobody has set
    }
  }

  try {
    const RobotParameters robot = scene.empty() ? RobotParameters() : load_scene(scene).robot;
    const std::string document = urdf(robot, rollers);
    if (std::fputs(document.c_str(), stdout) < 0 || std::fflush(stdout) != 0) {
      std::perror("describe_base: standard output");
      return 1;
    }
  } catch (const SceneError& error) {
    return refuse(error.what());
  }
  return 0;
}
