// Every parameter of base_node with every kind of wrong value: each is refused in one line that names it, its value and
// what is allowed. The parameters are those that the refusal of an unknown one lists.

#include <gtest/gtest.h>
#include <ros/ros.h>

#include <cmath>
#include <limits>
#include <regex>

#include "promises/refusals.h"
#include "rostest_main.h"
#include "youbot_base_sim/ros/base_settings.h"
#include "youbot_base_sim/ros/parameters.h"
#include "youbot_base_sim/text/text_file.h"

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

// As launch files pass on what nobody has set.
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

// A base name is any text as long as there is no folder to look for it in.
TEST_F(RefusedParameters, texts_that_mean_nothing) {
  for (const std::string& name : names_) {
    if (name == "youBotBaseName") continue;
    // No other control characters than these reach the parameter server: XML has none.
    for (const std::string& value : {std::string("often"), std::string("two\nlines\r\t"), std::string(10000, 'x')}) {
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

// What the launch files pass on: all of them.
TEST_F(RefusedParameters, are_arguments_of_the_launch_files) {
  for (const std::string file : {"base.launch", "youbot_driver.launch"}) {
    const std::string text = read_text_file(YOUBOT_BASE_SIM_SOURCE_DIR "/launch/" + file, 1 << 20);
    for (const std::string& name : names_) {
      if (name[0] != '~') continue;
      const std::string argument = name == "~bag" ? "node_bag" : name.substr(1);
      EXPECT_NE(text.find("<arg name=\"" + argument + "\" default="), std::string::npos) << argument << " in " << file;
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim

YOUBOT_BASE_SIM_ROSTEST_MAIN()
