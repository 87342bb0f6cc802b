// The simulation beyond the paper against trajectories of an independent solver (test/data/beyond), at the default
// tolerance and at a tight one.

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "reference_rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

struct Accuracy {
  std::optional<double> relative_tolerance;  // none: the default
  double pose, switch_time, N;               // m and rad, s, N
};

// What users are promised: 1e-5 m and rad at the default tolerance, 1e-8 at 1e-10.
const Accuracy kDefault{{}, 1e-5, 1e-4, 1e-2};
const Accuracy kTight{1e-10, 1e-8, 1e-7, 1e-4};

class BeyondReferenceTest : public testing::TestWithParam<const char*> {
 protected:
  static void compare(const Accuracy& accuracy) {
    const std::string name = GetParam();
    SceneSettings settings;
    if (accuracy.relative_tolerance) settings.emplace_back("solver.relative_tolerance", *accuracy.relative_tolerance);
    Simulation simulation(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/beyond/" + name + ".yaml", settings));
    for (const auto& row : reference_rows("beyond/" + name)) {
      const auto number = [&](std::size_t column) { return std::stod(row[column]); };
      simulation.advance_to(number(0));
      const State& x = simulation.state();
      EXPECT_LE(std::hypot(x.x() - number(1), x.y() - number(2)), accuracy.pose) << row[0];
      EXPECT_NEAR(x.psi(), number(3), accuracy.pose) << row[0];
      const Wheels N = simulation.contacts().N;
      for (std::size_t i = 0; i < kWheels; ++i)
        EXPECT_NEAR(N[static_cast<int>(i)], number(19 + i), accuracy.N) << row[0];
    }
    compare_switches(simulation.take_switches(), reference_rows("beyond/" + name + "_switches"), accuracy.switch_time);
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
  }

  static void compare_switches(const std::vector<RollerSwitch>& switches,
                               const std::vector<std::vector<std::string>>& rows, double time) {
    ASSERT_FALSE(rows.empty());
    ASSERT_EQ(switches.size(), rows.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      EXPECT_NEAR(switches[k].t, std::stod(rows[k][0]), time) << k;
      EXPECT_EQ(kWheelNames[static_cast<std::size_t>(switches[k].wheel)], rows[k][1]) << k;
      EXPECT_EQ(switches[k].direction, std::stoi(rows[k][2])) << k;
    }
  }
};

TEST_P(BeyondReferenceTest, DefaultTolerance) { compare(kDefault); }
TEST_P(BeyondReferenceTest, TightTolerance) { compare(kTight); }

INSTANTIATE_TEST_SUITE_P(Cases, BeyondReferenceTest,
                         testing::Values("floor_patch", "floor_slope", "load_placed", "normal_case2",
                                         "normal_start_stop", "spin_case2"),
                         [](const testing::TestParamInfo<const char*>& tested) { return std::string(tested.param); });

// The reference says 36.82 us and the left side.
TEST(TippingTest, EndsAtTheLimitAndNamesTheSide) {
  const Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/beyond/tips_over.yaml");
  Simulation simulation(scene);
  try {
    simulation.advance_to(scene.duration);
    FAIL() << "did not tip over";
  } catch (const TippedOver& error) {
    EXPECT_NEAR(error.time(), 36.82e-6, 0.01e-6);
    EXPECT_EQ(error.side(), Side::kLeft);
  }
  Simulation going_on(scene);
  going_on.continue_when_tipping();
  going_on.advance_to(100e-6);
  const ReactionRecord record = *going_on.reaction_record();
  EXPECT_EQ(record.tipping, Side::kLeft);
  EXPECT_NEAR(record.tipped_at.value(), 36.82e-6, 30e-6);  // where a step ends
  const Wheels N = going_on.contacts().N;
  EXPECT_EQ(N[1], 0);
  EXPECT_EQ(N[3], 0);
  EXPECT_NEAR(N.sum(), scene.robot.m_s() * scene.floor.g, 1e-9);
  going_on.advance_to(200e-6);
  EXPECT_EQ(going_on.reaction_record()->tipped_at, record.tipped_at);
}

}  // namespace
}  // namespace youbot_base_sim
