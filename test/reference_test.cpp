// The simulation against trajectories of an independent solver (test/data/reference), at the default tolerance and at a
// tight one.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>

#include "reference_rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

const std::string kRoot = YOUBOT_BASE_SIM_SOURCE_DIR;

struct Case {
  std::string name;
  std::string scene;
  std::string model;  // empty: the scene's
};

struct Accuracy {
  std::optional<double> relative_tolerance;  // none: the default
  double position, heading, switch_time;
};

// What users are promised: 1e-5 m and rad at the default tolerance, 1e-8 at 1e-10.
const Accuracy kDefault{{}, 1e-5, 1e-5, 1e-4};
const Accuracy kTight{1e-10, 1e-8, 1e-8, 1e-7};

class ReferenceTest : public testing::TestWithParam<Case> {
 protected:
  void compare(const Accuracy& accuracy) {
    SceneSettings settings;
    if (!GetParam().model.empty()) settings.emplace_back("model", GetParam().model);
    if (accuracy.relative_tolerance) settings.emplace_back("solver.relative_tolerance", *accuracy.relative_tolerance);
    Simulation simulation(load_scene(kRoot + GetParam().scene, settings));

    for (const auto& row : reference_rows("reference/" + GetParam().name)) {
      simulation.advance_to(std::stod(row[0]));
      const State& x = simulation.state();
      EXPECT_LE(std::hypot(x.x() - std::stod(row[1]), x.y() - std::stod(row[2])), accuracy.position) << row[0];
      EXPECT_NEAR(x.psi(), std::stod(row[3]), accuracy.heading) << row[0];
    }
    compare_switches(simulation.take_switches(), reference_rows("reference/" + GetParam().name + "_switches"),
                     accuracy.switch_time);
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
  }

  void compare_switches(const std::vector<RollerSwitch>& switches, const std::vector<std::vector<std::string>>& rows,
                        double time) {
    ASSERT_FALSE(rows.empty());
    ASSERT_EQ(switches.size(), std::stoul(rows.back()[0]) + 1);
    for (const auto& row : rows) {
      const RollerSwitch& event = switches[std::stoul(row[0])];
      EXPECT_NEAR(event.t, std::stod(row[1]), time) << row[0];
      EXPECT_EQ(kWheelNames[static_cast<std::size_t>(event.wheel)], row[2]) << row[0];
      EXPECT_EQ(event.roller_from, std::stoi(row[3])) << row[0];
      EXPECT_EQ(event.roller_to, std::stoi(row[4])) << row[0];
      EXPECT_NEAR(event.phi, std::stod(row[5]), 1e-14 * (1 + std::abs(event.phi))) << row[0];
      EXPECT_EQ(event.direction, std::stoi(row[6])) << row[0];
    }
  }
};

TEST_P(ReferenceTest, DefaultTolerance) { compare(kDefault); }
TEST_P(ReferenceTest, TightTolerance) { compare(kTight); }

INSTANTIATE_TEST_SUITE_P(
    Cases, ReferenceTest,
    testing::Values(Case{"case1_as_printed_viscous", "/config/scenes/case1_as_printed.yaml", "viscous"},
                    Case{"case1_as_printed_coulomb", "/config/scenes/case1_as_printed.yaml", "coulomb"},
                    Case{"case1_counter_clockwise_viscous", "/config/scenes/case1_counter_clockwise.yaml", "viscous"},
                    Case{"case1_counter_clockwise_coulomb", "/config/scenes/case1_counter_clockwise.yaml", "coulomb"},
                    Case{"case2_viscous", "/config/scenes/case2.yaml", "viscous"},
                    Case{"case2_coulomb", "/config/scenes/case2.yaml", "coulomb"},
                    Case{"small_regularization", "/test/data/reference/small_regularization.yaml", ""},
                    Case{"torque_reversal", "/test/data/reference/torque_reversal.yaml", ""},
                    Case{"coasting_to_rest", "/test/data/reference/coasting_to_rest.yaml", ""},
                    Case{"drive_dry", "/test/data/reference/drive_dry.yaml", ""},
                    Case{"start_on_edge", "/test/data/reference/start_on_edge.yaml", ""}),
    [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

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

}  // namespace
}  // namespace youbot_base_sim
