// What is beyond the paper, by what whole motions must do.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "program.h"
#include "temporary_folder.h"
#include "youbot_base_sim/loop/base_sensors.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

Scene scene_of(const std::string& text) {
  static const TemporaryFolder folder;
  return load_scene(folder.write("scene.yaml", text));
}

State end_of(const std::string& text) {
  const Scene scene = scene_of(text);
  Simulation simulation(scene);
  simulation.advance_to(scene.duration);
  EXPECT_EQ(simulation.statistics().fallback_steps, 0u) << text;
  EXPECT_LT(simulation.energy_balance_error(), 1e-4) << text;
  return simulation.state();
}

const std::string kSideways =
    "duration: 1\n"
    "drive: {torque: [{start: 0, constant: [-1.5, 1.6, 1.4, -1.5]}, {start: 0.5, constant: [1, -1, -1, 1]}]}\n";

double distance(const State& a, const State& b) { return std::hypot(a.x() - b.x(), a.y() - b.y(), a.psi() - b.psi()); }

// Friction forces of rollers that turn freely act along their axes alone, so that locked wheels hold uphill up to
// tan(angle) = f cos(delta), 0.354 for 45 degrees, and laterally to f sin(delta).
TEST(SlopeTest, LockedWheelsHoldUpToTheFrictionOfTheirRollers) {
  const auto slide = [](double angle, double nu, double delta, double uphill) {
    const State end =
        end_of(fmt::format("duration: 1\n"
                           "robot: {{com: [0, 0], wheel_damping: 1e6, roller_damping: 1e-6, roller_angle: {}}}\n"
                           "floor: {{slope: {{angle: {}, uphill: {}}}, slip_regularization: {}}}\n",
                           delta, angle, uphill, nu));
    return -end.x() * std::cos(uphill) - end.y() * std::sin(uphill);
  };
  for (const double delta : {30.0, 45.0, -60.0}) {
    for (const double uphill : {0.0, M_PI / 2}) {
      const double along = std::abs(std::cos(delta * M_PI / 180 - uphill)), limit = std::atan(0.5 * along);
      const double over = limit + 0.06, under = limit - 0.01;  // beyond and within what friction holds
      EXPECT_NEAR(slide(over, 1e-3, delta, uphill), 9.81 / 2 * (std::sin(over) - 0.5 * along * std::cos(over)), 0.004);
      const double creep = slide(under, 1e-3, delta, uphill);
      EXPECT_LT(creep, 0.02) << delta;
      EXPECT_NEAR(slide(under, 1e-4, delta, uphill), 0.1 * creep, 0.01 * creep) << delta;
    }
  }
}

TEST(SlopeTest, FreeWheelsRollDownAsModel1Does) {
  const std::string text =
      "duration: 1\n"
      "robot: {com: [0, 0], wheel_damping: 0, roller_damping: 0}\n"
      "floor: {slope: {angle: 0.1, uphill: 0}}\n";
  const Scene scene = scene_of("model: no_slip\n" + text);
  const RobotParameters& robot = scene.robot;
  const double inertia = robot.m_s() + kWheels * robot.J_1 / (robot.R * robot.R);
  EXPECT_NEAR(end_of("model: no_slip\n" + text).V_X(), -robot.m_s() * scene.floor.g * std::sin(0.1) / inertia, 1e-6);
  EXPECT_NEAR(end_of("model: viscous\n" + text).V_X(), end_of("model: no_slip\n" + text).V_X(), 1e-3);
}

// Without friction in bearings the base moves as the rollers' envelope says: R / tan(angle) times the integral of
// cos(phi~), which is sin(pi/n) / (pi/n) on average.
TEST(RollerAngleTest, RollersThatRollFreelyMoveTheBaseByTheirAngle) {
  for (const double angle : {30.0, 60.0, -45.0}) {
    const State end = end_of(
        fmt::format("duration: 2\nrobot: {{roller_angle: {}, com: [0, 0], wheel_damping: 0, roller_damping: 0}}\n"
                    "initial: {{twist: [0, 0.3, 0]}}\n",
                    angle));
    const double turned = std::abs(end.phi()[1]), pitch = M_PI / 3, rollers = std::round(turned / pitch);
    const double envelope = rollers * 2 * std::sin(pitch / 2) + std::sin(turned - rollers * pitch);
    EXPECT_GT(rollers, 5);
    EXPECT_NEAR(end.y(), 0.05 / std::tan(std::abs(angle) * M_PI / 180) * envelope, 1e-5) << angle;
    EXPECT_EQ(end.phi()[1] > 0, angle > 0);
  }
}

// Model 1 by hand: four torques M exert 4 M tan(angle) / R laterally, or 4 M (l + h tan(angle)) / R about O.
TEST(RollerAngleTest, Model1AcceleratesByTheLeverOfTheRollers) {
  for (const double angle : {30.0, 60.0, -30.0}) {
    const double tau = std::tan(angle * M_PI / 180), m_s = 35.6, R = 0.05, J = 5.87e-3, lever = 0.15 + 0.235 * tau;
    const std::string text = fmt::format(
        "model: no_slip\nduration: 1\nrobot: {{roller_angle: {}, com: [0, 0], wheel_damping: 0, roller_damping: 0}}\n",
        angle);
    EXPECT_NEAR(end_of(text + "drive: {torque: [{start: 0, constant: [-1, 1, 1, -1]}]}").V_Y(),
                4 * tau / R / (m_s + 4 * J * tau * tau / (R * R)), 1e-6);
    EXPECT_NEAR(end_of(text + "drive: {torque: [{start: 0, constant: [-1, 1, -1, 1]}]}").Omega(),
                4 * lever / R / (4.42 + 4 * J * lever * lever / (R * R)), 1e-6);
  }
}

// The bases of config/robots move as kinematics says of how far their wheels turned, but for slip: forward exactly,
// laterally by sin(pi/n) / (pi/n) less what friction of rollers takes, in yaw a little less.
TEST(RobotsTest, DriveAsTheirKinematicsSaysWithinSlip) {
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(YOUBOT_BASE_SIM_SOURCE_DIR "/config/robots")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path());
    ++count;
    const Scene scene = load_scene(file.path());
    const DriverKinematics kinematics = BaseSensors::of(scene).odometry().kinematics();
    const double pitch = M_PI / scene.robot.rollers, envelope = std::sin(pitch) / pitch;
    const Eigen::Array3d least{0.999, 0.99 * envelope, 0.96}, most{1.001, envelope, 1};
    Simulation simulation(scene);
    for (int k = 0; k < 3; ++k) {  // forward, to the left, turn to the left
      const State before = simulation.state();
      simulation.advance_to(3 * (k + 1));
      const State& x = simulation.state();
      const Eigen::Vector3d way = (x.values - before.values).col(0).head<3>();
      const double rolled = kinematics.velocity(x.phi() - before.phi())[k],
                   share = turned(way, -before.psi())[k] / rolled;
      EXPECT_GT(rolled, 0.2);
      EXPECT_TRUE(share > least[k] && share < most[k]) << k << ": " << share;
    }
  }
  EXPECT_EQ(count, 8);
}

TEST(BeyondScenesTest, LimitsAreWhatIsWithoutThem) {
  const State paper = end_of(kSideways);
  for (const char* nothing : {"floor: {spin_radius: 1e-9}", "loads: [{mass: 1e-9, position: [0.1, 0.1, 0.1]}]",
                              "floor: {patches: [{rectangle: [50, 50, 51, 51], friction: 0}]}",
                              "floor: {slope: {angle: 1e-9}}", "wrenches: [{force: [1e-7, 0, 0]}]"}) {
    EXPECT_LT(distance(end_of(kSideways + nothing), paper), 1e-6) << nothing;
  }
  // Of patches on each other the last one counts.
  EXPECT_LT(distance(end_of(kSideways + "floor: {patches: [{rectangle: [-50, -50, 50, 50], friction: 0.1}, "
                                        "{rectangle: [-50, -50, 50, 50], friction: 0.3}]}"),
                     end_of(kSideways + "floor: {friction: 0.3}")),
            1e-6);
  EXPECT_LT(distance(end_of(kSideways + "floor: {patches: [{rectangle: [-50, -50, 50, 50], friction: 0.3}]}"),
                     end_of(kSideways + "floor: {friction: 0.3}")),
            1e-6);
  EXPECT_LT(distance(end_of(kSideways + "floor: {friction: [0.3, 0.3, 0.3, 0.3]}"),
                     end_of(kSideways + "floor: {friction: 0.3}")),
            1e-12);
}

TEST(BeyondScenesTest, ATurnedWorldTurnsTheMotion) {
  const std::string robot = kSideways + "robot: {normal_reactions: dynamic, com_height: 0.05}\n";
  const State straight = end_of(
      robot +
      "floor: {slope: {angle: 0.05, uphill: 0.3}, patches: [{rectangle: [0, 0, 0.3, 0.1], friction: 0.2, edge: "
      "0.03}]}\n"
      "wrenches: [{force: [5, 3, 2], point: [0.1, 0, 0.2], frame: fixed}, {force: [0, 4, 0], start: 0.2, end: 0.6}]\n");
  const State turned = end_of(
      robot +
      "initial: {pose: [0, 0, 1.5707963267948966]}\n"
      "floor: {slope: {angle: 0.05, uphill: 1.8707963267948966}, patches: [{rectangle: [-0.1, 0, 0, 0.3], friction: "
      "0.2, edge: 0.03}]}\n"
      "wrenches: [{force: [-3, 5, 2], point: [0.1, 0, 0.2], frame: fixed}, {force: [0, 4, 0], start: 0.2, end: "
      "0.6}]\n");
  EXPECT_LT(std::hypot(turned.x() + straight.y(), turned.y() - straight.x()), 1e-6);
  EXPECT_NEAR(turned.psi(), straight.psi() + M_PI / 2, 1e-6);
}

TEST(BeyondScenesTest, AMirroredWorldMirrorsTheMotion) {
  const auto end = [](int s, const char* angles, const char* friction, const char* patch, const char* torque) {
    return end_of(
        fmt::format("duration: 1\n"
                    "robot: {{normal_reactions: dynamic, com_height: 0.05, com: [0.02, {}], diagonal_preload: {}}}\n"
                    "initial: {{wheel_angles: {}}}\n"
                    "floor: {{friction: {}, slope: {{angle: 0.05, uphill: {}}}, spin_radius: 0.001,\n"
                    "        patches: [{{rectangle: {}, friction: 0.2, edge: 0.03}}]}}\n"
                    "loads: [{{mass: 5, position: [0.1, {}, 0.2], inertia: 0.1}}]\n"
                    "wrenches: [{{force: [5, {}, 2], point: [0.1, {}, 0.2], torque: {}}}]\n"
                    "drive: {{torque: [{{start: 0, constant: {}}}]}}\n",
                    s * 0.03, s * 3, angles, friction, s * 0.3, patch, s * 0.1, s * 3, s * 0.05, s * 0.5, torque));
  };
  const State left =
      end(1, "[0.1, -0.2, 0.15, 0.3]", "[0.5, 0.4, 0.45, 0.6]", "[0, 0, 0.3, 0.1]", "[-1.5, 1.6, 1.4, -1.5]");
  const State right =
      end(-1, "[-0.2, 0.1, 0.3, 0.15]", "[0.4, 0.5, 0.6, 0.45]", "[0, -0.1, 0.3, 0]", "[1.6, -1.5, -1.5, 1.4]");
  EXPECT_LT(std::hypot(right.x() - left.x(), right.y() + left.y(), right.psi() + left.psi()), 1e-6);
}

// On a floor without friction a push gives its momentum, whatever part of a control period it takes.
TEST(WrenchTest, ActsFromItsStartToItsEnd) {
  for (const char* period : {"0", "1e-3", "0.1"}) {
    const State x =
        end_of(fmt::format("duration: 0.2\nrobot: {{com: [0, 0]}}\nfloor: {{friction: 0}}\n"
                           "wrenches: [{{force: [0, 7, 0], start: 0.03037, end: 0.0942}}]\n"
                           "drive: {{torque: [{{start: 0}}]}}\nsolver: {{control_period: {}}}\n",
                           period));
    EXPECT_NEAR(x.V_Y(), 7 * (0.0942 - 0.03037) / RobotParameters().m_s(), 1e-12) << period;
    EXPECT_EQ(x.V_X(), 0);
  }
}

TEST(LoadTest, PutOnAtRestTakesItsShareOfTheMomentum) {
  const std::string text =
      "duration: 0.2\nrobot: {com: [0, 0]}\nfloor: {friction: 0}\ninitial: {twist: [0, 0.5, 0]}\n"
      "loads: [{mass: 10, position: [0, 0, 0.1], start: 0.1, end: 0.15, placed: ";
  const double m_s = RobotParameters().m_s();
  EXPECT_NEAR(end_of(text + "at_rest}]").V_Y(), 0.5 * m_s / (m_s + 10), 1e-12);
  EXPECT_NEAR(end_of(text + "moving}]").V_Y(), 0.5, 1e-12);
}

// With the centre of mass in the middle and rollers straight down, a front wheel's reaction is less by
// (4 tau + m a_Z dV_X) / (4 h).
TEST(NormalReactionsTest, SpeedingUpLoadsTheRearWheels) {
  const Scene scene = scene_of(
      "duration: 1\nrobot: {normal_reactions: dynamic, com_height: 0.1, com: [0, 0], wheel_damping: 0}\n"
      "initial: {twist: [0.5, 0, 0], wheel_rates: [10.5, 10.5, 10.5, 10.5]}\n"
      "drive: {torque: [{start: 0, constant: [2, 2, 2, 2]}]}\n");
  const Simulation simulation(scene);
  const ContactDetails c = simulation.contacts();
  const RobotParameters& robot = scene.robot;
  const double weight = robot.m_s() * scene.floor.g, dV_X = c.F_X.sum() / robot.m_s();
  EXPECT_GT(dV_X, 1);
  const double less = (4 * 2 + robot.m * 0.1 * dV_X) / (4 * robot.h);
  EXPECT_NEAR(c.N[0], weight / 4 - less, 1e-9);
  EXPECT_NEAR(c.N[2], weight / 4 + less, 1e-9);
}

// A base that brakes askew with a tall centre of mass lifts a wheel and puts it down again. Reactions have a kink there
// and no jump: from one look to the next, with the kink between, they change at a mean of the rates before and after.
TEST(NormalReactionsTest, AWheelLeavesTheFloorAndComesBack) {
  const Scene scene = scene_of(
      "duration: 1\nrobot: {normal_reactions: dynamic, com_height: 0.3, com: [0, 0]}\nfloor: {friction: 0.7}\n"
      "initial: {twist: [0.8, 0.5, 0]}\n"
      "drive: {torque: [{start: 0, constant: [-6, -3, -3, -6]}, {start: 0.12, constant: [0, 0, 0, 0]}]}\n");
  Simulation simulation(scene);
  std::vector<Wheels> N = {simulation.contacts().N};
  std::vector<bool> jumps = {false};  // where contact points jump, or the torque
  for (int k = 1; k <= 50000; ++k) {
    simulation.advance_to(1e-5 * k);
    N.push_back(simulation.contacts().N);
    jumps.push_back(!simulation.take_switches().empty() || std::abs(1e-5 * k - 0.12) < 2e-5);
  }
  int kinks = 0;
  for (std::size_t k = 2; k + 1 < N.size(); ++k) {
    if (((N[k] == 0) == (N[k - 1] == 0)).all() || jumps[k - 1] || jumps[k] || jumps[k + 1]) continue;
    ++kinks;
    const auto change = [&](std::size_t i) { return (N[i] - N[i - 1]).abs().maxCoeff(); };
    EXPECT_LT(change(k), 1.1 * std::max(change(k - 1), change(k + 1))) << k;
  }
  EXPECT_GE(kinks, 2);
  EXPECT_GT(N.back().minCoeff(), 0);
  const ReactionRecord record = *simulation.reaction_record();
  EXPECT_EQ(record.min_N.minCoeff(), 0);
  EXPECT_GT(record.time_off_floor.maxCoeff(), 1e-3);
  EXPECT_LT(simulation.energy_balance_error(), 1e-4);
}

// Newton's matrix has how reactions follow friction: it takes hardly more iterations than with reactions that stay, of
// which some are accepted by how fast they converge, nor more rejected steps, however four wheels share the load.
TEST(NormalReactionsTest, CostNoIterations) {
  const auto cost = [](const std::string& robot) {
    Simulation simulation(
        scene_of("duration: 3\ninitial: {wheel_angles: [0.1, 0.1, 0.1, 0.1]}\n"
                 "drive: {reference_motion: {period: 30, V_Y: {constant: 0.52359878}, Omega: "
                 "{constant: 0.20943951}}}\nrobot: {" +
                 robot + "}\n"));
    simulation.advance_to(3);
    const IntegrationStatistics count = simulation.statistics();
    const auto tried = static_cast<double>(count.steps + count.rejected_steps + count.location_steps);
    return std::pair(static_cast<double>(count.newton_iterations) / tried,
                     static_cast<double>(count.rejected_steps) / tried);
  };
  const auto paper = cost("");
  for (const std::string sharing : {"equal_wheels", "rocking_front", "rocking_rear"}) {
    for (const double height : {0.0, 0.034, 0.1}) {
      const auto [iterations, rejected] =
          cost(fmt::format("normal_reactions: dynamic, load_sharing: {}, com_height: {}", sharing, height));
      EXPECT_LT(iterations, 1.2 * paper.first) << sharing << ' ' << height;
      EXPECT_LT(rejected, 1.5 * paper.second) << sharing << ' ' << height;
    }
  }
}

// What the scenes under config/scenes are there to show.
Scene example(const std::string& name) {
  return load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/" + name + ".yaml");
}

State end_of(const Scene& scene) {
  Simulation simulation(scene);
  simulation.advance_to(scene.duration);
  EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
  return simulation.state();
}

TEST(ExampleTest, OnTheRampTheBaseClimbsAndRollsBack) {
  const Scene scene = example("ramp");
  Simulation simulation(scene);
  simulation.advance_to(1.5);
  EXPECT_GT(simulation.state().x(), 0.5);
  const Wheels N = simulation.contacts().N;
  EXPECT_GT(N[2] + N[3], N[0] + N[1] - 30 * 9.81 * 0.016 / 0.235 + 5);  // more than by the centre of mass alone
  simulation.advance_to(4);
  EXPECT_LT(simulation.state().V_X(), -0.2);
}

TEST(ExampleTest, TheWetPatchTurnsTheBase) {
  Scene scene = example("wet_patch");
  const double wet = end_of(scene).psi();
  scene.floor.patches.clear();
  EXPECT_LT(std::abs(end_of(scene).psi()), 0.05);
  EXPECT_LT(wet, -0.5);
}

TEST(ExampleTest, ThePayloadSlowsAndTurnsTheBase) {
  Scene scene = example("payload");
  const State loaded = end_of(scene);
  scene.load_schedule.loads.clear();
  const State free = end_of(scene);
  EXPECT_LT(loaded.y(), free.y() - 0.02);
  EXPECT_LT(loaded.psi(), free.psi() - 0.03);
}

TEST(ExampleTest, ThePushRollsTheBaseAsideAndTurnsIt) {
  const State pushed = end_of(example("push"));
  EXPECT_GT(pushed.y(), 0.03);
  EXPECT_GT(pushed.psi(), 0.1);
  EXPECT_LT(pushed.velocity().norm(), 1e-6);  // dry friction has stopped it
}

/// To which side the base tips over, and when, s.
std::pair<Side, double> tipping_of(const Scene& scene) {
  Simulation simulation(scene);
  try {
    simulation.advance_to(scene.duration);
  } catch (const TippedOver& error) {
    return {error.side(), error.time()};
  }
  return {Side::kNone, scene.duration};
}

TEST(ExampleTest, BrakingTipsTheBaseOverItsLeftWheels) {
  const auto [side, time] = tipping_of(example("braking"));
  EXPECT_EQ(side, Side::kLeft);
  EXPECT_NEAR(time, 0.55, 0.05);
}

// What the program says of it, and what it leaves.
TEST(ExampleTest, SimulateEndsAtTheTippingLimitWithExitStatus1) {
  const TemporaryFolder folder;
  Program simulate(
      SIMULATE, {YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/braking.yaml", "--summary", folder.path("summary.json")});
  EXPECT_EQ(simulate.wait(), 1);
  EXPECT_NE(simulate.err().find("tips over at t = 0.50"), std::string::npos) << simulate.err();
  EXPECT_NE(simulate.err().find("left side"), std::string::npos) << simulate.err();
  EXPECT_EQ(simulate.err().find('\n'), simulate.err().size() - 1) << simulate.err();
  EXPECT_NE(folder.read("summary.json").find("time_off_floor"), std::string::npos);
}

TEST(ExampleTest, APushUpwardsByMoreThanTheWeightLiftsTheBaseOff) {
  const auto [side, time] = tipping_of(
      scene_of("duration: 1\nrobot: {normal_reactions: dynamic}\nwrenches: [{force: [0, 0, 400], start: 0.1}]\n"));
  EXPECT_EQ(side, Side::kOff);
  EXPECT_NEAR(time, 0.1, 1e-3);
}

TEST(ExampleTest, TheUnevenFloorMakesTheBaseLeaveItsLine) {
  Scene scene = example("uneven_floor");
  const State uneven = end_of(scene);
  scene.robot.q = 0;
  const State even = end_of(scene);
  EXPECT_LT(std::hypot(even.x(), even.psi()), 1e-6);
  EXPECT_GT(std::hypot(uneven.x(), uneven.psi()), 5e-3);
}

}  // namespace
}  // namespace youbot_base_sim
