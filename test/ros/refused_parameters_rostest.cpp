// Every parameter of base_node with every kind of wrong value: each is refused in one line that names it, its value and
// what is allowed. The parameters are those that the refusal of an unknown one lists.

#include <gtest/gtest.h>
#include <ros/ros.h>

#include <cmath>
#include <limits>
#include <regex>
#include <set>

#include "program.h"
#include "promises/refusals.h"
#include "rostest_main.h"
#include "temporary_folder.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/program.h"

namespace youbot_base_sim {
namespace {

/// The line that refuses the parameters as they are set; empty if they are accepted.
std::string refusal() {
  try {
    read_base_settings();
  } catch (const ParameterError& error) {
    return error.what();
  }
  return "";
}

/// The same with one more parameter.
template <class Value>
std::string refusal_of(const std::string& name, const Value& value) {
  ros::param::set(name, value);
  const std::string line = refusal();
  ros::param::del(name);
  return line;
}

class RefusedParameters : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const std::string line = refusal_of("~no_such_parameter", 1);
    std::istringstream list(std::regex_replace(line.substr(line.find("known are:") + 10), std::regex(","), " "));
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
  const std::set<std::string> frames = {"~tf_prefix", "~odom_frame", "~base_frame", "~world_frame"};
  for (const std::string& name : names_) {
    if (name == "youBotBaseName" || name == "~bag") continue;
    const std::string word = frames.count(name) ? "often//here" : "often";
    // No other control characters than these reach the parameter server: XML has none.
    for (const std::string& value : {word, std::string("two\nlines\r\t"), std::string(10000, 'x')}) {
      SCOPED_TRACE(name + " = " + value.substr(0, 20));
      expect_refusal(refusal_of(name, value), {name});
    }
  }
}

TEST_F(RefusedParameters, names_that_are_unknown) {
  for (const std::string name : {"~publsh_rate", "~Scene", "~scene_", "~bags/all", "~x"}) {
    SCOPED_TRACE(name);
    expect_refusal(refusal_of(name, 1), {"unknown", "publish_rate"});
  }
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

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
