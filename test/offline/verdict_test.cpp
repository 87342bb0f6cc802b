// Which results are called reliable, and what the console shows of a run.

#include "youbot_base_sim/offline/verdict.h"

#include <gtest/gtest.h>

#include <memory>

#include "../accuracy.h"
#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/offline/summary.h"

namespace youbot_base_sim {
namespace {

Scene driven_scene() {
  Scene scene;
  scene.duration = 0.5;
  TorqueSegment segment;
  segment.constant << 1, 0.5, 0.2, -1;
  scene.drive = TorqueSegments{segment};
  return scene;
}

/// What is said of a run with a row each `interval`, s.
std::string reason_of(Scene scene, double interval) {
  scene.output_rate = 1 / interval;
  Simulation simulation(scene);
  RowLoop rows(simulation);
  while (rows.next()) {
  }
  return unreliability_reason(simulation, rows, nullptr);
}

TEST(Reliability, HoldsAtEveryToleranceHoweverFewRows) {
  for (const double tolerance : {1e-12, 1e-9, 3e-7, 1e-5, 1e-3, 0.1}) {
    for (const double interval : {1e-3, 0.01, 0.5}) {
      EXPECT_EQ(reason_of(at_tolerance(driven_scene(), tolerance), interval), "") << tolerance << " " << interval;
    }
  }
}

// The wheels turn forth and back, and stand still at each row: the energy between the rows is not seen.
TEST(Reliability, HoldsWhereTheMotionIsAtRestAtAllRows) {
  Scene scene = driven_scene();
  TorqueSegment segment;
  segment.cos = Wheels::Constant(0.5);
  segment.period = 0.1;
  scene.drive = TorqueSegments{segment};
  EXPECT_EQ(reason_of(scene, 0.05), "");
}

/// Explicit steps beyond their limit of stability, which errors of 1 m/s and 10 rad/s do not shorten: in 0.05 s the
/// base is off by 0.4 mm of 0.5 mm, and its energy of 0.3 J by 700 J.
Scene unstable_scene() {
  Scene scene = driven_scene();
  scene.duration = 0.05;
  scene.solver.method = "dopri5";
  scene.solver.absolute_tolerance = 1;
  return scene;
}

TEST(Reliability, IsDeniedWhereTheEnergyIsOff) {
  for (const double tolerance : {3e-7, 1e-4, 1e-3, 0.1}) {
    Scene scene = unstable_scene();
    scene.solver.relative_tolerance = tolerance;
    const std::string doubt = reason_of(scene, 0.01);
    EXPECT_NE(doubt.find("energy balance is off by"), std::string::npos) << tolerance << ": " << doubt;
    EXPECT_EQ(doubt.find('\n'), std::string::npos);
  }
}

// Where contacts hardly give, a roller takes its rate within a step, in which its wheel turns at 600 rad/s. Iterations
// that end too soon there lose more than ten times the tolerance, as a share of the energy.
TEST(Reliability, HoldsWhereContactsHardlyGive) {
  Scene scene = driven_scene();
  scene.model = Model::kViscous;
  scene.duration = 0.3;
  RobotParameters& robot = scene.robot;
  robot.m = 56;
  robot.mu_1.setZero();
  robot.J_1 = 0.0038;
  scene.floor.nu = 2.7e-9;
  TorqueSegment segment;
  segment.constant << -90, 36, -67, 86;
  scene.drive = TorqueSegments{segment};
  for (const double tolerance : {1e-4, 1e-5}) {
    EXPECT_EQ(reason_of(at_tolerance(scene, tolerance), 0.05), "");
    const auto simulation = run(scene, tolerance);
    EXPECT_LT(simulation->energy_balance_error(), tolerance * simulation->kinetic_energy());
  }
}

TEST(Reliability, HoldsByEveryMethod) {
  Scene scene = driven_scene();
  scene.duration = 0.01;
  for (const std::string& method : method_names()) {
    scene.solver.method = method;
    EXPECT_EQ(reason_of(scene, 0.01), "") << method;
  }
}

// Wheels that work against each other: rounding of the slip, some 1e-16 m/s, is 1e-6 of their friction here.
TEST(Reliability, HoldsWherePrescribedWheelsStickAtATightTolerance) {
  Scene scene;
  scene.duration = 1.4;
  scene.floor.nu = 1e-10;
  WheelTable table;
  table.t = {0, 0.29, 0.57, 0.86, 1.14, 1.43};
  table.values = {{1.40, -1.50, 3.59, 0.56}, {1.63, -1.62, 3.71, 0.85}, {2.09, -1.48, 3.58, 0.96},
                  {2.64, -1.60, 3.61, 1.16}, {3.17, -1.50, 3.63, 1.32}, {3.80, -1.56, 3.88, 1.19}};
  scene.initial.phi() = table.values.front();
  scene.drive = std::make_shared<const WheelSpline>(table);
  EXPECT_EQ(reason_of(at_tolerance(scene, 1e-10), 0.01), "");
}

TEST(Reliability, DoesNotDependOnTheAbsoluteTolerance) {
  Scene scene = unstable_scene();
  EXPECT_NE(reason_of(scene, 0.01), "");
  const double loose = promised_error(Simulation(scene), {});
  scene.solver.absolute_tolerance = 1e-3 * scene.solver.relative_tolerance;
  EXPECT_EQ(loose, promised_error(Simulation(scene), {}));
}

TEST(Reliability, IsDeniedWhereTheIntegrationFellBack) {
  // An explicit method on friction that turns within a nanometre a second: its steps take more than the bound of work.
  Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case1_counter_clockwise.yaml",
                           {{"solver.method", "dopri5"}});
  scene.duration = 1e-3;
  scene.floor.nu = 1e-9;
  scene.solver.keeps_up = true;
  const std::string doubt = reason_of(scene, 0.01);
  EXPECT_NE(doubt.find("fallback steps"), std::string::npos) << doubt;
}

// A wheel that is held early, so that work keeps to the bound of real time, has lost no momentum that counts.
TEST(Reliability, HoldsWhereWheelsAreHeldEarly) {
  Scene held = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/studies/bench/scenes/held_wheel.yaml",
                          {{"solver.relative_tolerance", 1e-11}});
  held.duration = 2;
  held.solver.keeps_up = true;
  Simulation simulation(held);
  simulation.advance_to(held.duration);
  ASSERT_GT(simulation.statistics().eased_periods, 0u);
  EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
}

// What the wheels would still do between two rollers moves the first base by 2e-4 m: more than the default tolerance
// allows. The second one by 8e-5 m, since rollers that take over at rest kick it at each of 1400 crossings.
TEST(Reliability, IsDeniedWhereWheelsThatStillChatterMustRest) {
  const auto doubt = [](const std::string& name, double tolerance) {
    return reason_of(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/regressions/" + name + ".yaml",
                                {{"solver.relative_tolerance", tolerance}}),
                     0.1);
  };
  for (const char* name : {"chatter_goes_on", "rollers_kick_a_wheel_that_chatters"}) {
    for (const double tolerance : {1e-9, 3e-7}) {
      EXPECT_NE(doubt(name, tolerance).find("had not stopped chattering"), std::string::npos) << name << tolerance;
    }
  }
  EXPECT_EQ(doubt("chatter_goes_on", 1e-3), "");
}

// At rest, with the wheels on the middles of their rollers, (4.17) gives 79.57, 105.07, 69.55 and 95.05 N.
TEST(Console, NamesTheWheelsOfTheNormalReactions) {
  Scene scene;
  scene.duration = 0.01;
  scene.drive = TorqueSegments{TorqueSegment()};
  scene.robot.normal_reactions = NormalReactions::kDynamic;
  Simulation simulation(scene);
  RowLoop rows(simulation);
  while (rows.next()) {
  }
  const std::string text = summary_text(simulation, 1, rows, nullptr, false);
  EXPECT_NE(text.find("minimum normal reactions, N: fl 79.57, fr 105.1, bl 69.55, br 95.05\n"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace youbot_base_sim
