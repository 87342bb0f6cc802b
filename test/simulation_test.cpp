// The front door: control periods, reset, what a switch keeps, and the bound of work where switching has no end.

#include "youbot_base_sim/simulation.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <utility>

#include "accuracy.h"
#include "temporary_folder.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {
namespace {

class SimulationTest : public testing::Test {
 protected:
  Scene load(const std::string& text) { return load_scene(folder_.write("scene.yaml", text)); }
  /// A scene in test/data/regressions.
  static Scene scene_of_data(const std::string& name, const SceneSettings& settings = {}) {
    return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/regressions/" + name + ".yaml", settings);
  }
  TemporaryFolder folder_;
};

/// A wheel is held between two rollers: the edge drives it back from both sides. Torques of a random search.
const char kHeldWheel[] =
    "duration: 10\ndrive: {torque: [{start: 0, constant: [-1.6608860541984796, 0.6423426008195765, "
    "1.6391085502068918, 1.12921153639236]}]}\n";

const char kForward[] =
    "duration: 2\nsolver: {control_period: 0.001}\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n";

TEST_F(SimulationTest, SamplesTheDriveOnceAtEachPeriodsBegin) {
  std::vector<double> sampled;
  Simulation simulation(load(kForward));
  const auto controller = [&](double t, const State&) -> Wheels {
    sampled.push_back(t);
    return Wheels::Constant(1.0);
  };
  advance_to(simulation, 0.0025, controller);  // in the middle of the third period
  advance_to(simulation, 0.0028, controller);
  EXPECT_EQ(sampled, (std::vector<double>{0, 0.001, 0.002}));
  EXPECT_FALSE(simulation.period_begins());
  simulation.step();
  EXPECT_TRUE(simulation.period_begins());
  EXPECT_DOUBLE_EQ(simulation.time(), 0.003);
  EXPECT_EQ(sampled.size(), 3u);
}

TEST_F(SimulationTest, PeriodsDoNotDrift) {
  Simulation simulation(load(kForward));
  simulation.set_torque(Wheels::Zero());
  for (int k = 0; k < 100000; ++k) simulation.step();
  EXPECT_DOUBLE_EQ(simulation.time(), 100.0);
}

/// A push of 1 MN along x from `start` to `end`, and when to look where the base has come to, s.
struct Push {
  double start, end, duration;
};

// A change of what pushes acts at its own time, however long the control periods are within which it lies.
TEST_F(SimulationTest, ShortPushesActWhateverTheControlPeriod) {
  const auto way = [&](const Push& push, double period) {
    std::ostringstream scene;
    scene.precision(12);
    scene << "duration: " << push.duration << "\nsolver: {control_period: " << period << "}\nwrenches: [{force: "
          << "[1000000, 0, 0], start: " << push.start << ", end: " << push.end << "}]\n";
    Simulation simulation(load(scene.str()));
    simulation.advance_to(push.duration);
    return simulation.state().x();
  };
  for (const Push& push : {Push{9.999995, 10.000004, 12}, Push{1.9999995, 2.0000005, 3}, Push{0, 1e-6, 3}}) {
    const double expected = way(push, 0.001);
    EXPECT_GT(expected, 5e-3);
    for (const double period : {0.01, 1.0, 10.0}) {
      EXPECT_NEAR(way(push, period), expected, 1e-3 * expected) << push.start << " s, " << period << " s";
    }
  }
}

TEST_F(SimulationTest, AdvancesBySmallPartsOfAPeriod) {
  Simulation simulation(
      load("duration: 1e-6\nsolver: {control_period: 10}\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n"));
  simulation.advance_to(1e-6);
  EXPECT_EQ(simulation.time(), 1e-6);
  EXPECT_GT(simulation.state().dphi()[0], 0);
}

// Under a continuous torque rows lie within steps, the rollers change at their times, and every row is as accurate as
// the tolerance says, the friction of contacts that grip too.
TEST_F(SimulationTest, RowsWithinStepsAreAccurate) {
  const auto scene = [](double tolerance) {
    return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml",
                      {{"solver.relative_tolerance", tolerance}});
  };
  constexpr double kTolerance = 3e-7;
  Simulation rows(scene(kTolerance)), exact(scene(1e-11));
  const double initial = rows.kinetic_energy();
  std::uint64_t within = 0, steps = 0;
  for (int k = 1; k <= 4000; ++k) {
    for (Simulation* simulation : {&rows, &exact}) simulation->advance_to(k / 2000.0);
    const bool is_within = rows.statistics().steps == std::exchange(steps, rows.statistics().steps);
    within += is_within;
    const State &x = rows.state(), &y = exact.state();
    EXPECT_EQ(rows.rollers(), exact.rollers()) << k;
    EXPECT_LT((x.values - y.values).col(0).head<3>().abs().maxCoeff(), kTolerance) << k;
    EXPECT_LT((x.values - y.values).col(1).abs().maxCoeff(), kTolerance) << k;
    EXPECT_LT((x.phi() - y.phi()).abs().maxCoeff(), 10 * kTolerance) << k;
    EXPECT_LT((x.dphi() - y.dphi()).abs().maxCoeff(), 60 * kTolerance) << k;
    const ContactDetails c = rows.contacts(), d = exact.contacts();
    // Of 45 N, each within 1 mm/s of slip; at a step's end friction is that of the slip.
    const double allowed = is_within ? 0.012 : 0.04;
    EXPECT_LT((c.F_X - d.F_X).abs().maxCoeff(), allowed) << k;
    EXPECT_LT((c.F_Y - d.F_Y).abs().maxCoeff(), allowed) << k;
    EXPECT_NEAR(rows.kinetic_energy() - initial, x.work(), 10 * kTolerance) << k;
  }
  EXPECT_GT(within, 1000u);
}

// Where friction turns at once, the forces at Radau's stages are far less accurate than the velocities.
TEST_F(SimulationTest, EnergyBalanceClosesAtRowsWithinSteps) {
  Simulation simulation(
      load("duration: 0.5\nmodel: viscous\nfloor: {slip_regularization: 1e-8}\ninitial: {twist: [0.3, 0.2, 0.5]}\n"
           "drive: {torque: [{start: 0, sin: [1, -2, 1, 2], period: 0.7}]}\n"));
  for (int k = 1; k <= 1000; ++k) {
    simulation.advance_to(k / 2000.0);
    EXPECT_LT(simulation.energy_balance_error(), 1e-6) << k;
  }
  EXPECT_LT(simulation.statistics().steps, 500u);
}

// What acts or changes from a row on that lies within a step: as if the scene had it, and whatever rows came before.
TEST_F(SimulationTest, ChangesBetweenRowsActFromTheRow) {
  const std::string scene =
      "duration: 1\ninitial: {twist: [0.3, 0.2, 0.5]}\ndrive: {torque: "
      "[{start: 0, sin: [1, -2, 1, 2], period: 0.7}]}\n";
  const Wrench push{{20, 10, 0}, {0.1, 0, 0}, 0, false};
  constexpr double kChange = 0.456789;  // s
  const auto run = [&](const std::string& text, int rows, bool is_put) {
    Simulation simulation(load(text));
    for (int k = 1; k <= rows; ++k) simulation.advance_to(kChange * k / rows);
    const std::uint64_t steps = simulation.statistics().steps;
    simulation.advance_to(kChange + 1e-7);
    if (rows > 0) {
      EXPECT_EQ(simulation.statistics().steps, steps) << "no longer within a step";
    }
    AppliedLoads applied;
    applied.wrenches.push_back(push);
    if (rows > 0) simulation.set_loads(applied);  // by the extended equations, which take over
    simulation.advance_to(0.7123);
    if (rows > 0) simulation.set_loads(applied);
    if (is_put) simulation.set_state({1, 2, 3}, {0.1, 0, 0.2}, std::nullopt);
    simulation.advance_to(1);
    EXPECT_LT(simulation.energy_balance_error(), 1e-5);
    return State(simulation.state());
  };
  const State of_scene =
      run(scene + fmt::format("wrenches: [{{force: [20, 10, 0], point: [0.1, 0, 0], start: {}}}]\n", kChange + 1e-7), 0,
          false);
  for (const bool is_put : {false, true}) {
    const State once = run(scene, 1, is_put), often = run(scene, 777, is_put);
    EXPECT_TRUE((once.values == often.values).all());
    if (!is_put) {
      EXPECT_LT((once.values - of_scene.values).leftCols<2>().abs().maxCoeff(), 1e-6);
    }
  }
}

// Held torques converge to continuous ones with the first order of a hold: half a period of delay.
TEST_F(SimulationTest, HeldTorqueFollowsAContinuousOne) {
  const std::string drive =
      "duration: 1\ndrive: {torque: [{start: 0, sin: [2, 2, 2, 2], period: 1}]}\nsolver: {control_period: ";
  const auto end = [&](const std::string& period) {
    Simulation simulation(load(drive + period + "}\n"));
    simulation.advance_to(1);
    return simulation.state().x();
  };
  const double continuous = end("0"), coarse = end("0.02") - continuous, fine = end("0.01") - continuous;
  EXPECT_GT(std::abs(coarse), 1e-4);
  EXPECT_NEAR(coarse / fine, 2, 0.1);
}

TEST_F(SimulationTest, RollersKeepTheirAnglesWhileTheyAreOffTheFloor) {
  Simulation simulation(
      load("duration: 9\ninitial: {twist: [0.3, 0.3, 0]}\ndrive: {torque: [{start: 0, constant: [0, 2, 2, 0]}]}\n"));
  std::array<int, kWheels> before = simulation.rollers();
  double angle = 0;
  int compared = 0;
  for (int k = 1; k <= 200; ++k) {
    simulation.advance_to(0.01 * k);
    const std::array<int, kWheels> now = simulation.rollers();
    if (now[1] != before[1]) {
      angle = simulation.roller_angle(1, before[1]);  // has just left the floor
      before = now;
    } else if (k > 20) {
      EXPECT_EQ(simulation.roller_angle(1, (now[1] + 5) % 6), angle);
      ++compared;
    }
  }
  EXPECT_GT(compared, 50);
  EXPECT_NE(angle, 0);
}

// The same motion, with all wheels turned by whole turns as far as a scene may turn them.
TEST_F(SimulationTest, WheelsThatStartFarFromZeroSwitchAtTheSameInstants) {
  const double pitch = 2 * M_PI / RobotParameters().rollers, turn = 954'924 * pitch;  // whole turns: 1e6 rad, nearly
  Scene near = load(
      "duration: 1\ninitial: {wheel_angles: [0.1, 0.2, -0.3, 0.4], twist: [0.8, 0.6, 0.5]}\n"
      "drive: {torque: [{start: 0, constant: [2, -1, 1.5, 2]}]}\n");
  Scene far = near;
  far.initial.phi() += Wheels(turn, -turn, turn, -turn);
  near.initial.phi() = far.initial.phi() - Wheels(turn, -turn, turn, -turn);  // rounded alike
  Simulation a(near), b(far);
  a.advance_to(1);
  b.advance_to(1);
  const std::vector<RollerSwitch> expected = a.take_switches(), found = b.take_switches();
  ASSERT_GT(expected.size(), 20u);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].wheel, expected[k].wheel);
    EXPECT_EQ(found[k].roller_from, expected[k].roller_from);
    EXPECT_EQ(found[k].roller_to, expected[k].roller_to);
    EXPECT_EQ(found[k].direction, expected[k].direction);
    EXPECT_NEAR(found[k].t, expected[k].t, 1e-8);
  }
}

TEST_F(SimulationTest, MovesByTheSameBitsWhereverItStarts) {
  const auto text = [](double x, double y) {
    return fmt::format(
        "duration: 2\ninitial: {{pose: [{}, {}, 0.3], twist: [0.5, 0.1, 0.2]}}\n"
        "floor: {{patches: [{{rectangle: [{}, {}, {}, {}], friction: 0.1, edge: 0.125}}]}}\n"
        "drive: {{torque: [{{start: 0, constant: [1, 2, -1, 0.5]}}]}}\n",
        x, y, x + 0.25, y - 8, x + 8, y + 8);
  };
  const Scene scene = load(text(0, 0)), shifted_scene = load(text(917504, -524288));
  Simulation simulation(scene), shifted(shifted_scene);
  const auto expect_same_motion = [&](double end) {
    while (simulation.time() < end) {
      simulation.advance_to(simulation.time() + 0.25);
      shifted.advance_to(simulation.time());
      State expected = simulation.state();
      expected.x() += 917504;
      expected.y() -= 524288;
      EXPECT_TRUE((expected.values == shifted.state().values).all()) << simulation.time();
    }
  };
  expect_same_motion(2);
  EXPECT_GT(simulation.state().x(), 0.3) << "over the edge of the patch";
  simulation.set_state({-1, 0.5, 0.3}, {0.5, 0.1, 0.2}, scene.initial.phi());
  shifted.set_state({917503, -524287.5, 0.3}, {0.5, 0.1, 0.2}, scene.initial.phi());
  expect_same_motion(4);
}

// As rollers have that are so light that they are as fast as that at once.
TEST_F(SimulationTest, RollersWithoutInertiaStartAtTheRatesOfTheEquations) {
  const std::string scene =
      "duration: 1e-5\ninitial: {twist: [0.3, 0.2, 0.5], roller_rates: [10, -20, 30, 40]}\n"
      "drive: {torque: [{start: 0, constant: [1, 2, -1, 0.5]}]}\nrobot: {roller_inertia: ";
  const Scene without = load(scene + "0}\n"), light = load(scene + "1e-12}\n");
  Simulation start(without), soon(light);
  soon.advance_to(1e-7);
  EXPECT_LT((start.state().dgamma() - soon.state().dgamma()).abs().maxCoeff(), 0.01);
}

TEST_F(SimulationTest, RollerAtRestAfterASwitchLosesItsRateAndTheAuditKnows) {
  const std::string scene =
      "duration: 5\ninitial: {twist: [0, 0.5, 0.2], wheel_angles: [0.1, 0.1, 0.1, 0.1]}\n"
      "drive: {torque: [{start: 0, constant: [-2.9, 2.8, 2.3, -2.4]}]}\nrobot: ";
  Simulation continuous(load(scene + "{roller_rate_at_switch: continuous}\n"));
  Simulation at_rest(load(scene + "{roller_rate_at_switch: at_rest}\n"));
  continuous.advance_to(5);
  at_rest.advance_to(5);
  EXPECT_LT(at_rest.energy_balance_error(), 1e-5);
  const double apart = (continuous.state().values.col(0) - at_rest.state().values.col(0)).abs().maxCoeff();
  EXPECT_GT(apart, 1e-4);  // a modelling choice that shows: 5 mm over the 30 s of Case 2
  EXPECT_LT(apart, 1e-2);
}

TEST_F(SimulationTest, WheelIsHeldBetweenTwoRollers) {
  const auto end = [this](double tolerance) {
    const auto simulation = run(load(kHeldWheel), tolerance);
    EXPECT_GT(simulation->statistics().shared_contacts, 0u);
    EXPECT_EQ(simulation->statistics().forced_hold_speed, 0);  // it chatters until that no longer counts
    EXPECT_EQ(simulation->statistics().exhausted, 0u);
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u);
    EXPECT_LT(simulation->energy_balance_error(), 1e-4);
    return simulation->state();
  };
  EXPECT_LT(distance(end(1e-6), end(1e-9)), 1e-6 * 2.8);  // times the path, m
}

// Nothing acts on a base on ice: it goes straight, however fast it rotates. Its velocities are those in its own frame,
// whose errors nothing damps. Steps in which that frame may rotate as far as their error estimate allows end 0.13 m
// off.
TEST_F(SimulationTest, GoesStraightWhereItRotatesOnIce) {
  constexpr double kDuration = 20, kPath = kDuration * (1 + 0.279 * 50);  // s; m, at the wheels' centres
  const auto miss = [&](const std::string& base, double tolerance) {
    const State x = run(load("duration: 20\ninitial: {twist: [1, 0, 50]}\n" + base), tolerance)->state();
    return std::hypot(x.x() - kDuration, x.y()) / (tolerance * kPath);
  };
  for (const double t : {1e-5, 3e-7}) EXPECT_LT(miss("robot: {com: [0, 0]}\nfloor: {friction: 0}\n", t), 1) << t;
  EXPECT_LT(miss("model: no_slip\n"
                 "robot: {com: [0, 0], wheel_inertia: 1.0e-12, wheel_damping: 0, roller_damping: 0}\n",
                 1e-5),
            1);
}

// A wheel that chatters for 5 ms, as its momentum counts for the light base, and comes to rest between two of three
// rollers. The end is rosenbrock4's at a tolerance of 1e-10 where no wheel has to rest, after 287,420 switches; that of
// 1e-9 is 9e-9 m off. Radau's ends at 1e-9 to 1e-11 agree to 3e-9 m, 4e-8 m from it.
class LongChatterTest : public SimulationTest {
 protected:
  double distance_from_reference(double tolerance, bool keeps_up) {
    Scene scene = scene_of_data("long_chatter");
    scene.solver.keeps_up = keeps_up;
    const auto simulation = run(scene, tolerance);
    const IntegrationStatistics& statistics = simulation->statistics();
    EXPECT_EQ(statistics.fallback_steps, 0u) << tolerance;
    EXPECT_EQ(statistics.exhausted > 0, keeps_up || tolerance < 1e-9) << tolerance;
    forced_hold_speed = statistics.forced_hold_speed;
    return distance(simulation->state(), {-0.054520667591, 0.078460186021, 2.304670848666});
  }

  double forced_hold_speed = 0;  // m/s, of the last motion
};

TEST_F(LongChatterTest, TighterIsNoWorse) {
  constexpr double kPath = 1.5, kReference = 5e-8;  // m
  for (const double tolerance : {1e-3, 1e-5, 3e-7, 1e-8, 1e-10}) {
    EXPECT_LT(distance_from_reference(tolerance, false), kPath * tolerance + kReference) << tolerance;
    EXPECT_LT(forced_hold_speed, 20 * kPath * tolerance) << "called unreliable at " << tolerance;
  }
}

// The wheel then comes to rest early, with a momentum that counts: it may move the base as `reliable` expects it to.
// At 1e-10 the last bits of the tolerance decide whether fallback steps follow.
TEST_F(LongChatterTest, EndsEarlyWhereWorkIsBoundedToRealTime) {
  for (const double tolerance : {1e-8, 1e-9}) {
    const double distance = distance_from_reference(tolerance, true);
    EXPECT_LT(distance, std::min(2e-4, forced_hold_speed * 1.0)) << tolerance;
  }
}

// Dry friction of the drive trains turns where a wheel's rate passes zero, here within 0.1 ms. Another method, which
// errs by 2e-10 m, agrees to the tolerance.
TEST_F(SimulationTest, WheelsWithDryFrictionPassZeroUnderLargeTorques) {
  const auto end = [&](const char* method, double tolerance) {
    const auto simulation = run(scene_of_data("dry_friction_passes_zero", {{"solver.method", method}}), tolerance);
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u) << method;
    return simulation->state();
  };
  constexpr double kPath = 2.1;  // m
  EXPECT_LT(distance(end("radau", 3e-7), end("rosenbrock4", 1e-7)), 3e-7 * kPath);
}

// A wheel that grips breaks away where the torque of a control period is too much for it. Newton's corrections first
// shrink a thousand times, as if it still gripped. The velocities are rosenbrock4's at a tolerance of 1e-6.
TEST_F(SimulationTest, FollowsAWheelThatBreaksAwayWhereTheTorqueJumps) {
  const Eigen::Vector3d exact(-0.0197967344, -0.2724022751, 0.6292632949);
  for (const double tolerance : {1e-6, 3e-7, 1e-7}) {
    EXPECT_LT((run(scene_of_data("wheel_breaks_away"), tolerance)->state().velocity() - exact).norm(), 5e-7)
        << tolerance;
  }
}

// Motors wind up and turn the wheels, which grip, by less than a degree: velocities are right at the end of any step,
// and the pose shows what a long one misses (at 1e-9: 2e-7 m). It is rosenbrock4's at a tolerance of 1e-10.
TEST_F(SimulationTest, PosesKeepToTheToleranceWhereContactsHoldTheVelocities) {
  constexpr double kPath = 1e-3;  // m
  for (const double tolerance : {1e-8, 1e-9, 1e-10}) {
    const auto simulation = run(scene_of_data("contacts_hold_the_velocities"), tolerance);
    EXPECT_LT(distance(simulation->state(), {7.313275963095e-4, -9.67744748974e-6, 1.8969712345991e-3}),
              2 * kPath * tolerance)
        << tolerance;
  }
}

// At switches, rollers at this regularization speed follow within hardly more than what t is rounded to.
TEST_F(SimulationTest, TransientsShorterThanTheRoundingOfTimeNeedNoFallback) {
  EXPECT_EQ(run(scene_of_data("transients_below_rounding"), 1e-10)->statistics().fallback_steps, 0u);
}

// A load that is put on at rest changes the velocities at once, and with them the friction at all contacts.
TEST_F(SimulationTest, AccurateStepsFollowALoadPutOnAtRest) {
  const Scene scene = load(
      "model: viscous\nduration: 0.3\ninitial: {twist: [0.3, 0.2, 0.5]}\nfloor: {slip_regularization: 1e-5}\n"
      "drive: {torque: [{start: 0, constant: [1, -0.5, 0.7, 1.2]}]}\n"
      "loads: [{mass: 14, position: [0.1, 0.05, 0], start: 0.1, placed: at_rest}]\n");
  const auto end = [&](double tolerance) {
    const auto simulation = run(scene, tolerance);
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u) << tolerance;
    return simulation->state();
  };
  EXPECT_LT(distance(end(1e-9), end(1e-11)), 1e-11);
}

// Rollers without inertia have no rate of their own: whatever they start or take over with is gone at once. Light ones
// come ever closer.
TEST_F(SimulationTest, RollersWithoutInertiaStartAndTakeOverAtAnyRate) {
  const auto end = [this](const std::string& inertia) {
    Simulation simulation(
        load("duration: 0.5\nrobot: {roller_rate_at_switch: at_rest, rollers_per_wheel: 8, roller_inertia: " + inertia +
             "}\nfloor: {slip_regularization: 2e-5}\n"
             "initial: {wheel_rates: [-6.4, -9.2, 8.4, 7.5], roller_rates: [0, 300, -100, 20]}\n"
             "drive: {torque: [{start: 0, constant: [-1.5, 1, 1.3, -1]}]}\n"));
    simulation.advance_to(0.5);
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u) << inertia;
    EXPECT_GT(simulation.statistics().switches, 5u) << inertia;
    return simulation.state().velocity();
  };
  const Eigen::Vector3d limit = end("0");
  const double light = (end("1e-8") - limit).norm(), lighter = (end("1e-9") - limit).norm();
  EXPECT_GT(light, 1e-6);  // more than errors of integration
  EXPECT_LT(lighter, 0.2 * light);
}

// A wheel whose two rollers turn at rates of their own as it chatters. With inertia, they would come to a common rate
// in the end, which does not hold the wheel: it chatters on, the faster the lighter they are, and ever closer to this
// end.
TEST_F(SimulationTest, WheelRestsOnTwoRollersWithoutInertia) {
  const auto end = [](double inertia, double tolerance) {
    const auto simulation = run(scene_of_data("rests_on_two_rollers", {{"robot.roller_inertia", inertia}}), tolerance);
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u) << inertia;
    EXPECT_EQ(simulation->statistics().shared_contacts, inertia == 0 ? 1u : 0u) << inertia;
    return simulation->state();
  };
  const State limit = end(0, 1e-9);
  EXPECT_LT(distance(end(0, 3e-7), limit), 3e-7 * 2.8);  // times the path, m
  const double light = distance(end(1e-8, 1e-6), limit), lighter = distance(end(1e-9, 1e-6), limit);
  EXPECT_LT(light, 3e-4);
  EXPECT_LT(lighter, 0.7 * light);
}

// While it is held, the wheel stands still on an edge, and both of the edge's rollers are told.
TEST_F(SimulationTest, TellsBothRollersOfAHeldWheel) {
  Simulation simulation(load(kHeldWheel));
  const int n = simulation.scene().robot.rollers;
  int held = 0;
  for (int k = 1; k <= 1000; ++k) {
    simulation.advance_to(0.01 * k);
    for (int i = 0; i < kWheels; ++i) {
      const auto other = simulation.other_rollers()[i];
      if (!other) continue;
      ++held;
      const int roller = simulation.rollers()[i];
      EXPECT_TRUE(*other == (roller + 1) % n || roller == (*other + 1) % n) << roller << " and " << *other;
      const double edges = simulation.state().phi()[i] / (2 * M_PI / n) + 0.5;
      EXPECT_NEAR(edges, std::round(edges), 1e-9);
      EXPECT_NEAR(simulation.state().dphi()[i], 0, 1e-12);
    }
  }
  EXPECT_GT(held, 0);
}

// The powers' trapezoidal sum is the change of energy: through switches, held wheels and averaged contacts, with and
// without dry friction, and in model 1. A switch in a step of the sum is what is left of the difference.
TEST_F(SimulationTest, PowersMakeUpTheChangeOfTheKineticEnergy) {
  const std::string
      held = kHeldWheel,
      fast = "duration: 1\nfloor: {friction: 0.01}\ndrive: {torque: [{start: 0, constant: [80, 80, 80, 80]}]}\n";
  std::uint64_t shared = 0;
  for (const std::string& text : {held, held + "robot: {profile: measured}\n", held + "model: viscous\n",
                                  held + "model: no_slip\nrobot: {profile: measured}\n", fast}) {
    SCOPED_TRACE(text);
    Simulation simulation(load(text));
    const double energy = simulation.kinetic_energy(), step = 1e-4;
    double sum = 0, exchanged = 0, before = simulation.power_balance().net();
    for (int k = 1; step * k <= simulation.scene().duration; ++k) {
      simulation.advance_to(step * k);
      const PowerBalance power = simulation.power_balance();
      EXPECT_GE(std::min({power.bearings, power.rollers, power.floor}), 0);
      sum += step / 2 * (before + power.net());
      exchanged += step * std::abs(power.drive);
      before = power.net();
    }
    EXPECT_EQ(simulation.statistics().averaged_contacts > 0, text == fast);
    shared += simulation.statistics().shared_contacts;
    EXPECT_GT(exchanged, 0.1);
    EXPECT_NEAR(sum, simulation.kinetic_energy() - energy, 1e-4 * exchanged);
  }
  EXPECT_GT(shared, 0u);
}

// The velocity loops' torque jumps each millisecond by about the same: the integration learns what step is good then.
TEST_F(SimulationTest, JumpsOfTheTorqueRejectFewSteps) {
  Scene scene = load("duration: 4\n");
  scene.solver.control_period = 1e-3;
  WheelDrive drive(1e-3);
  const double rates[] = {2.26, 10.37, 2.26, 10.37};  // a curve
  for (int i = 0; i < kWheels; ++i) drive.command(i, {DriveMode::kVelocity, rates[i]});
  Simulation simulation(scene);
  advance_to(simulation, 4, [&](double, const State& state) { return drive.sample(state.dphi()); });
  EXPECT_GT(simulation.statistics().switches, 50u);
  // One for five steps; without learning it is nearly one for two.
  EXPECT_LT(simulation.statistics().rejected_steps, 0.3 * static_cast<double>(simulation.statistics().steps));
}

// Thousands of N m: the wheels spin up to rates at which rollers pass faster than any step; still bounded and finite.
TEST_F(SimulationTest, AbsurdTorqueStaysFinite) {
  Simulation simulation(load("duration: 1\ndrive: {torque: [{start: 0, constant: [1e6, -1e6, 1e6, 1e6]}]}\n"));
  simulation.advance_to(0.01);
  EXPECT_TRUE(simulation.state().values.allFinite());
}

// Wheels spin and are braked again and again; where a wheel's slip passes through zero, its friction turns round within
// 1e-9 s. A step that happens to end right then is judged by the stiffness of that instant, which hides its error:
// single starts are up to 15 tolerances off, their mean is not.
TEST_F(SimulationTest, VelocitiesKeepToTheToleranceWhereFrictionTurnsAtOnce) {
  const auto velocity_at_end = [&](int start, const std::string& tolerance) {
    Simulation simulation(load(
        "duration: 1.5\nfloor: {slip_regularization: 1e-8}\nsolver: {relative_tolerance: " + tolerance +
        "}\ninitial: {wheel_angles: [" + std::to_string(0.05 * start) + ", 0, 0, 0]}\n" +
        "drive: {torque: [{start: 0, constant: [10, -8, 6, -9]}, {start: 0.5, constant: [-10, 9, -7, 8]},\n"
        "  {start: 1, constant: [3, 3, -3, -3], cos: [20, -15, 10, 5], sin: [-5, 10, 15, -20], period: 0.05}]}\n"));
    simulation.advance_to(1.5);
    return simulation.state().velocity();
  };
  constexpr int kStarts = 6;
  for (const std::string tolerance : {"1e-7", "1e-8"}) {
    double mean = 1;  // geometric
    for (int start = 0; start < kStarts; ++start) {
      const double error = (velocity_at_end(start, tolerance) - velocity_at_end(start, "1e-10")).norm();
      mean *= std::pow(error / std::stod(tolerance), 1.0 / kStarts);
    }
    EXPECT_LT(mean, 5) << tolerance;
  }
}

// What a tolerance allows a step to be off must not keep it from being made: less accuracy is less work, also where
// the slip that is allowed is more than what the friction turns about within.
TEST_F(SimulationTest, LooserTolerancesAreNoMoreWork) {
  const auto work = [](double tolerance, double nu) {
    Scene scene =
        load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml", {{"solver.relative_tolerance", tolerance}});
    scene.floor.nu = nu;
    Simulation simulation(scene);
    simulation.advance_to(0.2);
    const IntegrationStatistics& statistics = simulation.statistics();
    EXPECT_EQ(statistics.exhausted, 0u) << "tolerance " << tolerance << ", nu " << nu;
    return statistics.steps + statistics.rejected_steps;
  };
  for (const double nu : {1e-3, 1e-4}) {
    const std::uint64_t accurate = work(1e-9, nu);
    for (const double tolerance : {1e-3, 1e-5, 1e-7}) {
      EXPECT_LE(work(tolerance, nu), accurate) << "tolerance " << tolerance << ", nu " << nu;
    }
  }
}

// Bearings that brake within a nanosecond: model 1 then creeps at the speed at which its torque is used up.
TEST_F(SimulationTest, NoSlipIsNoWorkHoweverHardTheBearingsBrake) {
  for (const char* robot : {"{wheel_damping: 1e9}", "{roller_axis_radius: 0.0499999}", "{dry_friction: 1e3}",
                            "{wheel_damping: 1e5, roller_dry_friction: 1e5, roller_dry_friction_rate: 1e-6}"}) {
    Simulation simulation(load(std::string("model: no_slip\nduration: 10\nrobot: ") + robot +
                               "\ndrive: {torque: [{start: 0, constant: [1, 2, 1, 2]}, {start: 5, sin: [1, 1, 1, 1], "
                               "period: 1}]}\n"));
    EXPECT_EQ(simulation.method(), "rosenbrock4") << robot;
    simulation.advance_to(5);
    const NoSlipModel model(simulation.scene().robot);
    const Eigen::Vector3d left = model.acceleration(simulation.state().velocity(), {1, 2, 1, 2});
    EXPECT_LT(left.norm(), 1e-3) << robot;
    simulation.advance_to(10);
    EXPECT_TRUE(simulation.state().values.allFinite()) << robot;
    EXPECT_LT(simulation.statistics().evaluations, 100000u) << robot;
  }
}

TEST_F(SimulationTest, DoesNotGoBackInTime) {
  Scene scene =
      load("duration: 1\ninitial: {twist: [0.4, 0, 0]}\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}]}\n");
  scene.solver.control_period = 1;
  Simulation once(scene), back(scene);
  once.advance_to(0.5);
  back.advance_to(0.5);
  back.advance_to(0.2);
  EXPECT_EQ(back.time(), 0.5);
  once.advance_to(0.9);
  back.advance_to(0.9);
  EXPECT_TRUE((once.state().values == back.state().values).all());
}

TEST_F(SimulationTest, ResetBeginsTheSameRunAgain) {
  const std::string segments =
      "duration: 1\ndrive: {torque: [{start: 0, constant: [1, 1, 1, 1]}, {start: 0.1, constant: [-1, 1, 1, -1]}, "
      "{start: 0.2, constant: [2, 1, 0, 1]}]}\n";
  Simulation fresh(load(segments)), again(load(segments));
  again.advance_to(0.05);
  again.reset();
  EXPECT_EQ(again.time(), 0);
  EXPECT_EQ(again.statistics().steps, 0u);
  fresh.advance_to(0.6);
  again.advance_to(0.6);
  EXPECT_TRUE((fresh.state().values == again.state().values).all());
  EXPECT_EQ(fresh.statistics().evaluations, again.statistics().evaluations);
  EXPECT_EQ(fresh.take_switches().size(), again.take_switches().size());
}

// Work is bounded without a tighter tolerance making a result worse, and short periods are not charged for their
// shortness.
TEST_F(SimulationTest, ShortPeriodsAreNotEased) {
  Scene scene = load("duration: 0.01\ndrive: {torque: [{start: 0, constant: [1, -0.5, 0.7, 1.2]}]}\n");
  scene.solver.control_period = 1e-6;
  Simulation simulation(scene);
  simulation.advance_to(0.01);
  EXPECT_EQ(simulation.statistics().exhausted, 0u);
  EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
}

// Friction that turns over less slip than the tolerance can see is made to turn over more: this moves the end by no
// more than the tolerance times the way. The reference turns over the scene's own slip speed.
TEST_F(SimulationTest, RegularizationSpeedBelowTheToleranceDoesNotShow) {
  const auto run = [](double nu, double tolerance) {
    Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case1_counter_clockwise.yaml",
                             {{"solver.relative_tolerance", tolerance}});
    scene.floor.nu = nu;
    auto simulation = std::make_unique<Simulation>(scene);
    simulation->advance_to(2);
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u);
    return simulation;
  };
  const auto reference = run(1e-8, 1e-10);
  EXPECT_EQ(reference->regularization_speed(), 1e-8);
  constexpr double kWay = 2 * 0.52 + 1e-3;  // m
  for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6}) {
    const auto simulation = run(1e-8, tolerance);
    EXPECT_GT(simulation->regularization_speed(), 1e-8) << tolerance;
    EXPECT_LE(simulation->regularization_speed(), 1e-5) << tolerance;
    const State &x = simulation->state(), &exact = reference->state();
    EXPECT_LT(std::hypot(x.x() - exact.x(), x.y() - exact.y()), tolerance * kWay) << tolerance;
  }
  EXPECT_EQ(run(1e-3, 1e-3)->regularization_speed(), 1e-3);
}

/// A base whose wheels do not turn, pushed forward by `share` of what friction can hold: rollers that turn freely take
/// a force along their axes only.
class ParkedBase : public SimulationTest {
 protected:
  static constexpr double kWeight = 35.6 * 9.81, kLimit = 0.5 * M_SQRT1_2 * kWeight;  // N

  std::unique_ptr<Simulation> pushed(double share, double end, const std::string& floor,
                                     const std::string& method = "radau") {
    Scene scene = load(
        fmt::format("duration: 100\nrobot: {{com: [0, 0], wheel_damping: 1e9, roller_damping: 1e-6}}\nfloor: {{{}}}\n"
                    "solver: {{method: {}}}\n"
                    "wrenches: [{{force: [{}, 0, 0], point: [0, 0, 0], end: {}}}]\n",
                    floor, method, share * kLimit, end));
    return std::make_unique<Simulation>(scene);
  }
  const std::string holds_ = "holding_speed: 1e-8", creeps_ = "holding_speed: 0";
};

// Friction that turns over 1 mm/s lets it creep by a metre and more in an hour.
TEST_F(ParkedBase, StaysOnASlopeWithTheMeasuredProfile) {
  folder_.write("zero.csv", "t,fl,fr,bl,br\n0,0,0,0,0\n");
  const auto drift = [&](const std::string& floor) {
    Simulation simulation(load("duration: 300\nrobot: {profile: measured}\nfloor: {slope: {angle: 0.1}" + floor +
                               "}\nmotors: {}\ndrive: {velocity_table: zero.csv}\n"));
    simulation.advance_to(180);  // the velocity loops' integrals have taken up the load
    const State before = simulation.state();
    simulation.advance_to(300);
    EXPECT_LT(simulation.energy_balance_error(), 1e-6);
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
    const State& x = simulation.state();
    return 30 * std::hypot(x.x() - before.x(), x.y() - before.y());  // in an hour, m
  };
  EXPECT_LT(drift(""), 1e-3);
  EXPECT_GT(drift(", holding_speed: 0"), 1);
}

// Motors that have stopped a base keep their torque, which the dry friction of the drives holds; records of real bases
// have 0.11 to 0.27 N m.
TEST_F(ParkedBase, StaysWhereItsMotorsStopIt) {
  folder_.write("stop.csv", "t,fl,fr,bl,br\n0,0,0,0,0\n0.1,5,5,5,5\n2,5,5,5,5\n2.1,0,0,0,0\n");
  Simulation simulation(load("duration: 60\nrobot: {profile: measured}\ndrive: {velocity_table: stop.csv}\n"));
  simulation.advance_to(3);
  const double x = simulation.state().x();
  const Wheels torque = simulation.torque();
  EXPECT_GT(torque.abs().minCoeff(), 0.05);
  simulation.advance_to(60);
  EXPECT_NEAR(simulation.state().x(), x, 1e-5);
  EXPECT_LT((simulation.torque() - torque).abs().maxCoeff(), 0.01);
  EXPECT_LT(simulation.energy_balance_error(), 1e-5);
}

TEST_F(ParkedBase, HoldsUpToTheLimitOfFriction) {
  for (const char* method : {"radau", "rosenbrock4"}) {
    for (const double share : {0.5, -0.9, 0.95}) {
      const auto simulation = pushed(share, 100, holds_, method);
      simulation->advance_to(3.6);
      // Slip along the rollers' axes is nu s / sqrt(1 - s^2) at a share s of the limit.
      const double creep = 1e-8 * share / std::sqrt(1 - share * share) * M_SQRT2 * 3.6;
      EXPECT_NEAR(simulation->state().x() / creep, 1, 0.05) << method << ' ' << share;
    }
  }
}

TEST_F(ParkedBase, MovesAtOnceBeyondTheLimitAndStopsAfterThePush) {
  const double a = 0.1 * kLimit / 35.6, deceleration = kLimit / 35.6;  // m/s^2
  for (const char* method : {"radau", "rosenbrock4"}) {
    const auto simulation = pushed(1.1, 0.5, holds_, method);
    simulation->advance_to(0.5);
    EXPECT_NEAR(simulation->state().x(), 0.5 * a * 0.25, 0.02 * 0.5 * a * 0.25) << method;
    simulation->advance_to(1);
    const double stop = 0.5 * a * 0.25 * (1 + a / deceleration);
    EXPECT_NEAR(simulation->state().x(), stop, 0.02 * stop) << method;
    const double x = simulation->state().x();
    simulation->advance_to(20);
    EXPECT_NEAR(simulation->state().x(), x, 1e-7) << method;
    EXPECT_LT(simulation->energy_balance_error(), 1e-6) << method;
    EXPECT_EQ(simulation->statistics().exhausted, 0u) << method;
  }
}

// Pushes that come and go, on both sides of the limit: the base neither creeps nor flutters between rest and motion.
TEST_F(ParkedBase, ChangesBetweenRestAndMotionCostLittle) {
  const auto evaluations = [&](const std::string& floor) {
    Simulation simulation(load("duration: 8\nrobot: {com: [0, 0], wheel_damping: 1e9}\nfloor: {" + floor +
                               "}\nsolver: {control_period: 0.02}\n"));
    for (int k = 0; k < 400; ++k) {
      AppliedLoads applied;
      applied.wrenches.push_back({{kLimit * 1.05 * std::sin(0.1 * k), 0, 0}, {0, 0, 0}, 0, false});
      simulation.set_loads(applied);
      simulation.step();
    }
    EXPECT_EQ(simulation.statistics().exhausted, 0u);
    return simulation.statistics().evaluations;
  };
  EXPECT_LT(evaluations(holds_), 2 * evaluations(creeps_));
}

// A base that turns back, at its slowest about as fast as one that rests, rests in a run with long steps if it does in
// one with short steps.
TEST_F(ParkedBase, RestsForAMomentWithinAStep) {
  const auto end = [&](double V_Y, double tolerance) {
    Simulation simulation(load(fmt::format(
        "duration: 1\nfloor: {{{}}}\nsolver: {{relative_tolerance: {}}}\ninitial: {{twist: [0.05, {}, 0]}}\n"
        "wrenches: [{{force: [-20, 0, 0], point: [0, 0, 0]}}]\n",
        holds_, tolerance, V_Y)));
    simulation.advance_to(0.3);
    return State(simulation.state());
  };
  constexpr double kPath = 0.025, kTolerance = 3e-7;  // m
  for (double V_Y = 4e-3; V_Y < 8e-3; V_Y += 5e-5) {
    const State a = end(V_Y, kTolerance), b = end(V_Y, 1e-9);
    EXPECT_LT(std::hypot(a.x() - b.x(), a.y() - b.y()), 20 * kTolerance * kPath) << V_Y;
  }
}

// A wheel that stands on the edge between two rollers, and one just before it, as the base rolls to rest.
TEST_F(ParkedBase, HoldsOnTheEdgeBetweenTwoRollers) {
  folder_.write("zero.csv", "t,fl,fr,bl,br\n0,0,0,0,0\n");
  for (const double off : {-1e-3, -1e-9, 0.0, 1e-9}) {
    const double edge = M_PI / 6 + off;
    Simulation simulation(
        load(fmt::format("duration: 100\nrobot: {{profile: measured}}\nfloor: {{slope: {{angle: "
                         "0.1}}}}\ninitial: {{wheel_angles: [{}, {}, {}, {}]}}\nmotors: {{}}\n"
                         "drive: {{velocity_table: zero.csv}}\n",
                         edge, -edge, edge, 0.1)));
    simulation.advance_to(90);
    const double x = simulation.state().x();
    simulation.advance_to(100);
    EXPECT_NEAR(simulation.state().x(), x, 1e-5) << off;
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u) << off;
    EXPECT_LT(simulation.energy_balance_error(), 1e-6) << off;
  }
}

// Where it is off, and in a model without limit of friction, nothing changes; nor does it for explicit methods.
TEST_F(ParkedBase, IsHeldByCoulombFrictionOnly) {
  const auto end = [&](const std::string& model, const std::string& method, const std::string& floor) {
    Simulation simulation(load("duration: 1\nmodel: " + model + "\nfloor: {" + floor + "}\nsolver: {method: " + method +
                               "}\ndrive: {torque: [{start: 0.0005, constant: [1, 1, 1, 1]}]}\n"));
    simulation.advance_to(0.001);
    return simulation.state().values;
  };
  EXPECT_TRUE((end("viscous", "radau", holds_) == end("viscous", "radau", creeps_)).all());
  EXPECT_TRUE((end("coulomb", "dopri5", holds_) == end("coulomb", "dopri5", creeps_)).all());
  EXPECT_FALSE((end("coulomb", "radau", holds_) == end("coulomb", "radau", creeps_)).all());
  EXPECT_TRUE((end("coulomb", "radau", "holding_speed: 1e-3") == end("coulomb", "radau", creeps_)).all());
}

// A contact that turns on the spot creeps by the regularization speed over the spin radius, 500 rad for each metre.
TEST_F(SimulationTest, SpinFrictionKeepsToTheTolerance) {
  const auto end = [&](double tolerance) {
    Simulation simulation(
        load(fmt::format("duration: 1\nfloor: {{slip_regularization: 1.0e-10, spin_radius: 0.002}}\n"
                         "solver: {{relative_tolerance: {}}}\n"
                         "drive: {{torque: [{{start: 0, constant: [-0.04, 0.15, 0.17, 0.06]}}]}}\n",
                         tolerance)));
    simulation.advance_to(1);
    const State& x = simulation.state();
    return Eigen::Vector3d(x.x(), x.y(), 0.28 * x.psi());
  };
  constexpr double kTolerance = 3e-7, kPath = 0.035;  // m
  EXPECT_LT((end(kTolerance) - end(1e-10)).norm(), 20 * kTolerance * kPath);
}

TEST_F(SimulationTest, VelocityTableIsTracked) {
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,5,5,5,5\n2,-5,5,5,-5\n");
  Simulation simulation(load("duration: 4\ndrive: {velocity_table: table.csv}\n"));
  simulation.advance_to(2);
  // The loop's slow pole, at about 3 rad/s, has settled; what remains is the ripple of the rollers.
  EXPECT_NEAR(simulation.state().dphi().mean(), 5, 0.1);
  EXPECT_GT(simulation.state().V_X(), 0.24);
  simulation.advance_to(4);
  EXPECT_GT(simulation.state().V_Y(), 0.15);
}

// By statics. A rocking axle passes on no moment about OX but that of the friction under its own wheels, R F_Y. The
// other axle, which bears half of the weight and half of the push W at the height z over the axles, carries the rest:
// W z + R W / 2 = l m_s g / 2 where one of its wheels lifts. A stiff frame tips at W (z + R) = l m_s g.
TEST_F(ParkedBase, TipsOnThreePointsBesideARockingAxle) {
  const double R = 0.05, l = 0.15, z = 0.2;  // m
  const double three_points = 0.5 * l * kWeight / (z + 0.5 * R), four_points = l * kWeight / (z + R);
  const auto run = [&](const std::string& sharing, double W) {
    auto simulation = std::make_unique<Simulation>(load(fmt::format(
        "duration: 1\nrobot: {{com: [0, 0], wheel_damping: 1e9, normal_reactions: dynamic, load_sharing: {}}}\n"
        "floor: {{friction: 1, slip_regularization: 1e-5}}\nwrenches: [{{force: [0, {}, 0], point: [0, 0, {}]}}]\n",
        sharing, W, z)));
    return simulation;
  };
  for (const std::string sharing : {"rocking_front", "rocking_rear", "equal_wheels"}) {
    const double limit = sharing == "equal_wheels" ? four_points : three_points;
    for (const int sign : {+1, -1}) {
      EXPECT_NO_THROW(run(sharing, 0.99 * sign * limit)->advance_to(0.2)) << sharing;
      try {
        run(sharing, 1.01 * sign * limit)->advance_to(0.2);
        ADD_FAILURE() << sharing << ' ' << sign;
      } catch (const TippedOver& tipped) {
        EXPECT_EQ(tipped.side(), sign > 0 ? Side::kLeft : Side::kRight) << sharing;
      }
    }
  }
  // Beyond the limit three wheels carry all: the rocking axle's two, and the last one of the other.
  const auto simulation = run("rocking_front", 1.01 * three_points);
  simulation->continue_when_tipping();
  simulation->advance_to(0.2);
  const ContactDetails contacts = simulation->contacts();
  EXPECT_NEAR(contacts.N[0] + contacts.N[1], kWeight / 2, 1e-6);
  EXPECT_NEAR((contacts.N[0] - contacts.N[1]) * l + R * (contacts.F_Y[0] + contacts.F_Y[1]), 0, 1e-6);
  EXPECT_NEAR(contacts.N[2], kWeight / 2, 1e-6);
  EXPECT_EQ(contacts.N[3], 0);
}

class MotorsTest : public SimulationTest {
 protected:
  void SetUp() override {
    folder_.write("rates.csv", "t,fl,fr,bl,br\n0,5,5,5,5\n0.3,2.001,5,5,2.001\n");
    folder_.write("torques.csv", "t,fl,fr,bl,br\n0,4,4,4,4\n0.3,1.0001,1,1,1.0001\n");
  }

  std::unique_ptr<Simulation> run(const std::string& motors, const std::string& drive, double t = 0.5) {
    auto simulation = std::make_unique<Simulation>(load("duration: 0.5\ndrive: {" + drive + "}\n" + motors));
    simulation->advance_to(t);
    return simulation;
  }
  /// Torque of the first wheel at time t, N m.
  double torque(const std::string& motors, const std::string& drive, double t) {
    return run(motors, drive, t)->torque()[0];
  }
  void expect_same(const std::string& motors, const std::string& drive, const std::string& drive_of_default_motors) {
    EXPECT_TRUE((run(motors, drive)->state().values == run("", drive_of_default_motors)->state().values).all())
        << motors << " " << drive << " and " << drive_of_default_motors;
  }
  void expect_different(const std::string& motors, const std::string& drive) {
    EXPECT_FALSE((run(motors, drive)->state().values == run("", drive)->state().values).all()) << motors;
  }

  const std::string rates_ = "velocity_table: rates.csv", torques_ = "torque_table: torques.csv";
};

TEST_F(MotorsTest, OfAVelocityTableHaveDefaults) {
  expect_same("motors: {}", rates_, rates_);
  expect_same(
      "motors: {velocity_proportional_gain: 0.4, velocity_integral_gain: 1.2, command_delay: 0, quantized: false}",
      rates_, rates_);
  expect_different("motors: {velocity_proportional_gain: 0.3}", rates_);
  expect_different("motors: {velocity_integral_gain: 0.5}", rates_);
}

TEST_F(MotorsTest, LimitTorquesAndRates) {
  EXPECT_EQ(torque("", torques_, 0.1), 4) << "without motors there is no limit";
  EXPECT_EQ(torque("motors: {}", torques_, 0.1), Motor().max_torque());
  EXPECT_NEAR(torque("motors: {max_wheel_torque: 2.5}", torques_, 0.1), 2.5, 1e-12);
  EXPECT_NEAR(torque("motors: {max_wheel_torque: 0.7}", rates_, 0.01), 0.7, 1e-12);
  EXPECT_NEAR(run("motors: {max_wheel_rate: 0}", rates_)->state().dphi()[0], 0, 1e-12);
  EXPECT_LT(run("motors: {max_wheel_rate: 1}", rates_)->state().dphi()[0], 1.5);
}

TEST_F(MotorsTest, DelayCommands) {
  folder_.write("later.csv", "t,fl,fr,bl,br\n0.05,5,5,5,5\n0.35,2.001,5,5,2.001\n");
  expect_same("motors: {command_delay: 0.05}", rates_, "velocity_table: later.csv");
  EXPECT_EQ(torque("motors: {command_delay: 0.05}", torques_, 0.05), 0);
  EXPECT_EQ(torque("motors: {command_delay: 0.05, max_wheel_torque: 5}", torques_, 0.051), 4);
}

// A free wheel swings up from the period on that a scene is refused for, and settles below it.
TEST_F(MotorsTest, HaveVelocityLoopsThatAreStable) {
  const std::string drive = "duration: 20\ndrive: {velocity_table: rates.csv}\n",
                    free = "robot: {wheel_damping: 0}\nfloor: {friction: 0}\n";
  const auto error = [&](const std::string& motors, double period) {
    Scene scene = load(drive + free + motors);
    scene.solver.control_period = period;
    Simulation simulation(scene);
    simulation.advance_to(300 * period);
    return std::abs(simulation.state().dphi()[1] - 5);
  };
  for (const VelocityGains& gains : {VelocityGains(), VelocityGains{0.1, 4}, VelocityGains{2, 0}}) {
    const std::string motors = fmt::format("motors: {{velocity_proportional_gain: {}, velocity_integral_gain: {}}}\n",
                                           gains.proportional, gains.integral);
    const double unstable = gains.unstable_period(RobotParameters().J_1);
    EXPECT_LT(error(motors, 0.97 * unstable), 0.1) << motors;
    EXPECT_GT(error(motors, 1.03 * unstable), 1) << motors;
    EXPECT_NO_THROW(load(drive + motors + fmt::format("solver: {{control_period: {}}}", 0.97 * unstable)));
    EXPECT_THROW(load(drive + motors + fmt::format("solver: {{control_period: {}}}", 1.03 * unstable)), SceneError);
  }
  // The allowed period stands in the message, whether the period or the gains are to blame.
  for (const auto& [text, period] :
       {std::pair{"solver: {control_period: 0.2}", "= 0.2: must be less than 0.02816 s"},
        {"motors: {velocity_proportional_gain: 20}", "= 0.001: must be less than 0.000587"}}) {
    try {
      load(drive + text);
      ADD_FAILURE() << text;
    } catch (const SceneError& e) {
      EXPECT_NE(std::string(e.what()).find(std::string("solver.control_period ") + period), std::string::npos)
          << e.what();
    }
  }
}

TEST_F(MotorsTest, SendWholeMilliamperesAndRpm) {
  const Motor motor;
  EXPECT_EQ(torque("motors: {quantized: true}", torques_, 0.5), motor.transmitted({DriveMode::kTorque, 1.0001}).value);
  const auto whole = [&](double rate) { return std::round(rate / motor.rpm()) * motor.rpm(); };
  std::ostringstream table;
  table.precision(17);
  const double fast = whole(5), slow = whole(2.001);
  table << "t,fl,fr,bl,br\n0," << fast << ',' << fast << ',' << fast << ',' << fast << "\n0.3," << slow << ',' << fast
        << ',' << fast << ',' << slow << '\n';
  folder_.write("whole.csv", table.str());
  expect_same("motors: {quantized: true}", rates_, "velocity_table: whole.csv");
  expect_different("motors: {quantized: true}", rates_);
}

// Commands.

class CommandsTest : public SimulationTest {
 protected:
  /// The motion over a second under a torque that the scene has, and under the same one that is commanded.
  void expect_same_motion(const std::string& scene, const std::string& other_drive, double tolerance) {
    SCOPED_TRACE(scene + other_drive);
    Simulation own(
        load("duration: 2\ndrive: {torque: [{start: 0, constant: [2, -1, 1.5, 1]}, {start: 0.5}]}\n" + scene));
    Simulation commanded(load("duration: 2\n" + other_drive + scene));
    commanded.set_torque({2, -1, 1.5, 1});
    commanded.advance_to(0.5);
    EXPECT_EQ(commanded.torque()[0], 2);
    commanded.set_torque(Wheels::Zero());
    for (Simulation* simulation : {&own, &commanded}) simulation->advance_to(1);
    EXPECT_LE((own.state().values - commanded.state().values).abs().maxCoeff(), tolerance);
    EXPECT_LT(commanded.energy_balance_error(), 1e-5);
    EXPECT_EQ(own.take_switches().size(), commanded.take_switches().size());
  }
};

TEST_F(CommandsTest, TorquesActAsThoseOfAScene) {
  const std::string drive = "drive: {torque: [{start: 0, constant: [9, 9, -9, 9]}]}\n";
  for (const std::string& model : {std::string(), std::string("model: no_slip\n"), std::string("model: viscous\n")}) {
    for (const std::string& other : {std::string(), drive}) {
      expect_same_motion(model + "solver: {control_period: 0.001}\n", other, 0);
      expect_same_motion(model, other, 1e-6);
      expect_same_motion(model + "wrenches: [{force: [5, 0, 0]}]\n", other, 1e-6);
    }
  }
}

TEST_F(CommandsTest, EndWithAReset) {
  Simulation simulation(load(kForward));
  simulation.set_torque(Wheels::Constant(-1));
  simulation.advance_to(1);
  EXPECT_LT(simulation.state().x(), -0.1);
  simulation.reset();
  simulation.advance_to(1);
  EXPECT_GT(simulation.state().x(), 0.1);
}

// As rows of a table, through the same motors; what the scene commands acts until they are due.
TEST_F(CommandsTest, SetPointsActAsThoseOfAScene) {
  folder_.write("rates.csv", "t,fl,fr,bl,br\n0,3,3,3,3\n0.4,5,-5,5,-5\n");
  folder_.write("first.csv", "t,fl,fr,bl,br\n0,3,3,3,3\n");
  const std::string motors = "duration: 2\nmotors: {command_delay: 0.05, max_wheel_torque: 1, quantized: true}\n";
  Simulation table(load(motors + "drive: {velocity_table: rates.csv}\n")),
      commanded(load(motors + "drive: {velocity_table: first.csv}\n"));
  commanded.advance_to(0.4);
  commanded.set_points(DriveMode::kVelocity, {5, -5, 5, -5});
  for (Simulation* simulation : {&table, &commanded}) simulation->advance_to(1);
  EXPECT_TRUE((table.state().values == commanded.state().values).all());
  commanded.set_points(DriveMode::kTorque, Wheels::Constant(7));
  commanded.advance_to(1.06);
  EXPECT_NEAR(commanded.torque()[0], 1, 1e-3) << "the motors' limit, in whole mA";
}

TEST_F(CommandsTest, NeedPeriodsWhereTheyAreSampled) {
  Simulation simulation(load("duration: 1\n"));
  EXPECT_THROW(simulation.step(), std::logic_error);
  EXPECT_THROW(simulation.set_points(DriveMode::kTorque, Wheels::Zero()), std::logic_error);
  EXPECT_EQ(simulation.period_end(), kInfinity);
  EXPECT_FALSE(simulation.period_begins());
}

}  // namespace
}  // namespace youbot_base_sim
