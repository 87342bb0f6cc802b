// The driver's configuration file: what is read of it, and every key of it with every kind of wrong value.

#include "youbot_base_sim/scene/driver_configuration.h"

#include <gtest/gtest.h>

#include <boost/property_tree/ini_parser.hpp>
#include <cmath>
#include <regex>

#include "errors.h"
#include "limits_table.h"
#include "promises/refusals.h"

namespace youbot_base_sim {
namespace {

constexpr char kFolder[] = YOUBOT_BASE_SIM_SOURCE_DIR "/config";

/// Loads the repository's file after one text in it is replaced by another.
class DriverConfigurationTest : public ::testing::Test {
 protected:
  DriverConfiguration load_with(const std::string& from, const std::string& to) {
    std::ostringstream text;
    text << std::ifstream(std::string(kFolder) + "/youbot-base.cfg").rdbuf();
    std::string changed = text.str();
    const std::size_t at = changed.find(from);
    if (at == std::string::npos) throw std::logic_error(from + " is not in the file");
    changed.replace(at, from.size(), to);
    folder_.write("changed.cfg", changed);
    return load_driver_configuration(folder_.path(""), "changed");
  }

  void expect_refused(const std::string& from, const std::string& to, const std::vector<std::string>& words) {
    const std::string error = error_of<SceneError>([&] { load_with(from, to); });
    EXPECT_NE(error, "") << to;
    expect_words(error, words);
  }

  TemporaryFolder folder_;
};

TEST_F(DriverConfigurationTest, FileOfTheRepositoryHasTheDefaults) {
  const DriverConfiguration read = load_driver_configuration(kFolder, "youbot-base");
  EXPECT_EQ(read.motor.gear_ratio, Motor().gear_ratio);
  EXPECT_EQ(read.motor.encoder_ticks, Motor().encoder_ticks);
  EXPECT_EQ(read.motor.torque_constant, Motor().torque_constant);
  EXPECT_EQ(read.kinematics.wheel_radius, DriverKinematics().wheel_radius);
  EXPECT_EQ(read.kinematics.half_lengths, DriverKinematics().half_lengths);
}

TEST_F(DriverConfigurationTest, ReadsTheNumbersOfTheFile) {
  EXPECT_EQ(load_with("WheelRadius_[meter] = 0.0475", "WheelRadius_[meter] = 0.05").kinematics.wheel_radius, 0.05);
  EXPECT_EQ(load_with("LengthBetweenFrontWheels_[meter] = 0.3", "LengthBetweenFrontWheels_[meter] = 0.33")
                .kinematics.half_lengths,
            0.4);
}

TEST_F(DriverConfigurationTest, RefusesWhatTheDriverCannotHave) {
  expect_refused("SlideRatio = 1", "SlideRatio = 2", {"SlideRatio", "2", "1"});
  expect_refused("GearRatio_numerator = 364", "GearRatio_numerator = 300", {"Joint_2", "Joint_1"});
  expect_refused("[Joint_1]", "[Joint_1", {"changed.cfg", "line"});
}

TEST_F(DriverConfigurationTest, EveryNumberHasTheLimitsThatTheDocumentationTells) {
  // From "KEY = " to the end of the line stands the number that is replaced, in all sections that have the key.
  const auto with = [&](const std::string& key, const std::string& value) {
    std::istringstream old(folder_.read("whole.cfg"));
    std::string text;
    for (std::string line; std::getline(old, line);) {
      text += (line.rfind(key + " = ", 0) == 0 ? key + " = " + value : line) + "\n";
    }
    folder_.write("changed.cfg", text);
    return error_of<SceneError>([&] { load_driver_configuration(folder_.path(""), "changed"); });
  };
  std::ifstream file(std::string(kFolder) + "/youbot-base.cfg");
  std::ostringstream whole;
  whole << file.rdbuf();
  folder_.write("whole.cfg", whole.str());

  const std::vector<Limits> rows = limits("driver");
  ASSERT_EQ(rows.size(), 7u);
  for (const Limits& row : rows) {
    std::vector<std::string> beyond = row.beyond();
    beyond.insert(beyond.end(), {"nan", "inf", "1x", ""});
    for (const std::string& value : beyond) {
      const std::string message = with(row.key, value);
      EXPECT_NE(
          message.find("." + row.key + " = " + (value.empty() ? "\"\"" : value) + ": must be a finite number > 0"),
          std::string::npos)
          << row.key << " = " << value << ": " << message;
    }
    for (const std::string& value : row.ends()) {
      EXPECT_EQ(with(row.key, value).find("must be a finite number"), std::string::npos) << row.key << " = " << value;
    }
  }
  EXPECT_NE(with("GearRatio_denominator", "9e5").find("GearRatio_numerator = 364: must be such that the ratio"),
            std::string::npos);
}

TEST_F(DriverConfigurationTest, QuotesWhatStandsInTheFile) {
  expect_refused("SlideRatio = 1", "SlideRatio = \x1b[31m" + std::string(500'000, 'x'), {"SlideRatio = \\x1b[31mxxx"});
  expect_refused("[Joint_1]", std::string(1'000'000, ';'), {"longer than 1000000 bytes"});
}

using Tree = boost::property_tree::ptree;

struct Key {
  std::string section, name;
};

/// The keys are those whose lack is refused.
class DriverFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    boost::property_tree::read_ini(kFolder + std::string("/youbot-base.cfg"), ours_);
    Tree tree;
    std::smatch found;
    for (std::string line;
         line = refusal(tree), std::regex_search(line, found, std::regex(": (\\w+)\\.(\\S+) is left out"));) {
      keys_.push_back({found[1], found[2]});
      put(tree, keys_.back(), value(keys_.back()));
      ASSERT_LE(keys_.size(), 1000u);
    }
    EXPECT_EQ(refusal(tree), "");
    good_ = tree;
  }

  static Tree::path_type path(const Key& key) { return Tree::path_type(key.section + "/" + key.name, '/'); }
  static void put(Tree& tree, const Key& key, const std::string& value) { tree.put(path(key), value); }
  std::string value(const Key& key) const { return ours_.get<std::string>(path(key)); }

  std::string refusal(const Tree& tree) {
    boost::property_tree::write_ini(folder_.path("base.cfg"), tree);
    return refusal_of_file("base");
  }

  std::string refusal_of_file(const std::string& name) {
    return error_of<SceneError>([&] { load_driver_configuration(folder_.path(""), name); });
  }

  Tree ours_, good_;
  std::vector<Key> keys_;
  TemporaryFolder folder_;
};

TEST_F(DriverFilesTest, RefuseWhatIsOfNoUse) {
  EXPECT_GE(keys_.size(), 5u + 4 * 5);
  int cases = 0;
  for (const Key& key : keys_) {
    for (const std::string value : {"", "x", "0", "-1", "nan", "inf", "-inf", "1e400", "1e308", "1e-320", "3 4", "1,5",
                                    "0x", "0x10", "1e", "\033[31m1", "true?"}) {
      SCOPED_TRACE(key.section + " " + key.name + " = " + value);
      Tree tree = good_;
      put(tree, key, value);
      expect_refusal(refusal(tree), {"base.cfg", key.section, key.name, "must be"});
      ++cases;
    }
    SCOPED_TRACE(key.section + " " + key.name + " is too long");
    Tree tree = good_;
    put(tree, key, std::string(100000, '7') + "x");
    expect_refusal(refusal(tree), {"base.cfg", key.name});
  }
  EXPECT_GE(cases, 400);
}

TEST_F(DriverFilesTest, RefuseFilesThatAreNone) {
  for (const std::string& text :
       std::vector<std::string>{"", "\n", "[", "[a]\n[a]\n", "[Joint_1\n", "x\n", "=\n", "a=1\na=2\n",
                                "[a]\nx = 1\nx = 2\n", std::string(1000, '\0'),
                                "\x7F"
                                "ELF\n",
                                "\033[31mred\n", std::string(100000, 'x'), "[" + std::string(100000, 's') + "]\n"}) {
    SCOPED_TRACE(text.substr(0, 80));
    folder_.write("broken.cfg", text);
    expect_refusal(refusal_of_file("broken"), {"broken.cfg"});
  }
  std::filesystem::create_directory(folder_.path("folder.cfg"));
  for (const std::string name : {"folder", "missing", "mis\nsing", "/dev/null"}) {
    SCOPED_TRACE(name);
    expect_refusal(refusal_of_file(name), {name.substr(0, 3), ".cfg: "});
  }
}

}  // namespace
}  // namespace youbot_base_sim
