// The program `describe_base` as a launch file or a user runs it: its document, messages and exit status.

#include <gtest/gtest.h>

#include <algorithm>

#include "program.h"
#include "youbot_base_sim/scene/urdf.h"

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

  static void expect_refuses(const std::vector<std::string>& arguments, const std::string& word) {
    Program program(DESCRIBE_BASE, arguments);
    EXPECT_EQ(program.wait(), 2) << word;
    EXPECT_EQ(program.out(), "");
    const std::string message = program.err();
    EXPECT_EQ(message.find("describe_base: "), 0u) << message;
    EXPECT_NE(message.find(word), std::string::npos) << message;
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  }

  TemporaryFolder folder_;
};

TEST_F(DescribeBaseTest, PrintsThePapersRobotWithoutAScene) {
  expect_prints({}, urdf(RobotParameters()));
  expect_prints({""}, urdf(RobotParameters()));  // the argument of a launch file that is not set
}

TEST_F(DescribeBaseTest, PrintsTheRobotOfTheScene) {
  RobotParameters robot;
  robot.rollers = 8;
  const std::string scene = folder_.write("scene.yaml", "duration: 1\nrobot: {rollers_per_wheel: 8}\n");
  expect_prints({scene}, urdf(robot));
  expect_prints({"--turning-rollers", scene}, urdf(robot, RollerJoints::kTurning));
  expect_prints({scene, "--turning-rollers"}, urdf(robot, RollerJoints::kTurning));
}

TEST_F(DescribeBaseTest, RefusesBadArgumentsInOneLine) {
  const std::string scene = folder_.write("scene.yaml", "duration: 1\n");
  expect_refuses({"--colour"}, "--colour");
  expect_refuses({"--two\nlines\x1b"}, "--two\\nlines\\x1b");
  expect_refuses({scene, scene}, "--help");
  expect_refuses({folder_.path("")}, "is a folder; must be a scene file");
  expect_refuses({folder_.path("missing.yaml")}, "missing.yaml");
  expect_refuses({folder_.write("bad.yaml", "duration: 1\nrobot: {body_mass: -1}\n")}, "robot.body_mass = -1");
}

TEST_F(DescribeBaseTest, HelpsOnRequest) {
  Program program(DESCRIBE_BASE, {"--help"});
  EXPECT_EQ(program.wait(), 0);
  EXPECT_NE(program.out().find("--turning-rollers"), std::string::npos);
}

}  // namespace
}  // namespace youbot_base_sim
