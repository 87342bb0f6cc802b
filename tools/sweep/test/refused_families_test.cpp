// Every key of a family file with every kind of wrong value, and families that make no sense: each is refused in one
// line that names the key, its value and what is allowed, before anything runs. The keys are those that the refusal of
// an unknown one lists, so that a new key is tried as soon as it is read.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <regex>

#include "errors.h"
#include "promises/refusals.h"
#include "youbot_base_sim/sweep/family.h"

namespace youbot_base_sim {
namespace {

class FamiliesTest : public testing::Test {
 protected:
  FamiliesTest() {
    folder_.write("scene.yaml", "duration: 1\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n");
  }

  /// The line that refuses the family; empty if it is accepted.
  std::string refusal(const std::string& text) {
    return error_of<SceneError>([&] { load_family(folder_.write("family.yaml", text)); });
  }

  /// The refusal of a family with these axes.
  std::string refusal_of_axes(const std::string& axes, const std::string& more = "") {
    return refusal("scene: scene.yaml\naxes: [" + axes + "]\n" + more);
  }

  TemporaryFolder folder_;
};

/// A section of a family file: what stands around it, and what must stand in it.
struct Section {
  std::string around;  // with %
  std::map<std::string, std::string> needed;
};

const std::string kAxes = "[{key: floor.friction, uniform: {from: 0.1, to: 1}}]";

std::string in_axis(const std::string& entry) { return "{scene: scene.yaml, axes: [" + entry + "]}"; }

const std::vector<Section> kSections = {
    {"%", {{"scene", "scene.yaml"}, {"axes", kAxes}, {"draws", "2"}}},
    {in_axis("%"), {{"key", "floor.friction"}, {"values", "[1]"}}},
    {in_axis("{together: [%]}"), {{"key", "floor.friction"}, {"values", "[1]"}}},
    {in_axis("{key: floor.friction, range: %}"), {{"from", "0.1"}, {"to", "1"}, {"count", "3"}}},
    {"{scene: scene.yaml, draws: 2, axes: [{key: floor.friction, uniform: %}]}", {{"from", "0.1"}, {"to", "1"}}},
    {"{scene: scene.yaml, draws: 2, axes: [{key: floor.friction, log_uniform: %}]}", {{"from", "0.1"}, {"to", "1"}}},
    {"{scene: scene.yaml, draws: 2, axes: [{key: floor.friction, normal: %}]}",
     {{"mean", "0.5"}, {"deviation", "0.1"}, {"from", "0.1"}, {"to", "1"}}},
    {"{scene: scene.yaml, draws: 2, axes: " + kAxes + ", trajectories: %}", {}}};

/// A family with this key in the section.
std::string family_with(const Section& section, const std::string& key, const std::string& value) {
  std::map<std::string, std::string> entries = section.needed;
  entries[key] = value;
  std::string text;
  for (const auto& [name, content] : entries) text += (text.empty() ? "{" : ", ") + name + ": " + content;
  std::string whole = section.around;
  return whole.replace(whole.find('%'), 1, text + "}") + "\n";
}

TEST_F(FamiliesTest, RefuseWhatIsOfNoUse) {
  const std::vector<std::string> values = {"~",
                                           "''",
                                           "{a: 1}",
                                           "[[1], [2]]",
                                           ".nan",
                                           ".inf",
                                           "1e400",
                                           "\"\\e[31mred\"",
                                           "\"line\\nbreak\"",
                                           "[1, two, .nan]",
                                           "-7.5",
                                           std::string(5000, 'x')};
  int cases = 0;
  for (const Section& section : kSections) {
    const std::string unknown = refusal(family_with(section, "no_such_key", "1"));
    std::smatch found;
    ASSERT_TRUE(
        std::regex_search(unknown, found, std::regex("no_such_key = 1: unknown key; allowed here: ([a-z_, ]+)")))
        << unknown;
    std::istringstream list(std::regex_replace(found[1].str(), std::regex(","), " "));
    for (std::string key; list >> key;) {
      for (const std::string& value : values) {
        const std::string text = family_with(section, key, value);
        SCOPED_TRACE(text.substr(0, 200));
        const bool end_of_range = key == "from" || key == "to" || key == "mean";
        if (end_of_range && value == "-7.5") continue;  // may be; the scene then refuses it
        expect_refusal(refusal(text), {"family.yaml: ", key == "key" || key == "values" ? "" : key});
        ++cases;
      }
    }
    EXPECT_EQ(section.needed.empty()
                  ? ""
                  : refusal(family_with(section, section.needed.begin()->first, section.needed.begin()->second)),
              "");
  }
  EXPECT_GE(cases, 350);
}

TEST_F(FamiliesTest, RefuseRangesThatLeaveWhatTheKeyAllows) {
  for (const std::string values :
       {"values: [0.5, 101]", "values: [0.5, -1]", "values: [0.5, .nan]", "values: [0.5, text]",
        "range: {from: 0.5, to: 101, count: 5}", "range: {from: -0.1, to: 1, count: 5}"}) {
    expect_refusal(refusal_of_axes("{key: floor.friction, " + values + "}"),
                   {"family.yaml: floor.friction = ", "scene.yaml", "must be a finite number >= 0, up to 100"});
  }
  for (const std::string drawn :
       {"uniform: {from: 0, to: 100.1}", "uniform: {from: -1.0e-9, to: 1}", "log_uniform: {from: 0.1, to: 101}",
        "normal: {mean: 0.5, deviation: 0.1}", "normal: {mean: 0.5, deviation: 0.1, from: -0.01}",
        "normal: {mean: 99, deviation: 1, from: 0}"}) {
    expect_refusal(refusal_of_axes("{key: floor.friction, " + drawn + "}", "draws: 10\n"),
                   {"family.yaml: floor.friction = ", "scene.yaml", "must be a finite number >= 0, up to 100"});
  }
  EXPECT_EQ(refusal_of_axes("{key: floor.friction, uniform: {from: 0, to: 100}}", "draws: 10\n"), "");
  EXPECT_EQ(refusal_of_axes("{key: floor.friction, normal: {mean: 0.5, deviation: 0.1, from: 0}}", "draws: 10\n"), "");
  expect_refusal(refusal_of_axes("{key: robot.rollers_per_wheel, range: {from: 4, to: 9, count: 5}}"),
                 {"robot.rollers_per_wheel", "must be a whole number"});
  // The axis that is wrong is named, not the one that is tried first beside it.
  expect_refusal(refusal_of_axes("{key: robot.body_mass, values: [20]}, {key: floor.friction, values: [-7]}"),
                 {"family.yaml: floor.friction = -7: "});
  // Values that depend on another key, too.
  expect_refusal(refusal_of_axes("{key: robot.roller_axis_radius, values: [0.04, 0.06]}"),
                 {"robot.roller_axis_radius = 0.06", "must be less than wheel_radius"});
}

TEST_F(FamiliesTest, RefuseKeysThatLeadNowhere) {
  const auto refusal_of_key = [&](const std::string& key) {
    return refusal_of_axes("{key: '" + key + "', values: [0.5]}");
  };
  expect_refusal(refusal_of_key("floor.frictoin"), {"floor.frictoin", "unknown key", "did you mean friction?"});
  expect_refusal(refusal_of_key("flor.friction"), {"flor", "unknown key", "did you mean floor?"});
  expect_refusal(refusal_of_key("duration.friction"), {"duration.friction", "not a section"});
  expect_refusal(refusal_of_key("drive.torque[0].constant[5]"), {"drive.torque[0].constant[5]", "has 4 entries"});
  expect_refusal(refusal_of_key("drive.torque[0].constant[4]"), {"drive.torque[0].constant[4]", "a list of 4 numbers"});
  expect_refusal(refusal_of_key("drive.torque[2].start"), {"drive.torque[2].start", "has 1 entries"});
  expect_refusal(refusal_of_key("robot[0]"), {"robot[0]", "must be"});
  expect_refusal(refusal_of_key("duration[0]"), {"duration[0]", "not a list"});
  for (const std::string key : {".", "a.", ".a", "a..b", "a[", "a[]", "a[b]", "a[-1]", "a[01]", "a[1", "a[1]b", "a b",
                                "[0]", "a[9999999]", "a.[0]"}) {
    SCOPED_TRACE(key);
    expect_refusal(refusal_of_key(key), {key, "must be a key of a scene such as floor.friction"});
  }
  expect_refusal(refusal_of_key(std::string(100'000, 'a')), {"must be a key of a scene such as floor.friction"});
}

TEST_F(FamiliesTest, RefuseAxesThatContradictEachOther) {
  const auto refusal_of_keys = [&](const std::string& a, const std::string& b) {
    return refusal_of_axes("{key: '" + a + "', values: [1]}, {key: '" + b + "', values: [1]}");
  };
  for (const auto& [a, b] :
       std::vector<std::pair<std::string, std::string>>{{"floor.friction", "floor.friction"},
                                                        {"floor", "floor.friction"},
                                                        {"floor.friction", "floor"},
                                                        {"initial.wheel_angles", "initial.wheel_angles[1]"},
                                                        {"drive.torque[0]", "drive.torque[0].start"}}) {
    expect_refusal(refusal_of_keys(a, b), {"axes[1].key = " + b, "no other axis", a});
  }
  expect_refusal(
      refusal_of_axes("{together: [{key: floor.friction, values: [1]}, {key: floor.friction, values: [2]}]}"),
      {"axes[0].together[1].key = floor.friction", "no other axis"});
  expect_refusal(
      refusal_of_axes("{together: [{key: floor.friction, values: [1]}, {key: robot.body_mass, values: [2, 3]}]}"),
      {"axes[0].together[1].key = robot.body_mass", "1 values", "it has 2"});
  expect_refusal(refusal_of_axes("{together: [{key: floor.friction, uniform: {from: 0, to: 1}}]}", "draws: 3\n"),
                 {"axes[0].together[0].key = floor.friction", "values or a range"});
  for (const std::string key : {"key: robot.com", "values: [1, 2]", "range: {from: 1, to: 2, count: 2}"}) {
    expect_refusal(refusal_of_axes("{together: [{key: floor.friction, values: [1, 2]}], " + key + "}"),
                   {"axes[0]." + key.substr(0, key.find(':')), "unknown key", "together"});
  }
  expect_refusal(refusal_of_axes("{key: floor.friction}"), {"floor.friction", "exactly one of values, range"});
  expect_refusal(refusal_of_axes("{key: floor.friction, values: [1], uniform: {from: 0, to: 1}}"),
                 {"floor.friction", "exactly one of values, range"});
}

TEST_F(FamiliesTest, RefuseOtherContradictions) {
  for (const std::string axis : {"range: {from: 1, to: 0.5, count: 3}", "range: {from: 1, to: 1, count: 3}",
                                 "uniform: {from: 1, to: 0.5}", "log_uniform: {from: 1, to: 0.5}"}) {
    expect_refusal(refusal_of_axes("{key: floor.friction, " + axis + "}", "draws: 3\n"),
                   {".to = ", "more than from, 1"});
  }
  expect_refusal(refusal_of_axes("{key: floor.friction, range: {from: 0, to: 1, count: 3, spacing: logarithmic}}"),
                 {"axes[0].range.from = 0", "> 0"});
  expect_refusal(refusal_of_axes("{key: floor.friction, normal: {mean: 1, deviation: 0.1, from: 2}}", "draws: 3\n"),
                 {"axes[0].normal.from = 2", "at most the mean, 1"});
  expect_refusal(refusal_of_axes("{key: floor.friction, uniform: {from: 0, to: 1}}"),
                 {"draws = (left out)", "number of runs"});
  expect_refusal(refusal_of_axes("{key: floor.friction, uniform: [0.1, 0.5]}", "draws: 3\n"),
                 {"axes[0].uniform = [0.1, 0.5]", "must be keys with values: from, to"});
  expect_refusal(refusal_of_axes("{key: initial.wheel_angles, uniform: {from: 0, to: 1}}", "draws: 3\n"),
                 {"a list of 4 numbers", "a key such as initial.wheel_angles[0]"});
  for (const std::string more : {"draws: 3", "seed: 3", "sampling: latin_hypercube", "sampling: sobol"}) {
    expect_refusal(refusal_of_axes("{key: floor.friction, values: [1]}", more), {more.substr(0, 4), "left out"});
  }
  const std::string thousand = "range: {from: 0.1, to: 1, count: 1001}";
  const std::string axes = "{key: floor.friction, " + thousand + "}, {key: robot.total_inertia, " + thousand + "}";
  EXPECT_EQ(refusal_of_axes(axes), "") << "a million";
  expect_refusal(refusal_of_axes(axes + ", {key: floor.gravity, " + thousand + "}"), {"axes = ", "at most 1e+09 runs"});
  expect_refusal(refusal_of_axes("{key: floor.friction, uniform: {from: 0, to: 1}}", "draws: 1000000001\n"),
                 {"draws = 1000000001", "from 1 to 1000000000"});
  expect_refusal(refusal("axes: " + kAxes + "\ndraws: 2\n"), {"scene is left out"});
  expect_refusal(refusal("scene: none.yaml\naxes: " + kAxes + "\ndraws: 2\n"), {"none.yaml", "cannot be read"});
  folder_.write("no_drive.yaml", "duration: 1\n");
  expect_refusal(refusal("scene: no_drive.yaml\naxes: " + kAxes + "\ndraws: 2\n"),
                 {"no_drive.yaml", "drive is left out"});
  expect_refusal(refusal("duration: 1\ndrive: {}\n"), {"is not a family", "scene, axes"});
  expect_refusal(refusal("- 1\n"), {"family = (list)"});
  expect_refusal(refusal("scene: scene.yaml\n---\nx: 1\n"), {"a family is one"});
}

TEST_F(FamiliesTest, ProgramEndsWithStatus2AndWritesNothing) {
  const std::string bad = folder_.write("bad.yaml", "scene: scene.yaml\naxes: [{key: floor.friction, values: [-1]}]\n");
  const std::string good =
      folder_.write("good.yaml", "scene: scene.yaml\naxes: [{key: floor.friction, values: [1]}]\n");
  std::filesystem::create_directory(folder_.path("folder"));
  folder_.write("diary.csv.journal", "not a journal\n");
  mkfifo(folder_.path("fifo").c_str(), 0600);
  mkfifo(folder_.path("piped.csv.journal").c_str(), 0600);
  const std::string table = folder_.path("table.csv");
  for (const auto& [arguments, part] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{}, "no family given"},
           {{bad, "--csv", table}, "floor.friction = -1"},
           {{good, good}, "too many"},
           {{""}, "must not be empty"},
           {{good, "--csv", ""}, "must not be empty"},
           {{good, "--csv", table, "--threads", "0"}, "--threads = 0: must be a whole number from 1 to 1024"},
           {{good, "--csv", table, "--threads", "x"}, "--threads = x: must be a whole number from 1 to 1024"},
           {{good, "--csv", table, "--threads", "-3"}, "--threads = -3: must be a whole number from 1 to 1024"},
           {{good, "--csv", table, "--threads", "1e1"}, "--threads = 1e1: must be a whole number from 1 to 1024"},
           {{good, "--csv", table, "--threads", "99999999999999999999"}, "--threads = 99999999999999999999: must be"},
           {{good, "--csv", table, "--threads", ""}, "--threads = \"\": must not be empty"},
           {{good, "--csv", table, "--colour", "red"}, "colour"},
           {{good, "--scene", "1"}, "--scene = 1: must be a whole number from 0 to 0"},
           {{good, "--scene", "-5"}, "--scene = -5: must be a whole number from 0 to 0"},
           {{good, "--scene", "x"}, "--scene = x: must be a whole number from 0 to 0"},
           {{good, "--scene", ""}, "--scene = \"\": must not be empty"},
           {{good, "--csv", table, "--slice", "0/2"}, "--slice = 0/2: must be K/N"},
           {{good, "--csv", table, "--slice", "3/2"}, "--slice = 3/2: must be K/N"},
           {{good, "--csv", table, "--slice", "2"}, "--slice = 2: must be K/N"},
           {{good, "--csv", table, "--slice", "1/1000001"}, "--slice = 1/1000001: must be K/N"},
           {{good, "--csv", table, "--slice", "1/2"}, "--slice = 1/2: must be at most as many parts as runs, 1"},
           {{good, "--csv", table, "--reuse", folder_.path("none.csv")}, "none.csv: cannot be read"},
           {{good, "--csv", table, "--reuse", folder_.path("folder")}, "is a folder"},
           {{good, "--csv", table, "--reuse", folder_.path("fifo")}, "is a pipe without a writer"},
           {{good, "--csv", table, "--reuse", good}, "column scene: scene.yaml: must be run"},
           {{good, "--csv", good}, "a file that is read"},
           {{good, "--csv", folder_.path("scene.yaml")}, "a file that is read"},
           {{good, "--csv", folder_.path("folder")}, "cannot be written"},
           {{good, "--csv", folder_.path("none/table.csv")}, "cannot be written"},
           {{good, "--csv", "/dev/null"}, "must be a regular file"},
           {{good, "--csv", folder_.path("fifo")}, "--csv = "},
           {{good, "--csv", folder_.path("piped.csv")}, "piped.csv.journal: must be a regular file"},
           {{good, "--csv", folder_.path("diary.csv")}, "no journal of a sweep"}}) {
    expect_program_refuses(folder_, SWEEP, arguments, {"sweep: ", part});
  }
}

// Whatever stands in the folder of trajectories, by whatever names.
TEST_F(FamiliesTest, ProgramKeepsTrajectoriesFromWhatItReadsAndWrites) {
  const std::string table_text = "t,fl,fr,bl,br\n0,0,0,0,0\n";
  folder_.write("torque.csv", table_text);
  folder_.write("table_scene.yaml", "duration: 1.0e-3\ndrive: {torque_table: torque.csv}\n");
  std::filesystem::create_directory(folder_.path("runs_runs"));
  folder_.write("runs_runs/run_2.csv", "duration: 1.0e-3\ndrive: {torque_table: ../torque.csv}\n");
  folder_.write("runs_runs/run_4.csv", table_text);
  const std::string more = "\ntrajectories: {format: csv, every: 2}\n";
  const std::string durations = "\naxes: [{key: duration, range: {from: 1.0e-3, to: 2.0e-3, count: 10}}]";
  const std::string family = folder_.write("family.yaml", "scene: table_scene.yaml" + durations + more);
  const std::string of_scene = folder_.write("of_scene.yaml", "scene: runs_runs/run_2.csv" + durations + more);
  const std::string of_table =
      folder_.write("of_table.yaml",
                    "scene: table_scene.yaml\naxes: [{key: drive.torque_table, values: [torque.csv, torque.csv, "
                    "torque.csv, torque.csv, runs_runs/run_4.csv]}]" +
                        more);
  const auto expect_refused = [&](const std::string& sweep_of, const std::string& part) {
    expect_program_refuses(folder_, SWEEP, {sweep_of, "--csv", folder_.path("runs.csv"), "--quiet"},
                           {"sweep: trajectories = ", part});
  };
  expect_refused(of_scene, "run_2.csv: must not be a file that is read");
  expect_refused(of_table, "run_4.csv: must not be a file that is read");
  for (const auto& [target, part] : std::vector<std::pair<std::string, std::string>>{
           {"../family.yaml", "run_6.csv: must not be a file that is read"},
           {"../table_scene.yaml", "run_6.csv: must not be a file that is read"},
           {"../torque.csv", "run_6.csv: must not be a file that is read"},
           {"../runs.csv", "run_6.csv: must not be the file of --csv"},
           {"../runs.csv.journal", "run_6.csv: must not be the file of the journal"},
           {"run_4.csv", "must not be the file of trajectories"},
           {"run_8.csv", "run_8.csv: must not be the file of trajectories"}}) {
    std::filesystem::create_symlink(target, folder_.path("runs_runs/run_6.csv"));
    expect_refused(family, part);
    std::filesystem::remove(folder_.path("runs_runs/run_6.csv"));
  }
  mkfifo(folder_.path("runs_runs/run_6.csv").c_str(), 0600);
  expect_refused(family, "run_6.csv: must be a regular file");
  std::filesystem::remove(folder_.path("runs_runs/run_6.csv"));

  // Files that it does not write may be there: runs that it does not keep or does not have, names of another form.
  for (const char* name : {"run_1.csv", "run_10.csv", "run_06.csv", "run_6.bag", "run_.csv"})
    std::filesystem::create_symlink("../torque.csv", folder_.path(std::string("runs_runs/") + name));
  std::filesystem::create_symlink("../elsewhere.csv", folder_.path("runs_runs/run_6.csv"));
  Program sweep(SWEEP, {family, "--csv", folder_.path("runs.csv"), "--quiet"});
  EXPECT_EQ(sweep.wait(), 0) << sweep.err();
  EXPECT_EQ(folder_.read("torque.csv"), table_text);
  EXPECT_EQ(folder_.read("elsewhere.csv").substr(0, 4), "t,x,");
}

}  // namespace
}  // namespace youbot_base_sim
