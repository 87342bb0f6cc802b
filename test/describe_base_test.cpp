// The program `describe_base` as a launch file or a user runs it: its document, messages and exit status.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

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

TEST_F(DescribeBaseTest, PrintsThePapersRobotWithoutAScene) {
  const std::string document = urdf(RobotParameters(), RollerJoints::kFixed, in_package);
  expect_prints({}, document);
  expect_prints({""}, document);  // the argument of a launch file that is not set
}

// Its meshes are written where the document says, by whatever argument or environment that is.
TEST_F(DescribeBaseTest, PrintsTheRobotOfTheScene) {
  RobotParameters robot;
  robot.rollers = 8;
  const std::string scene = folder_.write("scene.yaml", "duration: 1\nrobot: {rollers_per_wheel: 8}\n");
  const std::string ros_home = folder_.path("home"), given = folder_.path("given folder");
  setenv("ROS_HOME", ros_home.c_str(), 1);
  const auto in_cache = [&](Part part, const RobotParameters& drawn) {
    return file_uri(ros_home + "/youbot_base_sim/" + mesh_name(part, drawn));
  };
  const auto in_given = [&](Part part, const RobotParameters& drawn) {
    return file_uri(given + "/" + mesh_name(part, drawn));
  };
  for (int again = 0; again < 2; ++again) {
    expect_prints({scene}, urdf(robot, RollerJoints::kFixed, in_cache));
    expect_prints({"--turning-rollers", scene}, urdf(robot, RollerJoints::kTurning, in_cache));
    expect_prints({scene, "--turning-rollers"}, urdf(robot, RollerJoints::kTurning, in_cache));
    expect_prints({scene, "--meshes", given}, urdf(robot, RollerJoints::kFixed, in_given));
  }
  for (const Part part : kParts) {
    for (const std::string& written : {ros_home + "/youbot_base_sim/", given + "/"}) {
      std::ifstream file(written + mesh_name(part, robot));
      std::stringstream text;
      text << file.rdbuf();
      EXPECT_TRUE(text.str() == mesh(part, robot)) << written;
    }
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

TEST_F(DescribeBaseTest, HelpsOnRequest) {
  Program program(DESCRIBE_BASE, {"--help"});
  EXPECT_EQ(program.wait(), 0);
  EXPECT_NE(program.out().find("--turning-rollers"), std::string::npos);
}

}  // namespace
}  // namespace youbot_base_sim
