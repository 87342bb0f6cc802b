// The simulation against trajectories of independent solvers (test/data/reference, test/data/beyond), at the default
// tolerance and at a tight one.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "reference_rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

const std::string kRoot = YOUBOT_BASE_SIM_SOURCE_DIR;

struct Case {
  std::string name;   // folder and file
  std::string scene;  // empty: it stands beside the trajectory
  std::string model;  // empty: the scene's
};

struct Accuracy {
  std::optional<double> relative_tolerance;  // none: the default
  double pose, switch_time, N;               // m and rad, s, N
};

// What users are promised: 1e-5 m and rad at the default tolerance, 1e-8 at 1e-10.
const Accuracy kDefault{{}, 1e-5, 1e-4, 1e-2};
const Accuracy kTight{1e-10, 1e-8, 1e-7, 1e-4};

class ReferenceTest : public testing::TestWithParam<Case> {
 protected:
  static void compare(const Accuracy& accuracy) {
    const auto& [name, scene, model] = GetParam();
    SceneSettings settings;
    if (!model.empty()) settings.emplace_back("model", model);
    if (accuracy.relative_tolerance) settings.emplace_back("solver.relative_tolerance", *accuracy.relative_tolerance);
    Simulation simulation(load_scene(kRoot + (scene.empty() ? "/test/data/" + name + ".yaml" : scene), settings));
    for (const auto& row : reference_rows(name)) {
      const auto number = [&](std::size_t column) { return std::stod(row[column]); };
      simulation.advance_to(number(0));
      const State& x = simulation.state();
      EXPECT_LE(std::hypot(x.x() - number(1), x.y() - number(2)), accuracy.pose) << row[0];
      EXPECT_NEAR(x.psi(), number(3), accuracy.pose) << row[0];
      if (!is_beyond()) continue;
      const Wheels N = simulation.contacts().N;
      for (std::size_t i = 0; i < kWheels; ++i)
        EXPECT_NEAR(N[static_cast<int>(i)], number(19 + i), accuracy.N) << row[0];
    }
    compare_switches(simulation.take_switches(), reference_rows(name + "_switches"), accuracy.switch_time);
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
  }

  /// Those beyond the paper have every switch by time, wheel and direction; the others some, by number, with all else.
  static bool is_beyond() { return GetParam().name.rfind("beyond/", 0) == 0; }

  static void compare_switches(const std::vector<RollerSwitch>& switches,
                               const std::vector<std::vector<std::string>>& rows, double time) {
    ASSERT_FALSE(rows.empty());
    ASSERT_EQ(switches.size(), is_beyond() ? rows.size() : std::stoul(rows.back()[0]) + 1);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto& row = rows[k];
      SCOPED_TRACE(row[0]);
      const std::size_t first = is_beyond() ? 0 : 1;
      const RollerSwitch& event = switches[is_beyond() ? k : std::stoul(row[0])];
      EXPECT_NEAR(event.t, std::stod(row[first]), time);
      EXPECT_EQ(kWheelNames[static_cast<std::size_t>(event.wheel)], row[first + 1]);
      EXPECT_EQ(event.direction, std::stoi(row.back()));
      if (is_beyond()) continue;
      EXPECT_EQ(event.roller_from, std::stoi(row[3]));
      EXPECT_EQ(event.roller_to, std::stoi(row[4]));
      EXPECT_NEAR(event.phi, std::stod(row[5]), 1e-14 * (1 + std::abs(event.phi)));
    }
  }
};

TEST_P(ReferenceTest, DefaultTolerance) { compare(kDefault); }
TEST_P(ReferenceTest, TightTolerance) { compare(kTight); }

std::string name_of_case(const testing::TestParamInfo<Case>& tested) {
  return tested.param.name.substr(tested.param.name.find('/') + 1);
}

const std::string kScenes = "/config/scenes/";
INSTANTIATE_TEST_SUITE_P(
    Cases, ReferenceTest,
    testing::Values(
        Case{"reference/case1_as_printed_viscous", kScenes + "case1_as_printed.yaml", "viscous"},
        Case{"reference/case1_as_printed_coulomb", kScenes + "case1_as_printed.yaml", "coulomb"},
        Case{"reference/case1_counter_clockwise_viscous", kScenes + "case1_counter_clockwise.yaml", "viscous"},
        Case{"reference/case1_counter_clockwise_coulomb", kScenes + "case1_counter_clockwise.yaml", "coulomb"},
        Case{"reference/case2_viscous", kScenes + "case2.yaml", "viscous"},
        Case{"reference/case2_coulomb", kScenes + "case2.yaml", "coulomb"},
        Case{"reference/small_regularization", "", ""}, Case{"reference/torque_reversal", "", ""},
        Case{"reference/coasting_to_rest", "", ""}, Case{"reference/drive_dry", "", ""},
        Case{"reference/start_on_edge", "", ""}, Case{"beyond/angle_44_7", "", ""}, Case{"beyond/angle_o", "", ""},
        Case{"beyond/angle_per_wheel", "", ""}, Case{"beyond/floor_patch", "", ""}, Case{"beyond/floor_slope", "", ""},
        Case{"beyond/load_placed", "", ""}, Case{"beyond/normal_case2", "", ""},
        Case{"beyond/normal_start_stop", "", ""}, Case{"beyond/spin_case2", "", ""}),
    name_of_case);

// Model 1 needs no reference: under the torque profile its motion is the desired motion itself.
TEST(NoSlipReferenceTest, FollowsTheDesiredMotion) {
  for (const char* name : {"case1_as_printed", "case1_counter_clockwise", "case2"}) {
    const Scene scene = load_scene(kRoot + "/config/scenes/" + name + ".yaml", {{"model", "no_slip"}});
    const ReferenceMotion& motion = std::get<ReferenceMotion>(scene.drive);
    Simulation simulation(scene);
    for (int k = 1; k <= 10; ++k) {
      simulation.advance_to(3.0 * k);
      // 1e-7 relative tolerance on velocities of 0.5 m/s.
      EXPECT_LT((simulation.state().velocity() - motion.velocity(3.0 * k)).norm(), 1e-6) << name << k;
    }
    EXPECT_NEAR(std::hypot(simulation.state().x(), simulation.state().y()), 2.5, 1e-5) << name;
    EXPECT_TRUE(simulation.take_switches().empty());
  }
}

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
