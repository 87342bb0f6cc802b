// What is configured wrongly is refused: exit status 2 and one line that names the parameter, its value and what is
// allowed.

#include <nav_msgs/Odometry.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <regex>
#include <set>

#include "errors.h"
#include "program.h"
#include "promises/refusals.h"
#include "rostest.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/program.h"

namespace youbot_base_sim {
namespace {

BaseSettings read_base_settings() {
  return youbot_base_sim::read_base_settings({ros::NodeHandle("~"), "~"}, {ros::NodeHandle(), ""});
}

/// The line that refuses the parameters as they are set; empty if they are accepted.
std::string refusal() {
  return error_of<ParameterError>([] { read_base_settings(); });
}

/// The same with one more parameter.
template <class Value>
std::string refusal_of(const std::string& name, const Value& value) {
  ros::param::set(name, value);
  const std::string line = refusal();
  ros::param::del(name);
  return line;
}

/// Every parameter of base_node with every kind of wrong value. The parameters are those that the refusal of an unknown
/// one lists.
class RefusedParameters : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string line = refusal_of("~no_such_parameter", 1);
    std::istringstream list(std::regex_replace(line.substr(line.find("known:") + 6), std::regex(","), " "));
    for (std::string name; list >> name;) names_.push_back("~" + name);
    ASSERT_GE(names_.size(), 20u) << line;
    for (const char* name : {"youBotHasBase", "youBotHasArms", "youBotDriverCycleFrequencyInHz",
                             "youBotConfigurationFilePath", "youBotBaseName"}) {
      names_.push_back(name);
    }
  }

  static std::vector<std::string> names_;
};

std::vector<std::string> RefusedParameters::names_;

TEST_F(RefusedParameters, none_by_default) { EXPECT_EQ(refusal(), ""); }

TEST_F(RefusedParameters, none_and_each_control_period_takes_commands_in_lockstep) {
  for (const char* name : {"~publish_clock", "~lockstep"}) ros::param::set(name, true);
  ros::param::set("~command_rate", 50);
  EXPECT_EQ(read_base_settings().command_rate, 0);
  for (const char* name : {"~publish_clock", "~lockstep", "~command_rate"}) ros::param::del(name);
}

// As launch files pass on arguments that are not given.
TEST_F(RefusedParameters, none_that_is_unset) {
  for (const std::string& name : names_) {
    for (const std::string text : {"unset", ""}) EXPECT_EQ(refusal_of(name, text), "") << name;
  }
}

// To YAML, and so to roslaunch and rosparam, 1e-4 is a text.
TEST_F(RefusedParameters, no_text_that_is_a_number_in_range) {
  EXPECT_EQ(refusal_of("~relative_tolerance", std::string("1e-4")), "");
  expect_refusal(refusal_of("~relative_tolerance", std::string("1e4")), {"~relative_tolerance", "1e4", "must be"});
}

TEST_F(RefusedParameters, lists_and_structures) {
  for (const std::string& name : names_) {
    SCOPED_TRACE(name);
    expect_refusal(refusal_of(name, std::vector<double>{1, 2}), {name, "must be"});
    expect_refusal(refusal_of(name, std::map<std::string, double>{{"a", 1}}), {name, "must be"});
  }
}

TEST_F(RefusedParameters, numbers_beyond_all_ends) {
  const double huge = std::numeric_limits<double>::max(), inf = std::numeric_limits<double>::infinity();
  int cases = 0;
  for (const std::string& name : names_) {
    for (const double value : {-huge, huge, inf, -inf, std::nan(""), -1e-320, 1e7}) {
      SCOPED_TRACE(name + " = " + std::to_string(value).substr(0, 20));
      expect_refusal(refusal_of(name, value), {name, "must be"});
      ++cases;
    }
  }
  EXPECT_GE(cases, 100);
}

// A base name is any text as long as there is no folder to look for it in, and a bag may have any name. A word may be a
// frame.
TEST_F(RefusedParameters, texts_that_mean_nothing) {
  const std::set<std::string> frames = {"~tf_prefix", "~odom_frame", "~base_frame", "~world_frame", "~map_frame"};
  for (const std::string& name : names_) {
    if (name == "youBotBaseName" || name == "~bag") continue;
    const std::string word = frames.count(name) ? "often//here" : "often";
    // No other control characters than these reach the parameter server: XML has none.
    // Of a long text the beginning is shown, or the end where it may be a file.
    for (const auto& [value, shown] :
         {std::pair(word, word), {"two\nlines\r\t", "two\\nlines"}, {std::string(10000, 'x'), std::string(40, 'x')}}) {
      SCOPED_TRACE(name + " = " + value.substr(0, 20));
      expect_refusal(refusal_of(name, value), {name, shown});
    }
  }
}

TEST_F(RefusedParameters, names_that_are_unknown) {
  for (const std::string name : {"~publsh_rate", "~Scene", "~scene_", "~bags/all", "~x"}) {
    SCOPED_TRACE(name);
    expect_refusal(refusal_of(name, 1), {name.substr(0, name.find('/')), "unknown", "publish_rate"});
  }
  expect_refusal(refusal_of("~publsh_rate", 1), {"; did you mean publish_rate?"});
  for (const auto& [name, wrong, right] : {std::tuple("~joint_velocity_sign", "consistant", "consistent"),
                                           {"~model", "colomb", "coulomb"},
                                           {"~profile", "measure", "measured"}}) {
    expect_refusal(refusal_of(name, std::string(wrong)), {name, wrong, std::string("; did you mean ") + right + "?"});
  }
}

TEST_F(RefusedParameters, are_in_the_help_with_default_and_unit) {
  std::string help;
  for (const char* path : {BASE_NODE, PLAY_SCENE}) {
    Program program("/usr/bin/env", {"-u", "ROS_MASTER_URI", path, "--help"});
    EXPECT_EQ(program.wait(), 0) << program.err();
    help += program.out();
  }
  for (const std::string& name : names_) EXPECT_NE(help.find("\n  " + name + " "), std::string::npos) << name << help;
  for (const char* line : {"~publish_rate +50 .* Hz", "~joint_velocity_sign +driver_exact +consistent or driver_exact",
                           "~control_period +the scene's .*10 s", "~imu_position +\\[0, 0, 0\\] .* m\n",
                           "~friction_scale +1 .*1000\n", "~duration +the scene's .* s\n"}) {
    EXPECT_TRUE(std::regex_search(help, std::regex(line))) << line << help;
  }
}

TEST_F(RefusedParameters, are_in_the_table_of_docs) {
  std::ifstream table(YOUBOT_BASE_SIM_SOURCE_DIR "/docs/node/parameters.csv");
  std::set<std::string> rows;
  std::string row;
  for (std::getline(table, row); std::getline(table, row);) rows.insert(row.substr(0, row.find(',')));
  EXPECT_EQ(rows, std::set<std::string>(names_.begin(), names_.end()));
}

TEST_F(RefusedParameters, frames_that_make_a_loop) {
  for (const std::string name : {"~base_frame", "~world_frame"}) {
    expect_refusal(refusal_of(name, std::string("odom")), {"~odom_frame", "\"odom\"", "loop"});
  }
  expect_refusal(refusal_of("~base_frame", std::string("world")), {"~base_frame", "another"});
  for (const std::string name : {"/", "odom/", "my odom", "odom?"}) {
    expect_refusal(refusal_of("~odom_frame", name), {"~odom_frame", name, "must be a frame"});
  }
}

TEST_F(RefusedParameters, lists_of_another_length_or_with_another_thing) {
  const std::vector<double> three = {1, 2, 3}, four = {1, 2, 3, 4}, far = {1, 2, 1e7};
  EXPECT_EQ(refusal_of("~initial_pose", three), "");
  EXPECT_EQ(refusal_of("~initial_wheel_angles", four), "");
  EXPECT_EQ(refusal_of("~imu_position", three), "");
  expect_refusal(refusal_of("~imu_position", four), {"~imu_position", "a list of 3 numbers"});
  expect_refusal(refusal_of("~initial_pose", four), {"~initial_pose", "a list of 3 numbers"});
  expect_refusal(refusal_of("~initial_wheel_angles", three), {"~initial_wheel_angles", "a list of 4 numbers"});
  expect_refusal(refusal_of("~initial_pose", far), {"~initial_pose", "1e+06"});
  expect_refusal(refusal_of("~initial_pose", std::vector<std::string>{"1", "2", "east"}), {"~initial_pose", "east"});
}

TEST_F(RefusedParameters, none_that_the_nearest_namespace_has_for_frames) {
  ros::param::set("/tf_prefix", std::string("/robot"));
  ros::param::set("~base_frame", std::string("/base"));
  const FrameNames frames = read_base_settings().telemetry.frames;
  ros::param::del("/tf_prefix");
  ros::param::del("~base_frame");
  EXPECT_EQ(frames.odom, "robot/odom");
  EXPECT_EQ(frames.base, "base") << "a name with a slash goes without the prefix";
  EXPECT_EQ(frames.world, "world");
  EXPECT_EQ(frames.truth, "robot/ground_truth/base");
  EXPECT_EQ(frames.wheel_link(0), "robot/wheel_link_fl");
}

/// The parameters that a launch file sets with these arguments, as "/node/name: value".
std::string parameters_of(const std::string& launch_file, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"roslaunch", "--dump-params", "youbot_base_sim", launch_file});
  Program roslaunch("/usr/bin/env", arguments);
  EXPECT_EQ(roslaunch.wait(), 0) << roslaunch.err();
  return "\n" + roslaunch.out();
}

// Any of them, in place of what the launch file itself says.
TEST_F(RefusedParameters, stand_in_the_file_of_the_launch_files) {
  std::string yaml;
  const TemporaryFolder folder;
  int value = 1000;
  for (const std::string& name : names_) {
    if (name[0] == '~') yaml += name.substr(1) + ": " + std::to_string(++value) + "\n";
  }
  const std::string argument = "params:=" + folder.write("every.yaml", yaml);
  for (const auto& [file, node] :
       {std::pair("base.launch", "/base_node/"), std::pair("youbot_driver.launch", "/youbot_driver/")}) {
    const std::string set = parameters_of(file, {argument, "scene:=unset", "lockstep:=true"});
    std::istringstream lines(yaml);
    for (std::string line; std::getline(lines, line);) {
      EXPECT_NE(set.find("\n" + (node + line) + "\n"), std::string::npos) << line << " by " << file;
    }
  }
}

TEST_F(RefusedParameters, are_arguments_of_the_launch_files_where_they_are_used_most) {
  const std::string scene = YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml";
  const std::vector<std::string> arguments = {"profile: measured",     "publish_clock: true",  "real_time_factor: 0.5",
                                              "lockstep: true",        "lockstep_period: 0.5", "lockstep_timeout: 2",
                                              "publish_contacts: true"};
  std::vector<std::string> given = {"scene:=" + scene};
  for (const std::string& one : arguments) given.push_back(std::regex_replace(one, std::regex(": "), ":="));
  for (const auto& [file, node] :
       {std::pair("base.launch", "/base_node/"), std::pair("youbot_driver.launch", "/youbot_driver/")}) {
    const std::string set = parameters_of(file, given);
    for (const std::string& one : arguments) {
      EXPECT_NE(set.find("\n" + (node + one) + "\n"), std::string::npos) << one << " by " << file << set;
    }
    EXPECT_NE(set.find("\n" + (node + ("scene: " + scene)) + "\n"), std::string::npos) << set;
  }
}

constexpr char kPlayedScene[] = "_scene:=" YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml";

class WrongConfiguration : public ::testing::Test {
 protected:
  void TearDown() override { ros::param::del("/use_sim_time"); }

  /// Runs a program under a name of its own, so that it finds no parameters of another run.
  void expect_refused(const std::string& program, std::vector<std::string> arguments,
                      const std::vector<std::string>& words) {
    static int number = 0;
    arguments.push_back("__name:=refused_" + std::to_string(++number));
    Program process(program, arguments);
    EXPECT_EQ(process.wait(), 2);
    expect_words(process.out() + process.err(), words);
  }

  TemporaryFolder folder_;
};

TEST_F(WrongConfiguration, ends_the_node) { expect_refused(BASE_NODE, {"_publish_rate:=2000"}, {"~publish_rate"}); }

// Values of no use to any parameter are above.
TEST_F(WrongConfiguration, value_out_of_range) {
  expect_words(refusal_of("~publish_rate", 2000), {"~publish_rate", "2000", "1000 Hz"});
  expect_words(refusal_of("~publish_rate", 0.0001), {"~publish_rate", "0.0001", "from 0.001"});
  expect_words(refusal_of("~command_rate", 0.01), {"~command_rate", "0.01", "0 or from 0.1 to 1000 Hz"});
  expect_words(refusal_of("~control_period", 0.2), {"~control_period", "0.2", "less than 0.02816 s"});
  expect_words(refusal_of("~scene", "/nowhere/scene.yaml"), {"~scene", "/nowhere/scene.yaml"});
  const std::string slow = folder_.write("slow.yaml", "duration: 1.0\nsolver: {control_period: 100.0}\n");
  expect_words(refusal_of("~scene", slow), {"~scene", "control_period", "100"});
}

TEST_F(WrongConfiguration, parameter_of_the_driver) {
  expect_words(refusal_of("/youBotHasBase", false), {"youBotHasBase", "false", "true"});
  expect_words(refusal_of("/youBotDriverCycleFrequencyInHz", 2000.0),
               {"youBotDriverCycleFrequencyInHz", "2000", "1000 Hz: at most once a control period"});
  expect_words(refusal_of("/youBotConfigurationFilePath", "/nowhere"),
               {"youBotConfigurationFilePath", "/nowhere/youbot-base.cfg"});
}

TEST_F(WrongConfiguration, of_motors) {
  ros::param::set("~profile", "paper");
  expect_words(refusal_of("~friction_scale", 2), {"~friction_scale", "2", "profile = measured"});
  ros::param::del("~profile");
  expect_words(refusal_of("~command_rate", 1001), {"~command_rate", "1001", "1000 Hz"});
}

// A scene means what it means offline.
TEST_F(WrongConfiguration, none_is_a_real_base_by_default) {
  const BaseSettings settings = read_base_settings();
  EXPECT_TRUE((settings.scene.robot.dry_friction == measured_robot().dry_friction).all());
  EXPECT_EQ(settings.command_rate, 50);
  EXPECT_TRUE(settings.telemetry.driver_velocity_sign);
  ros::param::set("~scene", folder_.write("scene.yaml", "model: coulomb\n"));
  EXPECT_TRUE((read_base_settings().scene.robot.dry_friction == 0).all());
  ros::param::del("~scene");
}

TEST_F(WrongConfiguration, clock_of_its_own_but_not_its_master) {
  expect_words(refusal_of("~lockstep", true), {"~lockstep", "~publish_clock"});
  expect_words(refusal_of("~lockstep_period", 0.02), {"~lockstep_period", "0.02", "~lockstep"});
  expect_words(refusal_of("~lockstep_period", 0.0015), {"~lockstep_period", "0.0015", "multiple", "0.001 s"});
  expect_words(refusal_of("~end_with_commands", true), {"~end_with_commands", "~lockstep"});
  expect_words(refusal_of("~wait_for", std::vector<std::string>{"a"}), {"~wait_for", "a list", "~lockstep"});
  expect_words(refusal_of("~start_paused", true), {"~start_paused", "~publish_clock"});
  expect_words(refusal_of("~real_time_factor", 2), {"~real_time_factor", "2", "~publish_clock"});
  expect_words(refusal_of("~real_time_factor", 1e-300), {"~real_time_factor", "0 or from 0.001"});
  ros::param::set("~lockstep", true);
  expect_words(refusal_of("~lockstep_timeout", 0), {"~lockstep_timeout", "0", "~lockstep_period"});
  ros::param::del("~lockstep");
}

TEST_F(WrongConfiguration, bag_that_cannot_be_written) {
  expect_refused(BASE_NODE, {"_bag:=/nowhere/x.bag"}, {"~bag", "/nowhere/x.bag"});  // by the wall clock
  expect_refused(BASE_NODE, {"_bag:=" + folder_.path("")}, {"~bag", folder_.path("")});
  ros::param::set("/use_sim_time", true);
  expect_refused(BASE_NODE, {"_bag:=/nowhere/x.bag"}, {"~bag", "/nowhere/x.bag"});  // by /clock, which does not come
  expect_refused(BASE_NODE, {"_publish_clock:=true", "_bag:=/nowhere/x.bag"}, {"~bag", "/nowhere/x.bag"});
  const std::string scene = folder_.write("scene.yaml", "duration: 1.0\n");
  expect_refused(BASE_NODE, {"_publish_clock:=true", "_scene:=" + scene, "_bag:=" + scene},
                 {"~bag", scene, "must not be a file that is read"});
  EXPECT_EQ(folder_.read("scene.yaml"), "duration: 1.0\n");
}

TEST_F(WrongConfiguration, argument) {
  for (const char* argument : {"fast", "--unknown"}) expect_refused(BASE_NODE, {argument}, {argument, "--help"});
}

TEST_F(WrongConfiguration, nothing_to_play) {
  expect_refused(PLAY_SCENE, {}, {"~scene", "missing"});
  ros::param::set("/use_sim_time", true);
  const std::string idle = folder_.write("idle.yaml", "duration: 1.0\n");
  expect_refused(PLAY_SCENE, {"_scene:=" + idle}, {"~scene", idle, "drive"});
}

TEST_F(WrongConfiguration, no_clock_to_play_by) { expect_refused(PLAY_SCENE, {kPlayedScene}, {"/use_sim_time"}); }

TEST_F(WrongConfiguration, player_without_a_base_fails_rather_than_waits) {
  ros::param::set("/use_sim_time", true);
  bool started = false;
  ros::NodeHandle node;
  const ros::Subscriber subscriber = node.subscribe<nav_msgs::Odometry>(
      "odom", 1, [&](const nav_msgs::Odometry::ConstPtr& message) { started = message->twist.twist.linear.x != 0; });
  Program base(BASE_NODE, {"_publish_clock:=true", "_lockstep:=true", "__name:=doomed"});
  Program player(PLAY_SCENE, {kPlayedScene, "_duration:=1e6"});
  wait_for("the base to go", [&] { return started; });
  base.kill();
  EXPECT_EQ(player.wait(), 1) << player.err();
  EXPECT_NE((player.out() + player.err()).find("/doomed is gone"), std::string::npos) << player.err();
  base.wait();
}

}  // namespace
}  // namespace youbot_base_sim

int main(int argc, char** argv) { return youbot_base_sim::run_rostest(argc, argv); }
