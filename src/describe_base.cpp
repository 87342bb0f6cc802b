// Prints the URDF of the base that a scene simulates.

#include <boost/program_options.hpp>
#include <cstdio>
#include <iostream>
#include <string>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/scene/urdf.h"
#include "youbot_base_sim/text/print_error.h"
#include "youbot_base_sim/text/quote.h"

int main(int argc, char** argv) {
  using namespace youbot_base_sim;
  namespace po = boost::program_options;
  std::string scene;  // empty also where it is an argument of a launch file that is not set
  bool turning_rollers = false;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("turning-rollers", po::bool_switch(&turning_rollers),
     "continuous roller joints, for a node that publishes the rollers' joint states; without it they are fixed, and "
     "the driver's eight joint states are enough")
    ("help,h", "print this");
  // clang-format on
  po::options_description all;
  all.add(options).add_options()("scene", po::value(&scene));
  try {
    po::variables_map given;
    po::store(po::command_line_parser(argc, argv)
                  .options(all)
                  .positional(po::positional_options_description().add("scene", 1))
                  .run(),
              given);
    po::notify(given);
    if (given.count("help")) {
      std::cout << "Usage: describe_base [SCENE.yaml] [options]\n\nPrints the URDF of the base that the scene "
                   "simulates; without a scene, of the paper's robot.\n\n"
                << options;
      return 0;
    }
    const RobotParameters robot = scene.empty() ? RobotParameters() : load_scene(scene).robot;
    std::cout << urdf(robot, turning_rollers ? RollerJoints::kTurning : RollerJoints::kFixed) << std::flush;
  } catch (const po::error& error) {
    print_error("describe_base", quote(error.what(), kMaxMessage) + "; see describe_base --help");
    return 2;
  } catch (const SceneError& error) {
    print_error("describe_base", error.what());
    return 2;
  }
  if (!std::cout) {
    std::perror("describe_base: standard output");
    return 1;
  }
  return 0;
}
