// The program `describe_base` as a launch file or a user runs it: its document, messages and exit status.

#include <gtest/gtest.h>

#include <cstdlib>

#include "program.h"
#include "youbot_base_sim/description/urdf.h"

namespace youbot_base_sim {
namespace {

class DescribeBaseTest : public testing::Test {
 protected:
  static void expect_prints(const std::vector<std::string>& arguments, const std::string& document) {
    Program program(DESCRIBE_BASE, arguments);
    EXPECT_EQ(program.wait(), 0) << program.err();
    EXPECT_EQ(program.err(), "");
    EXPECT_EQ(program.out(), document);
  }

  TemporaryFolder folder_;
};

std::string in_package(Part part, const RobotParameters& drawn) { return kPackageMeshes + mesh_name(part, drawn); }

// Without one the paper's. Meshes are written where the document says, by whatever argument or environment that is.
TEST_F(DescribeBaseTest, PrintsTheRobotOfTheScene) {
  expect_prints({}, urdf(RobotParameters(), RollerJoints::kFixed, in_package));
  expect_prints({""}, urdf(RobotParameters(), RollerJoints::kFixed, in_package));  // of an unset launch argument
  RobotParameters robot;
  robot.rollers = 8;
  const std::string scene = folder_.write("scene.yaml", "duration: 1\nrobot: {rollers_per_wheel: 8}\n");
  const std::string ros_home = folder_.path("home"), given = folder_.path("given folder");
  setenv("ROS_HOME", ros_home.c_str(), 1);
  const auto in = [](const std::string& folder) -> MeshUri {
    return [=](Part part, const RobotParameters& drawn) { return file_uri(folder + "/" + mesh_name(part, drawn)); };
  };
  const MeshUri in_cache = in(ros_home + "/youbot_base_sim"), in_given = in(given);
  for (int again = 0; again < 2; ++again) {
    expect_prints({scene}, urdf(robot, RollerJoints::kFixed, in_cache));
    expect_prints({"--turning-rollers", scene}, urdf(robot, RollerJoints::kTurning, in_cache));
    expect_prints({scene, "--turning-rollers"}, urdf(robot, RollerJoints::kTurning, in_cache));
    expect_prints({scene, "--meshes", given}, urdf(robot, RollerJoints::kFixed, in_given));
  }
  for (const Part part : kParts) {
    for (const std::string written : {"home/youbot_base_sim/", "given folder/"}) {
      EXPECT_TRUE(folder_.read(written + mesh_name(part, robot)) == mesh(part, robot)) << written;
    }
  }
}

// By hand: 3 / pi for six rollers, and tan(30 deg) = 1 / sqrt(3).
TEST_F(DescribeBaseTest, PrintsTheKinematicsInTheNamesOfOthers) {
  const std::string thirty = folder_.write("thirty.yaml", "duration: 1\nrobot: {roller_angle: 30}\n");
  const std::vector<std::pair<std::string, std::vector<std::string>>> expected = {
      {"",
       {"wheels_radius: 0.05, sum_of_robot_center_projection_on_X_Y_axis: 0.385", "lateral 0.0477465 m", "by 0.95493"}},
      {"--help", {"--turning-rollers"}},
      {thirty, {"axis: 0.285677", "lateral 0.0826993 m", "_separation_x: 0.47\n", "_x_multiplier: 0.57735\n"}}};
  for (const auto& [scene, words] : expected) {
    Program program(DESCRIBE_BASE, {"--kinematics", scene});
    EXPECT_EQ(program.wait(), 0) << program.err();
    for (const std::string& word : words)
      EXPECT_NE(program.out().find(word), std::string::npos) << word << program.out();
  }
}

TEST_F(DescribeBaseTest, SaysThatItsOutputIsCut) {
  for (const std::string& run :
       std::vector<std::string>{"exec \"$0\" > /dev/full", "ulimit -f 8; exec \"$0\" > " + folder_.path("cut.urdf")}) {
    Program shell("/bin/sh", {"-c", run, DESCRIBE_BASE});
    EXPECT_EQ(shell.wait(), 1) << run;
    EXPECT_EQ(shell.err().find("describe_base: standard output: cannot be written: no space left for it"), 0u)
        << shell.err();
  }
}

}  // namespace
}  // namespace youbot_base_sim
