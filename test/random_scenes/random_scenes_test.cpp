// What scripts/random_scenes tries, and how it judges.

#include <gtest/gtest.h>

#include <filesystem>

#include "../accuracy.h"
#include "../scene_keys.h"
#include "scene_generator.h"
#include "verdict.h"

namespace youbot_base_sim {
namespace {

TEST(SceneGenerator, UsesEveryKey) {
  std::set<std::string> keys;
  for (std::uint32_t number = 1; number <= 200; ++number) {
    collect_paths(YAML::Load(random_scene_file(number, "table.csv").text), "", keys);
  }
  EXPECT_EQ(keys, keys_of_seeds(YOUBOT_BASE_SIM_SOURCE_DIR));
}

// Scenes found by scripts/random_scenes that were wrong, or called unreliable: each file's name says why.
TEST(Verdict, IsRightForWhatOnceWasNot) {
  int scenes = 0;
  for (const auto& file : std::filesystem::directory_iterator(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/random_scenes")) {
    if (file.path().extension() != ".yaml") continue;
    const Verdict verdict = judge(load_scene(file.path()));
    EXPECT_EQ(verdict.outcome, Outcome::kRight)
        << file.path() << ": " << verdict.error << " m off, " << verdict.allowed << " m allowed " << verdict.reason;
    ++scenes;
  }
  EXPECT_GT(scenes, 0);
}

// Scenes whose error no tolerance of these showed: the judge has a hundredth of the tightest.
TEST(Verdict, IsRightAtEveryTolerance) {
  for (const auto& file :
       std::filesystem::directory_iterator(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/every_tolerance")) {
    if (file.path().extension() != ".yaml") continue;
    for (const double tolerance : {1e-5, 3e-7, 1e-8}) {
      const Scene scene = at_tolerance(load_scene(file.path()), tolerance);
      const Verdict verdict = judge(scene);
      EXPECT_EQ(verdict.outcome, Outcome::kRight) << file.path() << " at " << tolerance << ": " << verdict.error
                                                  << " m off, " << verdict.allowed << " m allowed " << verdict.reason;
      EXPECT_LT(verdict.cpu_time, scene.duration) << file.path();
    }
  }
}

// Scenes of which a method's stages tell nothing: each is wrong where a term of SmoothSystem::max_step, or `jumps`, is
// left out. No rule bounds the steps of the judge, each of which ends at a row.
TEST(SamplingRule, SeesWhatHappensBetweenStages) {
  for (const auto& file : std::filesystem::directory_iterator(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/between_stages")) {
    const Scene scene = load_scene(file.path());
    Scene judge = at_tolerance(scene, 0.01 * scene.solver.relative_tolerance);
    judge.solver.method = "rosenbrock4";
    judge.output_rate = 1e4;
    const Motion motion = run(scene), exact = run(judge);
    EXPECT_EQ(motion.doubt + motion.failure + exact.failure, "") << file.path();
    EXPECT_LT((motion.rows.back() - exact.rows.back()).norm(), 0.25 * motion.promised) << file.path();
  }
}

Scene short_drive() {
  Scene scene;
  scene.duration = 0.3;
  scene.initial.phi() << 0.1, 0.2, 0.3, 0.4;
  TorqueSegment segment;
  segment.constant << 1, 0.5, 0.2, -1;
  scene.drive = TorqueSegments{segment};
  return scene;
}

TEST(Verdict, IsRightForAnOrdinaryDrive) {
  const Verdict verdict = judge(short_drive());
  EXPECT_EQ(verdict.outcome, Outcome::kRight) << verdict.error;
  EXPECT_GT(verdict.error, 0);
  EXPECT_LT(verdict.error, 0.1 * verdict.allowed);
}

// Explicit steps beyond their limit of stability, which errors of 1 m/s and 10 rad/s do not shorten.
TEST(Verdict, WarnsOfStepsThatAreTooLong) {
  Scene scene = short_drive();
  scene.solver.method = "dopri5";
  scene.solver.absolute_tolerance = 1;
  EXPECT_EQ(judge(scene).outcome, Outcome::kWarned);
}

// As CheckWarnsOfAChaoticMotion in simulate_test.
TEST(Verdict, SetsAChaoticMotionApart) {
  Scene scene;
  scene.model = Model::kNoSlip;
  scene.duration = 60;
  scene.output_rate = 2;
  scene.robot.a_X = scene.robot.a_Y = 0;
  scene.robot.mu_1 = Wheels::Constant(0.049);
  scene.robot.mu_2 = Wheels::Zero();
  scene.initial.Omega() = 1;
  LoadSchedule::PlannedWrench push;
  push.wrench.force = {200, 0, 0};
  push.wrench.point = {0.465, 0, 0};
  push.wrench.fixed = true;
  scene.load_schedule.wrenches = {push};
  TorqueSegment segment;
  segment.cos << -3.47, 3.47, -3.47, 3.47;
  segment.period = 2.356;
  scene.drive = TorqueSegments{segment};
  const Verdict verdict = judge(scene);
  EXPECT_EQ(verdict.outcome, Outcome::kSensitive) << verdict.error << " " << verdict.reason;
}

}  // namespace
}  // namespace youbot_base_sim
