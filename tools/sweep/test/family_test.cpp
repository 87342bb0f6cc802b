// Family files: which runs they make, and what each of them sets.

#include "youbot_base_sim/sweep/family.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <set>

#include "temporary_folder.h"

namespace youbot_base_sim {
namespace {

class FamilyTest : public testing::Test {
 protected:
  FamilyTest() {
    folder_.write("scene.yaml",
                  "duration: 1\ninitial: {wheel_angles: &angles [0.1, 0.2, 0.3, 0.4], wheel_rates: *angles}\n"
                  "drive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n");
  }

  Family family(const std::string& text) {
    return load_family(folder_.write("family.yaml", "scene: scene.yaml\n" + text));
  }

  static Scene scene(const Family& family, std::uint64_t run) { return load_scene(family.scene, family.settings(run)); }

  static std::string values(const Family& family, std::uint64_t run) {
    std::string text;
    for (const SceneSetting& setting : family.settings(run)) text += (text.empty() ? "" : " ") + setting.value;
    return std::regex_replace(text, std::regex("\\.0\\b"), "");  // fmt before version 7 writes 3 as 3.0
  }

  TemporaryFolder folder_;
};

TEST_F(FamilyTest, AxesMakeAGridOfWhichTheLastChangesFastest) {
  const Family f = family(
      "axes: [{key: floor.friction, values: [0.1, 0.2]}, "
      "{together: [{key: robot.body_mass, values: [20, 30, 40]}, {key: robot.total_inertia, range: {from: 3, to: 5, "
      "count: 3}}]}]\n");
  ASSERT_EQ(f.runs(), 6u);
  const std::vector<std::string> expected = {"0.1 20 3", "0.1 30 4", "0.1 40 5", "0.2 20 3", "0.2 30 4", "0.2 40 5"};
  for (std::uint64_t run = 0; run < 6; ++run) EXPECT_EQ(values(f, run), expected[run]);
  EXPECT_EQ(scene(f, 4).floor.f[0], 0.2);
  EXPECT_EQ(scene(f, 4).robot.m, 30);
  EXPECT_EQ(scene(f, 4).robot.I_s, 4);
}

TEST_F(FamilyTest, KeysLeadIntoSectionsAndLists) {
  const Family f = family(
      "axes: [{key: 'initial.wheel_angles[2]', values: [7]}, {key: 'drive.torque[0].constant[1]', values: [2]}, "
      "{key: model, values: [viscous]}, {key: robot.com, values: [[0.01, 0.02]]}, "
      "{key: 'robot.wheel_damping[0]', values: [0.1]}, {key: 'robot.wheel_damping[1]', values: [0.2]}, "
      "{key: 'robot.wheel_damping[2]', values: [0.3]}, {key: 'robot.wheel_damping[3]', values: [0.4]}]\n");
  const Scene s = scene(f, 0);
  EXPECT_EQ(s.initial.phi()[2], 7);
  EXPECT_EQ(s.initial.phi()[1], 0.2);
  EXPECT_EQ(s.initial.dphi()[2], 0.3) << "an alias of what was set has changed";
  EXPECT_EQ(std::get<TorqueSegments>(s.drive)[0].constant[1], 2);
  EXPECT_EQ(s.model, Model::kViscous);
  EXPECT_EQ(s.robot.a_Y, 0.02);
  EXPECT_EQ(s.robot.mu_1[3], 0.4) << "a list that the scene leaves out is made entry by entry";
}

TEST_F(FamilyTest, StepsIncludeBothEnds) {
  const Family f = family(
      "axes: [{key: floor.friction, range: {from: 0.05, to: 1, count: 20}}, "
      "{key: solver.relative_tolerance, range: {from: 1.0e-8, to: 1.0e-4, count: 5, spacing: logarithmic}}]\n");
  ASSERT_EQ(f.runs(), 100u);
  EXPECT_EQ(scene(f, 0).floor.f[0], 0.05);
  EXPECT_EQ(scene(f, 99).floor.f[0], 1);
  EXPECT_EQ(scene(f, 50).floor.f[0], 0.55);
  EXPECT_NEAR(scene(f, 52).solver.relative_tolerance, 1e-6, 1e-18);
  EXPECT_EQ(scene(f, 99).solver.relative_tolerance, 1e-4);
}

TEST_F(FamilyTest, DrawsAreMadeAtEachPointOfTheGrid) {
  const std::string axes =
      "axes: [{key: floor.friction, values: [0.1, 0.2]}, {key: robot.body_mass, uniform: {from: 20, to: 40}}, "
      "{key: robot.total_inertia, normal: {mean: 4, deviation: 0.1}}]\n";
  const Family f = family(axes + "draws: 50\nseed: 3\n"), other = family(axes + "draws: 50\nseed: 4\n");
  ASSERT_EQ(f.runs(), 100u);
  EXPECT_EQ(scene(f, 49).floor.f[0], 0.1);
  EXPECT_EQ(scene(f, 50).floor.f[0], 0.2);
  std::set<double> masses;
  for (std::uint64_t run = 0; run < 100; ++run) masses.insert(scene(f, run).robot.m);
  EXPECT_EQ(masses.size(), 100u);
  EXPECT_GE(*masses.begin(), 20);
  EXPECT_LE(*masses.rbegin(), 40);
  EXPECT_EQ(values(f, 77), values(family(axes + "draws: 50\nseed: 3\n"), 77));
  EXPECT_NE(values(f, 77), values(other, 77));
}

TEST_F(FamilyTest, ALatinHypercubeFillsEachAxisEvenly) {
  const Family f = family(
      "axes: [{key: robot.body_mass, uniform: {from: 20, to: 40}}, {key: robot.total_inertia, uniform: {from: 4, to: "
      "5}}]\ndraws: 40\nsampling: latin_hypercube\n");
  std::set<int> halves_of_a_kilogram, parts_of_inertia;
  for (std::uint64_t run = 0; run < 40; ++run) {
    halves_of_a_kilogram.insert(static_cast<int>(2 * scene(f, run).robot.m));
    parts_of_inertia.insert(static_cast<int>(40 * scene(f, run).robot.I_s));
  }
  EXPECT_EQ(halves_of_a_kilogram.size(), 40u);
  EXPECT_EQ(parts_of_inertia.size(), 40u);
}

TEST_F(FamilyTest, MoreDrawsLeaveThoseOfEachPointOfTheGrid) {
  for (const std::string sampling : {"independent", "sobol"}) {
    const auto with = [&](int draws) {
      return family(
          "axes: [{key: floor.friction, values: [0.1, 0.2]}, {key: robot.body_mass, uniform: {from: 20, to: 40}}, "
          "{key: robot.total_inertia, uniform: {from: 4, to: 5}}]\nsampling: " +
          sampling + "\ndraws: " + std::to_string(draws) + "\n");
    };
    const Family few = with(3), more = with(8);
    std::set<std::string> different;
    for (std::uint64_t run = 0; run < 3; ++run) {
      EXPECT_EQ(values(more, run), values(few, run));
      EXPECT_EQ(values(more, 8 + run), values(few, 3 + run));
      different.insert({values(few, run), values(few, 3 + run).replace(0, 3, "0.1")});
    }
    EXPECT_EQ(different.size(), 6u) << sampling;
  }
}

TEST_F(FamilyTest, ManyRunsTakeNoMemory) {
  const Family f = family(
      "axes: [{key: floor.friction, range: {from: 0.1, to: 1, count: 100000}}, {key: robot.body_mass, uniform: {from: "
      "20, to: 40}}]\ndraws: 10000\nsampling: latin_hypercube\n");
  EXPECT_EQ(f.runs(), 1000000000u);
  EXPECT_EQ(scene(f, 999999999).floor.f[0], 1);
}

TEST_F(FamilyTest, TablesAreNoted) {
  folder_.write("a.csv", "t,fl,fr,bl,br\n0,1,1,1,1\n");
  folder_.write("b.csv", "t,fl,fr,bl,br\n0,2,1,1,1\n");
  folder_.write("tables.yaml", "duration: 1\ndrive: {torque_table: a.csv}\n");
  const Family f = load_family(
      folder_.write("family.yaml", "scene: tables.yaml\naxes: [{key: drive.torque_table, values: [a.csv, b.csv]}]\n"));
  EXPECT_EQ(f.tables, (std::vector<std::string>{folder_.path("a.csv"), folder_.path("b.csv")}));
  EXPECT_EQ(std::get<WheelTable>(scene(f, 1).drive).values[0][0], 2);
}

TEST_F(FamilyTest, TheSceneOfARunIsOneThatCanBeRead) {
  const Family f = family("axes: [{key: 'initial.wheel_angles[3]', uniform: {from: 0, to: 1}}]\ndraws: 3\n");
  const std::string text = text_of(f.scene, f.settings(2));
  EXPECT_EQ(load_scene(folder_.write("run.yaml", text)).initial.phi()[3], scene(f, 2).initial.phi()[3]);
}

TEST(Families, OfThePackageAreAccepted) {
  int families = 0;
  for (const auto& entry : std::filesystem::directory_iterator(YOUBOT_BASE_SIM_SOURCE_DIR "/config/sweeps")) {
    EXPECT_GT(load_family(entry.path()).runs(), 1u) << entry.path();
    ++families;
  }
  EXPECT_GE(families, 5);
}

std::string document() {
  std::ostringstream text;
  text << std::ifstream(YOUBOT_BASE_SIM_SOURCE_DIR "/docs/sweep.md").rdbuf();
  return text.str();
}

TEST(Families, OfTheDocumentsAreAccepted) {
  const TemporaryFolder folder;
  const std::string text = document(), fence = "```yaml\n", scenes = "scene: ../scenes";
  std::string family = text.substr(text.find(fence) + fence.size());
  family.resize(family.find("```"));
  family.replace(family.find(scenes), scenes.size(), "scene: " YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes");
  EXPECT_EQ(load_family(folder.write("family.yaml", family)).runs(), 3000u);
}

}  // namespace
}  // namespace youbot_base_sim
