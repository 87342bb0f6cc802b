// The records of roller switches over random and extreme runs: none is lost, whatever integrates at the time.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "physics/random_states.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

// What has been seen in all runs: the property means something only where all of it happens.
struct Seen {
  std::uint64_t switches = 0, counted = 0, exhausted = 0, shared = 0, averaged = 0;
};

struct Run {
  Scene scene;
  Simulation::Drive drive;  // none: the scene's
  int pieces = 1;           // in which it is run, taking its switches after each
};

constexpr double kRounding = 1e-12;  // s, of the times at which control periods end

// Runs to the scene's end. Of each wheel the sum of direction times count of all records must be the change of its
// roller number, and records must come in order of time.
void check_records(const Run& run, Seen& seen) {
  const Scene& scene = run.scene;
  const RollerGeometry geometry(scene.robot);
  const int n = scene.robot.rollers;
  Simulation simulation = run.drive ? Simulation(scene, run.drive) : Simulation(scene);
  std::array<std::int64_t, kWheels> roller{};
  for (int i = 0; i < kWheels; ++i) roller[i] = geometry.roller_at(scene.initial.phi()[i]);
  double begin = 0;
  for (int piece = 1; piece <= run.pieces; ++piece) {
    simulation.advance_to(scene.duration * piece / run.pieces);
    const double end = simulation.time();
    ASSERT_TRUE(simulation.state().values.allFinite()) << "at " << end << " s";
    double last = begin - kRounding;
    for (const RollerSwitch& event : simulation.take_switches()) {
      ASSERT_GE(event.t, last) << "not in order of time";
      last = event.t;
      ASSERT_TRUE(event.direction == 1 || event.direction == -1);
      ASSERT_GE(event.count, 1);
      std::int64_t& on = roller[static_cast<std::size_t>(event.wheel)];
      EXPECT_EQ(event.roller_from, wrapped(on, n)) << "wheel " << event.wheel << " at " << event.t << " s";
      on += event.direction * event.count;
      EXPECT_EQ(event.roller_to, wrapped(on, n)) << "wheel " << event.wheel << " at " << event.t << " s";
      seen.counted += event.count > 1 ? 1 : 0;
    }
    EXPECT_LE(last, end + kRounding);
    for (int i = 0; i < kWheels; ++i) {
      const double phi = simulation.state().phi()[i];
      const auto other = simulation.other_rollers()[i];
      EXPECT_EQ(simulation.rollers()[i], wrapped(roller[i], n)) << "wheel " << i << " at " << end << " s";
      if (other) {
        // A wheel that rests on an edge stands on both of its rollers, and (2.1) names the upper one.
        EXPECT_TRUE(geometry.roller_at(phi) == roller[i] || geometry.roller_at(phi) == roller[i] + 1) << "wheel " << i;
      } else {
        EXPECT_EQ(geometry.roller_at(phi), roller[i]) << "wheel " << i << " at " << end << " s, phi = " << phi;
      }
    }
    begin = end;
  }
  seen.switches += simulation.statistics().switches;
  seen.exhausted += simulation.statistics().exhausted;
  seen.shared += simulation.statistics().shared_contacts;
  seen.averaged += simulation.statistics().averaged_contacts;
}

Scene random_scene(Random& random, double duration) {
  Scene scene;
  scene.duration = duration;
  scene.initial.V_X() = random.uniform(-0.5, 0.5);
  scene.initial.V_Y() = random.uniform(-0.5, 0.5);
  scene.initial.Omega() = random.uniform(-1, 1);
  NoSlipModel(scene.robot).constrain(scene.initial);
  scene.initial.phi() = random.wheels(-20, 20);
  return scene;
}

void push(Scene& scene, const Wheels& torque) { scene.drive = TorqueSegments{TorqueSegment{0, torque}}; }

class SwitchRecordsTest : public testing::Test {
 protected:
  // Each is a kind of run; `trial` tells random ones apart.
  static constexpr int kTrials = 8;
  Seen seen;
};

TEST_F(SwitchRecordsTest, RandomTorques) {
  Random random(71);
  for (int trial = 0; trial < 2 * kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 2);
    push(scene, random.wheels(-3, 3));
    scene.model = trial % 4 == 3 ? Model::kViscous : Model::kCoulomb;
    scene.robot.rollers = 3 + trial % 7;
    check_records({scene, nullptr, 1 + trial % 5}, seen);
  }
  EXPECT_GT(seen.switches, 500u);
}

// Wheels that pass so many rollers that their contacts are averaged, and come back.
TEST_F(SwitchRecordsTest, TorquesOfThousandsOfNewtonMetres) {
  Random random(72);
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 0.3);
    const Wheels torque = 1e3 * random.wheels(-3, 3);
    scene.drive =
        TorqueSegments{TorqueSegment{0, torque}, TorqueSegment{0.05, -torque}, TorqueSegment{0.1, 0 * torque}};
    if (trial % 2 == 1) scene.solver.control_period = 1e-3;
    check_records({scene, nullptr, 1 + trial}, seen);
  }
  EXPECT_GT(seen.averaged, 0u);
  EXPECT_GT(seen.counted, 0u);
}

TEST_F(SwitchRecordsTest, SampledDrives) {
  Random random(73);
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 1);
    scene.solver.control_period = trial % 2 == 0 ? 1e-3 : 7e-3;
    // Pieces that end within a period too.
    const double size = trial < 4 ? 2 : 100;
    Random torques(100 + static_cast<unsigned>(trial));
    check_records({scene, [=](double, const State&) mutable { return torques.wheels(-size, size); }, 1 + 3 * trial},
                  seen);
  }
  EXPECT_GT(seen.switches, 50u);
}

// A torque that is no number for 10 us from some time on: steps that begin there fail, until one of the fallback, which
// asks for the torque at its end, leads out of it.
class TorqueWithHoles : public HeldTorque {
 public:
  using HeldTorque::HeldTorque;
  Wheels value(double t) const override {
    return t >= hole && t < hole + 1e-5 ? Wheels::Constant(std::numeric_limits<double>::quiet_NaN())
                                        : HeldTorque::value(t);
  }
  double hole = std::numeric_limits<double>::infinity();  // s
};

// Fallback steps by force, every now and then, for wheels at hundreds of rad/s that go on by accurate steps in between.
TEST_F(SwitchRecordsTest, Fallback) {
  Random random(74);
  std::uint64_t switches = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 0);
    scene.initial.dphi() = random.wheels(-450, 450);
    TorqueWithHoles torque(random.wheels(-30, 30));
    const auto integration =
        make_integration(Model::kCoulomb, scene.robot, scene.floor, scene.initial, torque, {"radau", {3e-7, 3e-10}, 0});
    const RollerGeometry geometry(scene.robot);
    State x = scene.initial;
    std::array<std::int64_t, kWheels> roller{};
    for (int i = 0; i < kWheels; ++i) roller[i] = geometry.roller_at(x.phi()[i]);
    double last = 0;
    for (int piece = 0; piece < 80; ++piece) {
      const double begin = 2.5e-3 * piece, end = 2.5e-3 * (piece + 1);
      if (piece % (8 + trial % 4) == 0) {  // after 20 ms or more, so that no stretch of fallback steps grows
        torque.hole = begin;
        integration->torque_jumped();
      }
      integration->advance(x, begin, end);
      ASSERT_TRUE(x.values.allFinite());
      for (const RollerSwitch& event : integration->take_switches()) {
        EXPECT_GE(event.t, last - kRounding) << "not in order of time";
        EXPECT_LE(event.t, end + kRounding);
        last = event.t;
        roller[static_cast<std::size_t>(event.wheel)] += event.direction * event.count;
        ++switches;
      }
      for (int i = 0; i < kWheels; ++i) {
        EXPECT_EQ(integration->roller(i), roller[i]) << "wheel " << i << " at " << end << " s";
        if (!integration->other_roller(i)) {
          EXPECT_EQ(geometry.roller_at(x.phi()[i]), roller[i]) << "wheel " << i << " at " << end << " s";
        }
      }
    }
    EXPECT_GE(integration->statistics().fallback_steps, 8u * 50u);
    EXPECT_GT(integration->statistics().steps, 0u);
    EXPECT_EQ(integration->statistics().switches > 0, last > 0);
  }
  EXPECT_GT(switches, 400u);
}

// More work than a millisecond allows: wheels at hundreds of rad/s on friction that turns within 1e-9 m/s, under
// torques that reverse each millisecond.
TEST_F(SwitchRecordsTest, BoundOfWork) {
  Random random(78);
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 0.1);
    scene.floor.nu = 1e-9;
    scene.solver.control_period = 1e-3;
    scene.solver.relative_tolerance = 1e-10;
    scene.solver.absolute_tolerance = 1e-13;
    scene.initial.dphi() = random.wheels(-300, 300);
    const Wheels torque = random.wheels(-10, 10);
    check_records(
        {scene, [=](double t, const State&) -> Wheels { return std::lround(t * 1e3) % 2 == 0 ? torque : -torque; },
         1 + 10 * trial},
        seen);
  }
  EXPECT_GT(seen.exhausted, 0u);
}

TEST_F(SwitchRecordsTest, NearlyPerfectFriction) {
  Random random(75);
  for (int trial = 0; trial < kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 0.5);
    scene.floor.nu = std::pow(10, -5 - trial % 4);
    push(scene, random.wheels(-3, 3) * (trial % 2 == 0 ? 1 : 30));
    scene.solver.relative_tolerance = trial % 3 == 0 ? 1e-3 : 1e-6;
    scene.solver.absolute_tolerance = 1e-3 * scene.solver.relative_tolerance;
    check_records({scene, nullptr, 1 + trial}, seen);
  }
}

// Wheels that chatter on an edge, come to rest there and leave it; some start exactly on one.
TEST_F(SwitchRecordsTest, WheelsBetweenTwoRollers) {
  Random random(76);
  for (int trial = 0; trial < 2 * kTrials; ++trial) {
    SCOPED_TRACE(trial);
    Scene scene = random_scene(random, 0.3);
    const double Omega = trial % 2 == 0 ? 0.5 : -0.5;
    const int i = Omega > 0 ? 3 * (trial / 2 % 2) : 1;
    scene.initial.Omega() = Omega;
    scene.initial.V_X() = scene.robot.rho_Y()[i] * Omega;
    scene.initial.V_Y() = -scene.robot.rho_X()[i] * Omega;
    NoSlipModel(scene.robot).constrain(scene.initial);
    const double edge = RollerGeometry(scene.robot).upper_edge(trial - 8);
    scene.initial.phi()[i] = trial % 3 == 0 ? edge : edge - random.uniform(-1e-5, 1e-5);
    scene.initial.dphi()[i] = 0;
    push(scene, random.wheels(-0.5, 0.5));
    if (trial % 4 == 1) scene.solver.control_period = 1e-3;
    if (trial % 4 == 2) scene.solver.relative_tolerance = scene.solver.absolute_tolerance = 1e-8;  // and fallback
    check_records({scene, nullptr, 1 + 10 * (trial % 3)}, seen);
  }
  EXPECT_GT(seen.shared, 4u);
}

}  // namespace
}  // namespace youbot_base_sim
