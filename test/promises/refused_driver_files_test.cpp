// Every key of the driver's configuration file with every kind of wrong value. The keys are those whose lack is
// refused.

#include <gtest/gtest.h>

#include <boost/property_tree/ini_parser.hpp>
#include <cmath>
#include <regex>

#include "errors.h"
#include "refusals.h"
#include "youbot_base_sim/drive/driver_configuration.h"

namespace youbot_base_sim {
namespace {

using Tree = boost::property_tree::ptree;

struct Key {
  std::string section, name;
};

class DriverFilesTest : public testing::Test {
 protected:
  void SetUp() override {
    boost::property_tree::read_ini(YOUBOT_BASE_SIM_SOURCE_DIR "/config/youbot-base.cfg", ours_);
    Tree tree;
    std::smatch found;
    for (std::string line;
         line = refusal(tree), std::regex_search(line, found, std::regex("\\[(.*?)\\] (\\S+) is missing"));) {
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
    return error_of<DriverConfigurationError>([&] { load_driver_configuration(folder_.path(""), name); });
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
    expect_refusal(refusal_of_file(name), {});
  }
}

}  // namespace
}  // namespace youbot_base_sim
