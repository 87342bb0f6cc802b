// The records of roller switches over random and extreme runs: none is lost, whatever integrates at the time.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "random_scene.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

// What has been seen in all runs: the property means something only where all of it happens.
struct Seen {
  std::uint64_t switches = 0, counted = 0, exhausted = 0, shared = 0, averaged = 0;
};

struct Trial {
  Scene scene;
  std::function<Wheels(double t)> drive;  // at the beginning of each control period; none: the scene's
  int pieces = 1;                         // in which it is run, taking its switches after each
};

constexpr double kRounding = 1e-12;  // s, of the times at which control periods end

// Where the wheels stand by the records of their switches alone.
class Ledger {
 public:
  explicit Ledger(const Scene& scene) : geometry_(scene.robot), n_(scene.robot.rollers) {
    for (int i = 0; i < kWheels; ++i) roller_[i] = geometry_.roller_at(scene.initial.phi()[i]);
  }

  // Enters what happened since the last time up to `end`, s. Records must come in order of time.
  void enter(const std::vector<RollerSwitch>& events, double end) {
    for (const RollerSwitch& event : events) {
      EXPECT_GE(event.t, last_ - kRounding) << "not in order of time";
      last_ = event.t;
      EXPECT_TRUE(event.direction == 1 || event.direction == -1);
      EXPECT_GE(event.count, 1);
      std::int64_t& on = roller_[static_cast<std::size_t>(event.wheel)];
      EXPECT_EQ(event.roller_from, wrapped(on, n_)) << "wheel " << event.wheel << " at " << event.t << " s";
      on += event.direction * event.count;
      EXPECT_EQ(event.roller_to, wrapped(on, n_)) << "wheel " << event.wheel << " at " << event.t << " s";
      ++records_;
      if (event.count > 1) ++counted_;
    }
    EXPECT_LE(last_, end + kRounding);
    last_ = end;
  }

  // Of wheel i, which stands on `roller`, and on another one too if `shared`, at the angle phi.
  void check(int i, std::int64_t roller, bool shared, double phi) const {
    EXPECT_EQ(wrapped(roller, n_), wrapped(roller_[i], n_)) << "wheel " << i << " at " << last_ << " s";
    const std::int64_t at = geometry_.roller_at(phi);
    // A wheel that rests on an edge stands on both of its rollers, and (2.1) names the upper one.
    EXPECT_TRUE(at == roller_[i] || (shared && at == roller_[i] + 1))
        << "wheel " << i << " at " << last_ << " s, phi = " << phi;
  }

  std::uint64_t records() const { return records_; }
  std::uint64_t counted() const { return counted_; }  // those of several switches

 private:
  RollerGeometry geometry_;
  int n_;
  std::array<std::int64_t, kWheels> roller_{};
  double last_ = 0;
  std::uint64_t records_ = 0, counted_ = 0;
};

// Runs to the scene's end. Of each wheel the sum of direction times count of all records must be the change of its
// roller number.
void check_records(const Trial& run, Seen& seen) {
  const Scene& scene = run.scene;
  Simulation simulation(scene);
  Ledger ledger(scene);
  for (int piece = 1; piece <= run.pieces; ++piece) {
    const double end = scene.duration * piece / run.pieces;
    if (run.drive) {
      advance_to(simulation, end, [&](double t, const State&) { return run.drive(t); });
    } else {
      simulation.advance_to(end);
    }
    ASSERT_TRUE(simulation.state().values.allFinite()) << "at " << simulation.time() << " s";
    ledger.enter(simulation.take_switches(), simulation.time());
    for (int i = 0; i < kWheels; ++i) {
      ledger.check(i, simulation.rollers()[i], simulation.other_rollers()[i].has_value(), simulation.state().phi()[i]);
    }
  }
  seen.counted += ledger.counted();
  seen.switches += simulation.statistics().switches;
  seen.exhausted += simulation.statistics().exhausted;
  seen.shared += simulation.statistics().shared_contacts;
  seen.averaged += simulation.statistics().averaged_contacts;
}

Scene random_scene(Random& random, double duration) {
  Scene scene;
  scene.duration = duration;
  set_in_motion(scene, random, 20);
  return scene;
}

void push(Scene& scene, const Wheels& torque) { scene.drive = TorqueSegments{TorqueSegment{0, torque}}; }

class SwitchRecordsTest : public testing::Test {
 protected:
  static constexpr int kTrials = 8;

  // Checks runs over random scenes, each changed as `vary(trial, random, run)` says.
  template <class Vary>
  void check_trials(unsigned seed, int trials, double duration, const Vary& vary) {
    Random random(seed);
    for (int trial = 0; trial < trials; ++trial) {
      SCOPED_TRACE(trial);
      Trial run{random_scene(random, duration), nullptr, 1};
      vary(trial, random, run);
      check_records(run, seen);
    }
  }

  Seen seen;
};

TEST_F(SwitchRecordsTest, RandomTorques) {
  check_trials(71, 2 * kTrials, 2, [](int trial, Random& random, Trial& run) {
    push(run.scene, random.wheels(-3, 3));
    run.scene.model = trial % 4 == 3 ? Model::kViscous : Model::kCoulomb;
    run.scene.robot.rollers = 3 + trial % 7;
    run.pieces = 1 + trial % 5;
  });
  EXPECT_GT(seen.switches, 500u);
}

// Wheels that pass so many rollers that their contacts are averaged, and come back.
TEST_F(SwitchRecordsTest, TorquesOfThousandsOfNewtonMetres) {
  check_trials(72, kTrials, 0.3, [](int trial, Random& random, Trial& run) {
    const Wheels torque = 1e3 * random.wheels(-3, 3);
    run.scene.drive =
        TorqueSegments{TorqueSegment{0, torque}, TorqueSegment{0.05, -torque}, TorqueSegment{0.1, 0 * torque}};
    if (trial % 2 == 1) run.scene.solver.control_period = 1e-3;
    run.pieces = 1 + trial;
  });
  EXPECT_GT(seen.averaged, 0u);
  EXPECT_GT(seen.counted, 0u);
}

TEST_F(SwitchRecordsTest, SampledDrives) {
  check_trials(73, kTrials, 1, [](int trial, Random&, Trial& run) {
    run.scene.solver.control_period = trial % 2 == 0 ? 1e-3 : 7e-3;
    const double size = trial < 4 ? 2 : 100;
    Random torques(100 + static_cast<unsigned>(trial));
    run.drive = [=](double) mutable { return torques.wheels(-size, size); };
    run.pieces = 1 + 3 * trial;  // that end within a period too
  });
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
    const auto integration = make_integrator({Model::kCoulomb, scene.robot, scene.floor, scene.initial, torque, {}});
    Ledger ledger(scene);
    State x = scene.initial;
    for (int piece = 0; piece < 80; ++piece) {
      const double begin = 2.5e-3 * piece, end = 2.5e-3 * (piece + 1);
      if (piece % (8 + trial % 4) == 0) {  // after 20 ms or more, so that no stretch of fallback steps grows
        torque.hole = begin;
        integration->torque_jumped();
      }
      integration->advance(x, begin, end, end);
      ASSERT_TRUE(x.values.allFinite());
      ledger.enter(integration->take_switches(), end);
      const ContactModes& modes = *integration->contact_modes();
      for (int i = 0; i < kWheels; ++i) {
        ledger.check(i, modes.roller(i), modes.shared(i), x.phi()[i]);
      }
    }
    EXPECT_GE(integration->statistics().fallback_steps, 8u * 50u);
    EXPECT_GT(integration->statistics().steps, 0u);
    EXPECT_EQ(integration->statistics().switches > 0, ledger.records() > 0);
    switches += ledger.records();
  }
  EXPECT_GT(switches, 400u);
}

// More work than a millisecond of real time allows: wheels at hundreds of rad/s, friction that turns within 1e-11 m/s,
// under torques that reverse each millisecond, nearly to rounding.
TEST_F(SwitchRecordsTest, BoundOfWork) {
  check_trials(78, kTrials, 0.1, [](int trial, Random& random, Trial& run) {
    run.scene.floor.nu = 1e-11;
    run.scene.solver.control_period = 1e-3;
    run.scene.solver.relative_tolerance = 1e-14;
    run.scene.solver.absolute_tolerance = 1e-15;
    run.scene.solver.keeps_up = true;
    run.scene.initial.dphi() = random.wheels(-300, 300);
    const Wheels torque = random.wheels(-10, 10);
    run.drive = [=](double t) -> Wheels { return std::lround(t * 1e3) % 2 == 0 ? torque : -torque; };
    run.pieces = 1 + 10 * trial;
  });
  EXPECT_GT(seen.exhausted, 0u);
}

TEST_F(SwitchRecordsTest, NearlyPerfectFriction) {
  check_trials(75, kTrials, 0.5, [](int trial, Random& random, Trial& run) {
    run.scene.floor.nu = std::pow(10, -5 - trial % 4);
    push(run.scene, random.wheels(-3, 3) * (trial % 2 == 0 ? 1 : 30));
    run.scene.solver.relative_tolerance = trial % 3 == 0 ? 1e-3 : 1e-6;
    run.scene.solver.absolute_tolerance = 1e-3 * run.scene.solver.relative_tolerance;
    run.pieces = 1 + trial;
  });
}

// Wheels that chatter on an edge, come to rest there and leave it; some start exactly on one.
TEST_F(SwitchRecordsTest, WheelsBetweenTwoRollers) {
  check_trials(76, 2 * kTrials, 0.3, [](int trial, Random& random, Trial& run) {
    Scene& scene = run.scene;
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
    if (trial % 4 == 2) {  // which spends the bound of work
      scene.solver.relative_tolerance = scene.solver.absolute_tolerance = 1e-8;
      scene.solver.keeps_up = true;
    }
    run.pieces = 1 + 10 * (trial % 3);
  });
  EXPECT_GT(seen.shared, 4u);
}

}  // namespace
}  // namespace youbot_base_sim
