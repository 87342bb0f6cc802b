// Every key of a scene with every kind of wrong value, broken files and tables: each is refused in one line that names
// the key, its value and what is allowed, and changes nothing. The keys are those that the refusal of an unknown one
// lists, so that a new key is tried as soon as it is read.

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <regex>
#include <set>

#include "errors.h"
#include "limits_table.h"
#include "refusals.h"
#include "scene_keys.h"
#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/simulation.h"
#include "youbot_base_sim/text/text_file.h"

namespace youbot_base_sim {
namespace {

class ScenesTest : public testing::Test {
 protected:
  /// The line that refuses the scene; empty if it is accepted.
  std::string refusal(const std::string& text) { return refusal_of_file(folder_.write("scene.yaml", text)); }

  static std::string refusal_of_file(const std::string& path) {
    return error_of<SceneError>([&] { load_scene(path); });
  }

  TemporaryFolder folder_;
};

/// What stands where, besides one key: whatever makes a scene complete.
std::string around(const std::string& path) {
  std::string text;
  if (path != "duration") text += "duration: 1\n";
  if (path.rfind("drive", 0) != 0) text += "drive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n";
  return text;
}

/// What must stand in the section besides the key.
std::string beside(const std::string& section, const std::string& key) {
  std::string text;
  const bool motion = section == "drive.reference_motion", torque = section == "drive.torque[0]";
  if (torque && key != "start") text += "start: 0, ";
  if (section == "robot.profile" && key != "name") text += "name: measured, ";
  if ((torque || motion) && key != "period") text += "period: 1, ";
  return text;
}

/// A scene with the key at `path`, "robot.com" or "drive.torque[0].start", set to what `value` says in YAML.
std::string scene_with(const std::string& path, const std::string& value) {
  std::string section, open, close;
  std::istringstream keys(path);
  for (std::string key; std::getline(keys, key, '.'); section += (section.empty() ? "" : ".") + key) {
    if (!section.empty()) {
      open += "{" + beside(section, key);
      close = "}" + close;
    }
    const bool listed = key.back() == ']';
    open += (listed ? key.substr(0, key.size() - 3) : key) + ": " + (listed ? "[" : "");
    if (listed) close = "]" + close;
  }
  return around(path) + open + value + close + "\n";
}

/// A key of a scene and what it must be, in the words of its refusal.
struct Key {
  std::string path, allowed;
};

class KeysTest : public ScenesTest {
 protected:
  /// Names of the keys that may stand in the section at `path`; empty for the whole file.
  std::vector<std::string> keys_in(const std::string& path) {
    const std::string line =
        path.empty() ? refusal(around("") + "no_such_key: 1\n") : refusal(scene_with(path + ".no_such_key", "1"));
    std::smatch found;
    EXPECT_TRUE(std::regex_search(line, found, std::regex("allowed here: ([a-zA-Z_, ]+)"))) << line;
    std::vector<std::string> names;
    std::string list = found[1];
    list = std::regex_replace(list, std::regex(","), " ");
    std::istringstream stream(list);
    for (std::string name; stream >> name;) names.push_back(name);
    return names;
  }

  /// Adds the keys of the section at `path` and of those in it.
  void collect(const std::string& path, std::vector<Key>& keys, std::vector<Key>& sections) {
    for (const std::string& name : keys_in(path)) {
      const std::string key = path.empty() ? name : path + "." + name;
      const std::string line = refusal(scene_with(key, "~"));
      const std::size_t at = line.rfind("must be ");
      ASSERT_NE(at, std::string::npos) << key << ": " << line;
      const std::string allowed = line.substr(at + 8);
      const bool section = allowed.rfind("keys with values", 0) == 0;
      const bool list = allowed == "a list with at least one entry";
      (section || list ? sections : keys).push_back({key, allowed});
      if (section) collect(key, keys, sections);
      if (list) collect(key + "[0]", keys, sections);
    }
  }

  void SetUp() override {
    collect("", keys_, sections_);
    collect("robot.profile", keys_, sections_);  // which may also be a name
  }

  std::vector<Key> keys_, sections_;
};

struct Value {
  std::string yaml, shown;
};

TEST_F(KeysTest, AreAllFound) {
  // Some of each section; docs/scenes/keys.yaml has the list.
  for (const std::string known :
       {"model", "duration", "robot.com", "robot.roller_damping", "floor.gravity", "initial.roller_rates",
        "solver.control_period", "drive.reference_motion.Omega.cos", "drive.torque[0].start", "drive.velocity_table"}) {
    EXPECT_TRUE(std::any_of(keys_.begin(), keys_.end(), [&](const Key& key) { return key.path == known; })) << known;
  }
  // robot, floor, initial, solver, motors, output; drive and what is in it; slope, patches, loads, wrenches
  EXPECT_EQ(sections_.size(), 6u + 6u + 4u);
}

const std::string kSource = YOUBOT_BASE_SIM_SOURCE_DIR "/";
constexpr std::size_t kLargest = 1 << 20;  // bytes of a file that is read here

// Users find a key in the listing, and libFuzzer begins with these files.
TEST_F(KeysTest, StandInTheListingAndInTheSeeds) {
  std::set<std::string> known, listed;
  for (const std::vector<Key>& keys : {keys_, sections_}) {
    for (const Key& key : keys) known.insert(key.path);
  }
  const std::string listing = read_text_file(kSource + "docs/scenes/keys.yaml", kLargest);
  collect_paths(YAML::Load(listing), "", listed);
  ASSERT_NE(listing.find("{name: measured, friction_scale: "),
            std::string::npos);  // in a comment, beside a profile's name
  listed.insert({"robot.profile.name", "robot.profile.friction_scale"});
  EXPECT_EQ(listed, known);

  EXPECT_EQ(keys_of_seeds(YOUBOT_BASE_SIM_SOURCE_DIR), known);
}

// What `provenance` hashes: with the defaults of keys that the seed leaves out.
TEST_F(KeysTest, StandInTheResolvedScene) {
  std::set<std::string> known, resolved;
  for (const std::vector<Key>& keys : {keys_, sections_}) {
    for (const Key& key : keys) known.insert(key.path);
  }
  for (const char* seed : {"every_key", "reference_motion", "torque_table", "velocity_table", "wheel_angle_table"}) {
    folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,1,1,1\n1,1,1,1,2\n");
    folder_.write("scene.yaml", read_text_file(kSource + "test/fuzz/scene/" + seed + ".yaml", kLargest));
    const Scene scene = load_scene(folder_.path("scene.yaml"));
    collect_paths(YAML::Load(scene.resolved), "", resolved);
    folder_.write("again.yaml", scene.resolved);
    const Scene again = load_scene(folder_.path("again.yaml"));
    EXPECT_EQ(again.resolved, scene.resolved);
    EXPECT_EQ(id_of(again), id_of(scene));
  }
  EXPECT_EQ(resolved, known);
}

TEST_F(KeysTest, StandInTheFuzzersDictionary) {
  std::set<std::string> known, words;
  for (const std::vector<Key>& keys : {keys_, sections_}) {
    for (const Key& key : keys) known.insert(key.path.substr(key.path.rfind('.') + 1));
  }
  const std::string dictionary = read_text_file(kSource + "test/fuzz/scene.dict", kLargest);
  const std::regex key(R"re((?:^|\n)"([a-zA-Z_]+): )re"), inner(R"re(\{([a-zA-Z_]+): )re");
  for (const std::regex& pattern : {key, inner}) {
    for (std::sregex_iterator found(dictionary.begin(), dictionary.end(), pattern), end; found != end; ++found)
      words.insert((*found)[1]);
  }
  EXPECT_EQ(words, known);
}

TEST_F(KeysTest, RefuseWhatIsOfNoUse) {
  const std::string longest(5000, 'x');
  const std::vector<Value> values = {{"", "(empty)"},
                                     {"~", "(empty)"},
                                     {"''", ""},
                                     {"[]", "[]"},
                                     {"{}", "{}"},
                                     {"{a: 1}", "{a: 1}"},
                                     {"[1, 2, 3, 4, 5]", "[1, 2, 3, 4, 5]"},
                                     {"[[1], [2]]", "[[1], [2]]"},
                                     {".nan", ".nan"},
                                     {".inf", ".inf"},
                                     {"-.inf", "-.inf"},
                                     {"1e400", "1e400"},
                                     {"0x1p", "0x1p"},
                                     {"0x1p3", "0x1p3"},
                                     {"\"1\\0\"", "1\\x00"},
                                     {"1.2.3", "1.2.3"},
                                     {"[.nan, .nan, .nan, .nan]", "nan"},
                                     {"[1, two, 3, 4]", "two"},
                                     {"\"line\\nbreak\"", "break"},
                                     {"\"\\e[31mred\"", "[31mred"},
                                     {longest, std::string(40, 'x')}};
  int cases = 0;
  for (const Key& key : keys_) {
    for (const Value& value : values) {
      if (key.path == "robot.profile" && value.yaml[0] == '{') continue;  // may be a section too
      SCOPED_TRACE(key.path + ": " + value.yaml.substr(0, 60));
      const std::string line = refusal(scene_with(key.path, value.yaml));
      // A table's name may be any text; then it is the file that is refused.
      const bool is_name = key.allowed.find("name of") != std::string::npos;
      const bool names_a_file = line.find("name of") == std::string::npos && is_name;
      expect_refusal(line, names_a_file ? std::vector<std::string>{value.shown.substr(0, 5), "must be"}
                                        : std::vector<std::string>{"scene.yaml", key.path, value.shown, "must be"});
      ++cases;
    }
  }
  EXPECT_EQ(contents_of(folder_.path("")).size(), 1u) << "more than the scene was written";
  EXPECT_GE(cases, 800);
}

TEST_F(KeysTest, RefuseSectionsThatAreNone) {
  for (const Key& section : sections_) {
    for (const Value& value : std::vector<Value>{{"1", "1"}, {"text", "text"}, {"[]", "[]"}, {"", "(empty)"}}) {
      SCOPED_TRACE(section.path + ": " + value.yaml);
      expect_refusal(refusal(scene_with(section.path, value.yaml)), {section.path, value.shown, "must be"});
    }
    SCOPED_TRACE(section.path);
    const std::string inside = section.allowed.rfind("keys with values", 0) == 0 ? section.path : section.path + "[0]";
    expect_refusal(refusal(scene_with(inside + ".\"no\\nkey\"", "1")), {inside + ".no", "unknown key"});
    expect_refusal(refusal(scene_with(inside + ".\"\\e[2J\"", "1")), {inside + ".", "[2J", "unknown key"});
    expect_refusal(refusal(scene_with(inside + "." + std::string(900, 'k'), "1")), {inside + ".k", "unknown key"});
  }
}

/// The ends of a range of numbers, as a refusal states it. A number of %g reads back to the same double where the code
/// states a round one.
struct Ends {
  double min, max;
  bool whole, or_zero;
};

std::optional<Ends> ends_of(const std::string& allowed) {
  const std::string number = "(-?[0-9.]+(?:e[-+]?[0-9]+)?)";
  std::smatch found;
  const bool whole = allowed.find("whole number") != std::string::npos;
  const bool or_zero = allowed.find(": 0 or from") != std::string::npos;
  if (std::regex_search(allowed, found, std::regex("from " + number + " to " + number))) {
    return Ends{std::stod(found[1]), std::stod(found[2]), whole, or_zero};
  }
  if (std::regex_search(allowed, found, std::regex(">= 0, up to " + number)))
    return Ends{0, std::stod(found[1]), whole, or_zero};
  return std::nullopt;
}

/// In YAML: the number, or as many of them as the key must have.
std::string repeated(const Key& key, double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", number);
  std::smatch found;
  if (!std::regex_search(key.allowed, found, std::regex("a list of ([0-9]+) numbers"))) return text;
  std::string list = "[";
  for (int k = std::stoi(found[1]); k > 0; --k) list += std::string(text) + (k > 1 ? ", " : "]");
  return list;
}

// A number of a key is allowed if its refusal says so, to the last digit: just beyond its ends it is refused.
TEST_F(KeysTest, RefuseNumbersBeyondTheEndsThatTheyState) {
  int cases = 0;
  for (const Key& key : keys_) {
    if (key.allowed.find("number") == std::string::npos) continue;
    const std::optional<Ends> ends = ends_of(key.allowed);
    ASSERT_TRUE(ends) << key.path << " must be " << key.allowed << ", which tells no ends";
    const double below = ends->whole ? ends->min - 1 : std::nextafter(ends->min, -HUGE_VAL);
    const double above = ends->whole ? ends->max + 1 : std::nextafter(ends->max, HUGE_VAL);
    for (const double number : {below, above, -1e300, 1e300, ends->whole ? ends->min + 0.5 : 2 * above}) {
      SCOPED_TRACE(key.path + ": " + std::to_string(number));
      expect_refusal(refusal(scene_with(key.path, repeated(key, number))), {key.path, "must be"});
      ++cases;
    }
  }
  EXPECT_GE(cases, 200);
}

// docs/limits/scenes.csv has a row for each, with the same ends and unit, and no others.
TEST_F(KeysTest, HaveTheLimitsThatTheDocumentationTells) {
  std::map<std::string, Limits> rows;
  for (const Limits& row : limits("scenes")) rows[row.key] = row;
  for (const Key& key : keys_) {
    const std::optional<Ends> ends = ends_of(key.allowed);
    if (!ends) continue;
    SCOPED_TRACE(key.path + " must be " + key.allowed);
    const auto row = rows.find(std::regex_replace(key.path, std::regex(R"(\[0\])"), "[]"));
    if (row == rows.end()) {
      ADD_FAILURE() << "no row";
      continue;
    }
    EXPECT_EQ(std::stod(row->second.min), ends->min);
    EXPECT_EQ(row->second.or_zero, ends->or_zero);
    const std::string unit = row->second.unit.empty() ? "" : " " + row->second.unit;
    const std::string end = "to " + Limits::text(std::stod(row->second.max)) + unit;
    EXPECT_EQ(key.allowed.substr(key.allowed.size() - std::min(key.allowed.size(), end.size())), end);
    rows.erase(row);
  }
  for (const auto& [key, row] : rows) ADD_FAILURE() << key << " has a row and is no number of a scene";
}

// The other side of the same table. What two keys say together may be refused for the other one (a centre of mass
// outside the wheels, rollers larger than the wheel), never with anything but a refusal; what is accepted runs: finite,
// with bounded work.
TEST_F(KeysTest, AcceptNumbersAtTheEndsThatTheyStateAndRun) {
  int accepted = 0;
  for (const Key& key : keys_) {
    const std::optional<Ends> ends = ends_of(key.allowed);
    if (!ends) continue;
    for (const double number : {ends->min, ends->max, ends->or_zero ? 0 : ends->min}) {
      SCOPED_TRACE(key.path + ": " + repeated(key, number));
      const std::string line = refusal(scene_with(key.path, repeated(key, number)));
      if (!line.empty()) {
        EXPECT_EQ(line.find(key.allowed), std::string::npos) << line << " though that is allowed";
        expect_refusal(line, {"must be"});
        continue;
      }
      ++accepted;
      const Scene scene = load_scene(folder_.path("scene.yaml"));
      Simulation simulation(scene);
      try {
        for (const double t : {1e-6, 1e-3, 0.02}) {
          simulation.advance_to(std::min(t, scene.duration));
          ASSERT_TRUE(simulation.state().values.allFinite()) << "at " << simulation.time() << " s";
        }
      } catch (const std::domain_error& error) {
        ADD_FAILURE() << error.what();
      }
      EXPECT_LT(simulation.statistics().evaluations, 200000u);  // of 20 ms in steps of 1 us, twice over
    }
  }
  EXPECT_GE(accepted, 60);
}

// Files that are none.
TEST_F(ScenesTest, AreRefusedWhereTheyAreNoScenes) {
  const std::string good = around("");
  const std::vector<std::string> texts = {"",
                                          "\n\n",
                                          "# nothing\n",
                                          "duration",
                                          "[1, 2]",
                                          "- duration: 1",
                                          "duration: 1\nduration: 2\n",
                                          good + "\t: x\n",
                                          good + "robot: {",
                                          good + "robot: [}",
                                          good + "robot: \"",
                                          good + "robot: *nobody\n",
                                          good + "%YAML 9\n",
                                          good + "---\nduration: 2\n",
                                          good + "...\n---\nduration: 2\n",
                                          good + "robot: !!binary x\n",
                                          good + std::string("\x00\x01\x02", 3),
                                          "\xFF\xFE" + good,
                                          "\x7F"
                                          "ELF\x02\x01\x01",
                                          good + "? [a, b]\n: 1\n",
                                          good + "? {a: b}\n: 1\n",
                                          good + "~: 1\n",
                                          good + "'': 1\n",
                                          good + "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nd: [*c, *c]\n",
                                          good + "a: &a [*a]\n",
                                          good + "robot: &a {robot: *a}\n",
                                          good + "robot: " + std::string(3000, '[') + "\n",
                                          good + "robot: " + std::string(3000, '[') + std::string(3000, ']') + "\n",
                                          good + "robot: {\"a\\nb\\e[0m\": 1}\n",
                                          good + "\"" + std::string(100000, 'k') + "\": 1\n",
                                          good + "robot: {body_mass: \"" + std::string(100000, '7') + "x\"}\n"};
  for (const std::string& text : texts) {
    SCOPED_TRACE(text.substr(0, 200));
    const std::string line = refusal(text);
    expect_refusal(line, {"scene.yaml"});
  }
}

TEST_F(ScenesTest, AreRefusedWhereTheyHaveANulByte) {
  const auto refusal_with_nul = [&](std::string text) {
    std::replace(text.begin(), text.end(), '@', '\0');
    return refusal(text);
  };
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,1,1,1\n");
  expect_refusal(refusal_with_nul("duration: 1@\n"), {"scene.yaml:1:12: has a NUL byte; must be text"});
  expect_refusal(refusal_with_nul("duration: 1\ndr@ive: {}\n"), {"scene.yaml:2:3: has a NUL byte"});
  expect_refusal(refusal_with_nul("duration: 1\ndrive: {torque_table: \"table.csv@\"}\n"),
                 {"scene.yaml:2:33: has a NUL byte"});
  // The escape of one is text, and ends no name of a file.
  for (const std::string table : {"torque_table", "velocity_table"}) {
    expect_refusal(refusal("duration: 1\ndrive: {" + table + ": \"table.csv\\0\"}\n"),
                   {"scene.yaml", "drive." + table + " = table.csv\\x00", "must be the name of a CSV file"});
  }
  // In UTF-16 every letter has one.
  std::string wide = "\xFF\xFE";
  for (const char c : std::string("duration: 1\n")) wide += {c, '\0'};
  EXPECT_EQ(refusal(wide), "");
}

TEST_F(ScenesTest, AreRefusedWhereTheyAreNoFiles) {
  std::filesystem::create_directory(folder_.path("folder"));
  folder_.write("secret", "root:x:0:0:not for everybody:/root\n");
  folder_.write("shadow", "root:*:not for everybody:0:99999:7:::\n");  // which is YAML, and has a key
  for (const std::string& path :
       {std::string(), folder_.path("folder"), folder_.path("missing"), std::string("/dev/zero"),
        std::string("/dev/null/x"), folder_.path(std::string(300, 'n')), folder_.path("a\nb\033[31m")}) {
    SCOPED_TRACE(path);
    expect_refusal(refusal_of_file(path), {});
  }
  // A file that is no scene is not shown to whoever names it.
  for (const char* name : {"secret", "shadow"}) {
    const std::string line = refusal_of_file(folder_.path(name));
    expect_refusal(line, {name, "scene", "must"});
    EXPECT_EQ(line.find("everybody"), std::string::npos) << line;
  }
}

class TablesTest : public ScenesTest, public testing::WithParamInterface<const char*> {
 protected:
  std::string refusal_of(const std::string& table) {
    folder_.write("table.csv", table);
    return refusal(std::string("duration: 1\ndrive: {") + GetParam() + ": table.csv}\n");
  }
};

TEST_P(TablesTest, AreRefusedByTheirLine) {
  const std::string header = "t,fl,fr,bl,br\n";
  const std::vector<std::pair<std::string, std::string>> tables = {
      {"", "table.csv"},
      {"\n", "table.csv"},
      {"0,1,2,3,4\n", "table.csv:1"},
      {"t,fl,fr,bl\n0,1,2,3\n", "table.csv:1"},
      {"t,fl,fl,bl,br\n0,1,2,3,4\n", "table.csv:1"},
      {"t,t,fr,bl,br\n0,1,2,3,4\n", "table.csv:1"},
      {"t,fl,fr,bl,br,x\n0,1,2,3,4,5\n", "table.csv:1"},
      {"T,FL,FR,BL,BR\n0,1,2,3,4\n", "table.csv:1"},
      {"t;fl;fr;bl;br\n0;1;2;3;4\n", "table.csv:1"},
      {"t,fl,fr,bl,\033[31mbr\n0,1,2,3,4\n", "table.csv:1"},
      {std::string(100000, 'x') + "\n", "table.csv:1"},
      {header, "table.csv"},
      {header + "\n\n", "table.csv"},
      {header + "0,1,2,3\n", "table.csv:2"},
      {header + "0,1,2,3,4,5\n", "table.csv:2"},
      {header + "0,1,2,3,\n", "table.csv:2"},
      {header + ",1,2,3,4\n", "table.csv:2"},
      {header + "0,1,2,x,4\n", "table.csv:2"},
      {header + "0,1,2,nan,4\n", "table.csv:2"},
      {header + "0,1,inf,3,4\n", "table.csv:2"},
      {header + "0,1,1e400,3,4\n", "table.csv:2"},
      {header + "0,1,2,3,1e300\n", "table.csv:2"},
      {header + "1e300,1,2,3,4\n", "table.csv:2"},
      {header + "nan,1,2,3,4\n", "table.csv:2"},
      {header + "0,1,2,3,4 5\n", "table.csv:2"},
      {header + "0,1,2,3,4#\n", "table.csv:2"},
      {header + "0,1,2,3,4\n0,1,2,3,4\n", "table.csv:3"},
      {header + "1,1,2,3,4\n0,1,2,3,4\n", "table.csv:3"},
      {header + "0,1,2,3,4\n\n1,1,2,3,4\n1,2,3,4,x\n", "table.csv:5"},
      {header + "0,1,2,3," + std::string(100000, 'y') + "\n", "table.csv:2"},
      {header + "0,1,2,3,\033[31m4\n", "table.csv:2"},
      {header + "0,1,2,3," + std::string("4\0", 2) + "\n", "table.csv:2"}};
  for (const auto& [table, where] : tables) {
    SCOPED_TRACE(table.substr(0, 120));
    expect_refusal(refusal_of(table), {where, "must"});
  }
}

TEST_P(TablesTest, AreRefusedWhereTheyAreNoFiles) {
  std::filesystem::create_directory(folder_.path("folder"));
  for (const std::string path : {".", "folder", "missing.csv", "/dev/zero", "/dev/full", "scene.yaml"}) {
    SCOPED_TRACE(path);
    expect_refusal(refusal(std::string("duration: 1\ndrive: {") + GetParam() + ": " + path + "}\n"), {});
  }
}

TEST_P(TablesTest, MayBeWrittenInManyWays) {
  for (const std::string table :
       {"t,fl,fr,bl,br\n0,1,2,3,4\n", "t,fl,fr,bl,br\r\n0,1,2,3,4\r\n", "t,fl,fr,bl,br\n0,1,2,3,4",
        "\xEF\xBB\xBFt,fl,fr,bl,br\n0,1,2,3,4\n", "br,bl,fr,fl,t\n4,3,2,1,0\n", " t , fl,\"fr\",bl,br\n 0 , 1,2,3,4\n",
        "t,fl,fr,bl,br\n\n0,1,2,3,4\n\n"}) {
    EXPECT_EQ(refusal_of(table), "") << table;
  }
}

INSTANTIATE_TEST_SUITE_P(Scene, TablesTest, testing::Values("torque_table", "velocity_table"));

}  // namespace
}  // namespace youbot_base_sim
