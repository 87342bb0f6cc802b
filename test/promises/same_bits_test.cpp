// The same scene and build give the same bits, whatever is written besides and however a run is cut into control
// periods or rows.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "program.h"
#include "random_scene.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

/// A base in motion whose torques jump every now and then, in whole control periods of 1 ms.
Scene sampled_scene(Random& random, Model model) {
  Scene scene = random_scene(random, model, {0.0, 0.1, 0.123, 0.3}, 3);
  scene.duration = 0.5;
  scene.solver.relative_tolerance = 1e-5;
  scene.solver.absolute_tolerance = 1e-8;
  scene.solver.control_period = 1e-3;
  return scene;
}

struct Outcome {
  State state;
  std::vector<RollerSwitch> switches;
};

/// `advance` takes the simulation to the end of its scene.
template <class Advance>
Outcome run(const Scene& scene, Advance&& advance) {
  Simulation simulation(scene);
  advance(simulation);
  EXPECT_EQ(simulation.time(), scene.duration);
  return {simulation.state(), simulation.take_switches()};
}

void expect_same_bits(const Outcome& a, const Outcome& b) {
  EXPECT_TRUE((a.state.values == b.state.values).all());
  ASSERT_EQ(a.switches.size(), b.switches.size());
  for (std::size_t k = 0; k < a.switches.size(); ++k) {
    EXPECT_EQ(a.switches[k].t, b.switches[k].t);
    EXPECT_EQ(a.switches[k].phi, b.switches[k].phi);
    EXPECT_EQ(a.switches[k].wheel, b.switches[k].wheel);
    EXPECT_EQ(a.switches[k].roller_to, b.switches[k].roller_to);
  }
}

TEST(SameBits, HoweverControlPeriodsAreGrouped) {
  Random random(41);
  std::size_t switches = 0;
  for (int trial = 0; trial < 15; ++trial) {
    SCOPED_TRACE(trial);
    const Scene scene = sampled_scene(random, trial % 3 == 0 ? Model::kViscous : Model::kCoulomb);
    const Outcome at_once = run(scene, [](Simulation& simulation) { simulation.advance_to(0.5); });
    switches += at_once.switches.size();
    expect_same_bits(at_once, run(scene, [](Simulation& simulation) {
                       for (int k = 0; k < 500; ++k) simulation.step();
                     }));
    expect_same_bits(at_once, run(scene, [&](Simulation& simulation) {
                       for (int k = 0; k < 500; k += 1 + static_cast<int>(random.uniform(0, 40))) {
                         simulation.advance_to(k * 1e-3);
                       }
                       simulation.advance_to(0.5);
                     }));
  }
  EXPECT_GT(switches, 100u);
}

// Under continuous torques, beyond the paper too: rows on either side of switches and on them, some within one step.
TEST(SameBits, WhereverRowsLie) {
  Random random(42);
  std::size_t switches = 0;
  for (int trial = 0; trial < 15; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = sampled_scene(random, trial % 3 == 0 ? Model::kViscous : Model::kCoulomb);
    scene.solver.control_period = 0;
    if (trial % 2 == 1) scene.robot.normal_reactions = NormalReactions::kDynamic;
    if (trial % 5 == 0) scene.floor.holding_speed = 1e-6;
    const auto advance_at_once = [](Simulation& simulation) {
      simulation.continue_when_tipping();
      simulation.advance_to(0.5);
    };
    const Outcome at_once = run(scene, advance_at_once);
    switches += at_once.switches.size();
    std::vector<double> rows;
    for (int k = 0; k < 100; ++k) rows.push_back(random.uniform(0, 0.5));
    for (const RollerSwitch& event : at_once.switches) {
      for (const double off : {-1e-4, -1e-9, 0.0, 1e-9, 1e-4}) rows.push_back(event.t + off);
    }
    std::sort(rows.begin(), rows.end());
    std::vector<RollerSwitch> taken;
    Outcome by_rows = run(scene, [&](Simulation& simulation) {
      simulation.continue_when_tipping();
      for (const double t : rows) {
        simulation.advance_to(t);
        const auto now = simulation.take_switches();
        taken.insert(taken.end(), now.begin(), now.end());
        EXPECT_LE(taken.empty() ? 0 : taken.back().t, t);
        // None is missing either.
        EXPECT_TRUE(taken.size() == at_once.switches.size() || at_once.switches[taken.size()].t > t);
      }
      simulation.advance_to(0.5);
    });
    by_rows.switches.insert(by_rows.switches.begin(), taken.begin(), taken.end());
    expect_same_bits(at_once, by_rows);
  }
  EXPECT_GT(switches, 100u);
}

/// `simulate` on one scene, again and again.
class SimulateTwiceTest : public testing::Test {
 protected:
  /// What `simulate` writes to --csv with these further arguments.
  std::string csv(const std::string& scene, std::vector<std::string> further = {}) {
    further.insert(further.begin(), {folder_.write("scene.yaml", scene), "--csv", folder_.path("motion")});
    Program run(SIMULATE, further);
    EXPECT_EQ(run.wait(), 0) << run.err();
    return folder_.read("motion");
  }

  /// The rows of a table at whole multiples of 0.1 s, which all output rates below have.
  static std::vector<std::string> common_rows(const std::string& csv) {
    std::vector<std::string> rows;
    std::istringstream stream(csv);
    for (std::string row; std::getline(stream, row);) {
      const double tenths = std::strtod(row.c_str(), nullptr) * 10;
      if (std::abs(tenths - std::round(tenths)) < 1e-9) rows.push_back(row);
    }
    return rows;
  }

  static std::string scene(double output_rate, const std::string& solver) {
    return "duration: 2\noutput_rate: " + std::to_string(output_rate) + "\nsolver: {" + solver +
           "}\ninitial: {twist: [0.2, 0.1, 0.5]}\ndrive: {torque: [{start: 0, constant: [1, 2, -1, 1]}, "
           "{start: 1, sin: [1, -2, 1, 2], period: 0.7}]}\n";
  }

  TemporaryFolder folder_;
};

TEST_F(SimulateTwiceTest, SameBitsWhateverElseIsWritten) {
  for (const std::string solver : {"control_period: 0", "control_period: 0.001"}) {
    const std::string alone = csv(scene(100, solver), {"--quiet"});
    EXPECT_EQ(csv(scene(100, solver), {"--quiet"}), alone);
    EXPECT_EQ(csv(scene(100, solver), {"--switches", folder_.path("switches")}), alone);
    EXPECT_EQ(csv(scene(100, solver), {"--summary", folder_.path("summary"), "--cpu-limit", "1000"}), alone);
#ifdef YOUBOT_BASE_SIM_ROS
    EXPECT_EQ(csv(scene(100, solver), {"--bag", folder_.path("bag")}), alone);
#endif
  }
}

TEST_F(SimulateTwiceTest, SameBitsAtEveryOutputRate) {
  for (const std::string solver : {"control_period: 0.001", ""}) {
    const auto rows = [&](double rate) {
      return common_rows(csv(scene(rate, solver), {"--switches", folder_.path("switches")}));
    };
    const auto expected = rows(10);
    EXPECT_EQ(expected.size(), 1u + 21u);  // with the header
    const std::string switches = folder_.read("switches");
    for (const double rate : {20.0, 50.0, 100.0, 1000.0}) {
      EXPECT_EQ(rows(rate), expected) << rate;
      EXPECT_EQ(folder_.read("switches"), switches) << rate;
    }
    if (!solver.empty()) continue;  // rows within control periods end steps
    for (const double rate : {1.0, 7.0, 123.4}) {
      EXPECT_EQ(rows(rate).back(), expected.back()) << rate;
      EXPECT_EQ(folder_.read("switches"), switches) << rate;
    }
  }
}

// The steps of other methods end at rows, so that their times change the last digits. The default tolerance keeps the
// paper's cases within 1e-5 m over 30 s; two runs are within twice that of each other.
TEST_F(SimulateTwiceTest, WithinTheToleranceAtEveryOutputRateByOtherMethods) {
  const auto numbers = [](const std::string& row) {
    std::vector<double> result;
    std::istringstream stream(row);
    for (std::string cell; std::getline(stream, cell, ',');) result.push_back(std::stod(cell));
    return result;
  };
  const std::string solver = "method: rosenbrock4";
  const auto expected = numbers(common_rows(csv(scene(10, solver))).back());
  for (const double rate : {30.0, 100.0, 1000.0}) {
    const auto end = numbers(common_rows(csv(scene(rate, solver))).back());
    for (std::size_t column = 1; column <= 3; ++column) EXPECT_NEAR(end[column], expected[column], 2e-5) << rate;
  }
}

}  // namespace
}  // namespace youbot_base_sim
