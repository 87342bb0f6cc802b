// simulate and describe_base with bad arguments: exit status 2, one line, and nothing is written or changed, whatever
// outputs are asked for besides.

#include <gtest/gtest.h>

#include "refusals.h"

namespace youbot_base_sim {
namespace {

class ProgramsTest : public testing::Test {
 protected:
  void SetUp() override {
    good_ = folder_.write("good.yaml", "duration: 0.02\ndrive: {torque_table: table.csv}\n");
    folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,1,1,1\n");
    // Outputs of an earlier run, which must survive.
    for (const char* name : {"csv", "switches", "summary", "bag"}) folder_.write(name, "what was here before\n");
    std::filesystem::create_directory(folder_.path("folder"));
    std::filesystem::create_symlink("csv", folder_.path("link"));
    std::filesystem::create_symlink("good.yaml", folder_.path("link.yaml"));
    std::filesystem::create_hard_link(good_, folder_.path("hard.yaml"));
    std::filesystem::create_symlink("loop", folder_.path("loop"));
  }

  void expect_refused(const std::string& program, const std::vector<std::string>& arguments,
                      const std::vector<std::string>& parts) {
    expect_program_refuses(folder_, program, arguments, parts);
    ++cases_;
  }

  /// With all outputs besides.
  void expect_simulate_refuses(std::vector<std::string> arguments, const std::vector<std::string>& parts) {
    for (const char* name : {"csv", "switches", "summary"}) {
      const std::string option = std::string("--") + name;
      if (std::find(arguments.begin(), arguments.end(), option) == arguments.end()) {
        arguments.insert(arguments.end(), {option, folder_.path(name)});
      }
    }
    expect_refused(SIMULATE, arguments, parts);
  }

  TemporaryFolder folder_;
  std::string good_;
  int cases_ = 0;
};

TEST_F(ProgramsTest, SimulateRefusesBadOptions) {
  const std::vector<std::pair<std::string, std::string>> options = {{"--model", "rigid"},
                                                                    {"--model", ""},
                                                                    {"--model", "coul\nomb"},
                                                                    {"--model", std::string(10000, 'm')},
                                                                    {"--method", "leapfrog"},
                                                                    {"--method", ""},
                                                                    {"--method", "\033[31m"},
                                                                    {"--relative-tolerance", "0"},
                                                                    {"--relative-tolerance", "-1"},
                                                                    {"--relative-tolerance", "2"},
                                                                    {"--relative-tolerance", "nan"},
                                                                    {"--relative-tolerance", "inf"},
                                                                    {"--relative-tolerance", "1e-400"},
                                                                    {"--relative-tolerance", "x"},
                                                                    {"--relative-tolerance", ""},
                                                                    {"--relative-tolerance", "1e-5x"},
                                                                    {"--cpu-limit", "0"},
                                                                    {"--cpu-limit", "-1"},
                                                                    {"--cpu-limit", "nan"},
                                                                    {"--cpu-limit", "x"},
                                                                    {"--colour", "red"},
                                                                    {"--quiet", "twice"}};
  for (const auto& [option, value] : options) expect_simulate_refuses({good_, option, value}, {});
  expect_simulate_refuses({good_, "--relative-tolerance", "2"}, {"--relative-tolerance", "2", "1e-14 to 0.1"});
  for (const std::string value : {"x", "1e-5x", "0x1p-9", "1e-400", " 1e-5"}) {
    expect_simulate_refuses({good_, "--relative-tolerance", value},
                            {"--relative-tolerance = " + value + ": must be", "1e-14 to 0.1"});
    expect_simulate_refuses({good_, "--cpu-limit", value},
                            {"--cpu-limit = " + value + ": must be", "1e-09 to 1e+09 s"});
  }
  for (const std::string option : {"--relative-tolerance", "--cpu-limit"})
    expect_simulate_refuses({good_, option, ""}, {option + " = \"\": must not be empty"});
  expect_simulate_refuses({good_, "--csv", "-"}, {"standard output is /dev/stdout"});
  expect_simulate_refuses({good_, "--model", "rigid"}, {"model", "rigid", "no_slip, viscous or coulomb"});
  expect_simulate_refuses({good_, "--model", "coulomb", "--model", "viscous"}, {"--model"});
  expect_simulate_refuses({good_, "--contacts"}, {"--contacts", "--bag"});
  expect_simulate_refuses({good_, "--cvs", "x"}, {"--cvs", "; did you mean --csv?"});
  expect_simulate_refuses({folder_.write("x.bag", "#ROSBAG V2.0\n")}, {"is a bag, which analyse reads; must"});
  expect_simulate_refuses({good_, good_}, {"simulate"});
  expect_simulate_refuses({}, {"SCENE"});
  expect_simulate_refuses({""}, {});
  expect_simulate_refuses({folder_.path("missing\n.yaml")}, {"missing"});
  expect_simulate_refuses({folder_.path("folder")}, {"folder"});
  expect_simulate_refuses({folder_.write("idle.yaml", "duration: 1\n")}, {"drive"});
  expect_simulate_refuses({folder_.write("bad.yaml", "duration: -1\n")}, {"duration = -1"});
  expect_simulate_refuses(
      {folder_.write("long.yaml", "duration: 1e9\noutput_rate: 1e6\ndrive: {torque: [{start: 0}]}\n")}, {});
  EXPECT_GE(cases_, 30);
}

TEST_F(ProgramsTest, SimulateRefusesOutputsThatWouldDestroySomething) {
  const std::string scene = good_, table = folder_.path("table.csv");
  for (const char* option : {"--csv", "--switches", "--summary"}) {
    expect_simulate_refuses({good_, option, ""}, {option});
    expect_simulate_refuses({good_, option, scene}, {"good.yaml"});
    expect_simulate_refuses({good_, option, folder_.path("folder/../good.yaml")}, {"good.yaml"});
    for (const char* link : {"link.yaml", "hard.yaml"})
      expect_simulate_refuses({good_, option, folder_.path(link)}, {link});
    expect_simulate_refuses({good_, option, table}, {"table.csv"});
    expect_simulate_refuses({good_, option, folder_.path("folder")}, {"folder"});
    expect_simulate_refuses({good_, option, folder_.path("folder/")}, {"folder"});
    expect_simulate_refuses({good_, option, folder_.path("no/such/folder/x")}, {"no/such/folder"});
    expect_simulate_refuses({good_, option, "/proc/x"}, {"/proc/x"});
  }
  expect_simulate_refuses({good_, "--csv", folder_.path("switches")}, {"switches"});
  expect_simulate_refuses({good_, "--csv", folder_.path("folder/../switches")}, {"switches"});
  expect_simulate_refuses({good_, "--switches", folder_.path("link")}, {"link"});
  expect_simulate_refuses({good_, "--csv", folder_.path("new"), "--summary", folder_.path("./new")}, {"new"});
#ifdef YOUBOT_BASE_SIM_ROS
  expect_simulate_refuses({good_, "--bag", scene}, {"good.yaml"});
  expect_simulate_refuses({good_, "--bag", ""}, {"--bag"});
  expect_simulate_refuses({good_, "--bag", folder_.path("csv")}, {"csv"});
#endif
}

// What cannot be known before is found before anything runs, too: no other output is touched.
TEST_F(ProgramsTest, SimulateTouchesNothingWhereOneOutputCannotBeOpened) {
  for (const char* option : {"--csv", "--switches", "--summary"}) {
    for (const std::string path : {"no/such/folder/x", "csv/x", "loop"}) {
      SCOPED_TRACE(option + (" " + path));
      std::vector<std::string> arguments = {good_, option, folder_.path(path)};
      for (const char* name : {"csv", "switches", "summary"}) {
        if (option != std::string("--") + name)
          arguments.insert(arguments.end(), {"--" + std::string(name), folder_.path(name)});
      }
      const auto before = contents_of(folder_.path(""));
      Program run(SIMULATE, arguments);
      const int status = run.wait();
      EXPECT_TRUE(status == 1 || status == 2) << status;
      std::string err = run.err();
      EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
      EXPECT_NE(err.find(path.substr(0, 5)), std::string::npos) << err;
      EXPECT_TRUE(contents_of(folder_.path("")) == before) << "something was written or changed";
    }
  }
}

// Where nobody can hear it, the exit status tells.
TEST_F(ProgramsTest, RefuseWhereStandardErrorIsFull) {
  for (const std::string command : {SIMULATE " /nowhere", SIMULATE " --colour", DESCRIBE_BASE " /nowhere"}) {
    EXPECT_EQ(Program("/bin/sh", {"-c", "exec " + command + " 2> /dev/full"}).wait(), 2) << command;
  }
}

#ifdef IDENTIFY
TEST_F(ProgramsTest, IdentifyRefuses) {
  const std::string bag = folder_.write("no.bag", "not a bag\n");
  expect_refused(IDENTIFY, {}, {"TABLE"});
  expect_refused(IDENTIFY, {""}, {"table", "must not be empty"});
  expect_refused(IDENTIFY, {bag, "--name", "a", "--name", "b"}, {"--name", "once for each table"});
  expect_refused(IDENTIFY, {"--col\nour"}, {"--col"});
  expect_refused(IDENTIFY, {bag, "--scene", ""}, {"--scene", "must not be empty"});
  expect_refused(IDENTIFY, {bag, "--output", ""}, {"--output", "must not be empty"});
  expect_refused(IDENTIFY, {bag, "--csv", ""}, {"--csv", "must not be empty"});
  expect_refused(IDENTIFY, {bag, "--scene", folder_.path("missing")}, {"missing"});
  for (const std::string& path : {bag, folder_.path("folder"), folder_.path("missing"), std::string("/dev/zero")}) {
    expect_refused(IDENTIFY, {path, "--csv", folder_.path("csv")}, {path});
  }
  expect_refused(IDENTIFY, {bag, "--output", bag}, {"--output", "no.bag", "read"});
  expect_refused(IDENTIFY, {bag, "--csv", bag}, {"--csv", "no.bag", "read"});
  expect_refused(IDENTIFY, {bag, "--scene", good_, "--output", good_}, {"--output", "good.yaml", "read"});
  expect_refused(IDENTIFY, {bag, "--output", folder_.path("new.csv")}, {"new.csv", "the file of --output"});
  expect_refused(IDENTIFY, {bag, "-o", folder_.path("new.yaml"), "--csv", folder_.path("new.csv")},
                 {"--csv", "new.csv"});
  expect_refused(IDENTIFY, {bag, "-o", folder_.path("no/such/folder")}, {"no/such"});
}
#endif

TEST_F(ProgramsTest, DescribeBaseRefuses) {
  expect_refused(DESCRIBE_BASE, {"--colour"}, {"describe_base: ", "--colour"});
  expect_refused(DESCRIBE_BASE, {"--two\nlines\x1b"}, {"--two\\nlines\\x1b"});
  expect_refused(DESCRIBE_BASE, {good_, good_}, {"--help"});
  expect_refused(DESCRIBE_BASE, {"--turning-rollers", "--turning-rollers"}, {"turning-rollers"});
  expect_refused(DESCRIBE_BASE, {"--turning-rollers=3"}, {"turning-rollers"});
  expect_refused(DESCRIBE_BASE, {folder_.path("missing.yaml")}, {"missing.yaml"});
  expect_refused(DESCRIBE_BASE, {folder_.path("folder")}, {"is a folder; must be a scene file"});
  expect_refused(DESCRIBE_BASE, {"/dev/zero"}, {"/dev/zero"});
  expect_refused(DESCRIBE_BASE, {"--meshes", "/dev/null/meshes"}, {"/dev/null/meshes"});
  expect_refused(DESCRIBE_BASE, {"--meshes", ""}, {"--meshes = \"\": must not be empty"});
  expect_refused(DESCRIBE_BASE, {"", "--meshes", ""}, {"--meshes = \"\": must not be empty"});
  expect_refused(DESCRIBE_BASE, {folder_.path("mis\nsing")}, {"mis"});
  expect_refused(DESCRIBE_BASE, {folder_.write("bad.yaml", "duration: 1\nrobot: {wheel_radius: -1}\n")},
                 {"robot.wheel_radius", "-1", "must be"});
  expect_refused(DESCRIBE_BASE, {folder_.write("text", "not a scene\n")}, {"text"});
}

}  // namespace
}  // namespace youbot_base_sim
