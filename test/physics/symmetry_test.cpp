// Symmetries of the motion: what is the same robot, seen in a mirror, turned or with its wheels turned by whole
// rollers, moves the same way. Of right-hand sides and of whole short runs.

#include <gtest/gtest.h>

#include <complex>
#include <type_traits>

#include "random_scene.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

/// A symmetry of a base with four Mecanum wheels. Each wheel takes the place of another, on which the rollers' axes lie
/// as on its mirror image; what points along a mirrored direction changes its sign.
struct Symmetry {
  const char* name;
  std::array<int, kWheels> origin;  ///< the wheel whose place wheel i takes
  double X, Y;                      ///< signs along the platform's axes; those of the fixed frame likewise
  double turn;                      ///< of psi and Omega
  double phi, gamma;                ///< of angles and rates of wheels, and of rollers

  Wheels operator()(double sign, const Wheels& wheels) const {
    Wheels image;
    for (int i = 0; i < kWheels; ++i) image[i] = sign * wheels[origin[i]];
    return image;
  }

  State operator()(const State& state) const {
    State image;
    image.x() = X * state.x();
    image.y() = Y * state.y();
    image.psi() = turn * state.psi();
    image.work() = state.work();
    image.V_X() = X * state.V_X();
    image.V_Y() = Y * state.V_Y();
    image.Omega() = turn * state.Omega();
    image.phi() = (*this)(phi, state.phi());
    image.dphi() = (*this)(phi, state.dphi());
    image.dgamma() = (*this)(gamma, state.dgamma());
    image.gamma() = (*this)(gamma, state.gamma());
    return image;
  }

  RobotParameters operator()(const RobotParameters& robot) const {
    RobotParameters image = robot;
    image.a_X = X * robot.a_X;
    image.a_Y = Y * robot.a_Y;
    image.mu_1 = (*this)(1, robot.mu_1);
    image.mu_2 = (*this)(1, robot.mu_2);
    image.roller_angle = (*this)(1, robot.roller_angle);
    return image;
  }
};

// Mirrors turn the rollers' axes over, delta to -delta, and so the rollers where the wheel turns on as before.
constexpr Symmetry kSymmetries[] = {{"left and right", {1, 0, 3, 2}, 1, -1, -1, 1, -1},
                                    {"front and rear", {2, 3, 0, 1}, -1, 1, -1, -1, 1},
                                    {"half a turn", {3, 2, 1, 0}, -1, -1, 1, -1, -1}};

/// A robot in motion, each contact point slipping by `slip` (m/s), its wheels around the middle of the rollers that are
/// `rollers` on from the first.
template <class Model>
struct RandomMotion {
  RandomMotion(Random& random, double slip, const Wheels& rollers = Wheels::Zero())
      : robot(random_wheels(random)),
        model(robot, floor),
        x(random_state(random, robot, rollers * model.geometry().pitch(), slip)),
        M(random.wheels(-3, 3)) {}

  FloorParameters floor;
  RobotParameters robot;
  Model model;
  State x;
  Wheels M;  ///< N m
  HeldTorque torque{M};
};

template <class Model>
class RightHandSideTest : public testing::Test {};
using Laws = testing::Types<PaperModel<ViscousLaw>, PaperModel<CoulombLaw>>;
TYPED_TEST_SUITE(RightHandSideTest, Laws, );

// The slip is a difference of speeds of about 1 m/s: known to a few units in their last place, which the contact turns
// into a force by up to f N / nu, at most 1.5 mu_0 per wheel. What the forces then round is less.
double force_rounding(const RobotParameters& robot, const FloorParameters& floor) {
  return 1.5 * floor.mu_0(robot)[0] * 2e-15 + 1e-14 * floor.f[0] * robot.m_s() * floor.g;
}

// Differences of dx/dt that are due to the rounding of forces alone.
void expect_same_up_to_rounding(const State& a, const State& b, const RobotParameters& robot,
                                const FloorParameters& floor) {
  const double force = force_rounding(robot, floor);
  EXPECT_LT((a.values.col(0).head<3>() - b.values.col(0).head<3>()).abs().maxCoeff(), 1e-14);
  EXPECT_LT((a.velocity() - b.velocity()).norm(), 4 * force * 0.4 / robot.I_s);
  EXPECT_TRUE((a.phi() == b.phi()).all());
  EXPECT_TRUE((a.gamma() == b.gamma()).all());
  EXPECT_LT((a.dphi() - b.dphi()).abs().maxCoeff(), force * robot.R / robot.J_1);
  EXPECT_LT((a.dgamma() - b.dgamma()).abs().maxCoeff(), force * (robot.R - robot.R_d) / robot.J_2);
  // Power: forces times speeds of up to 1 m/s at four contacts, and what cancels of them.
  EXPECT_LT(std::abs(a.work() - b.work()), 8 * force + 1e-14 * (std::abs(a.work()) + 100));
}

TYPED_TEST(RightHandSideTest, HasTheSymmetriesOfTheRobot) {
  Random random(21);
  for (const Symmetry& image_of : kSymmetries) {
    for (int trial = 0; trial < 30; ++trial) {
      SCOPED_TRACE(testing::Message() << image_of.name << ", trial " << trial);
      const double slip = FloorParameters().nu * std::pow(10, trial % 6 - 3);
      const auto [floor, robot, model, x, M, torque] = RandomMotion<TypeParam>(random, slip, {-2, 0, 1, 7});
      const TypeParam mirrored(image_of(robot), floor);
      const HeldTorque mirrored_torque(image_of(image_of.phi, M));
      State dxdt, image;
      SlipSystem<TypeParam>(model, torque, x)(x, dxdt, 0);
      SlipSystem<TypeParam>(mirrored, mirrored_torque, image_of(x))(image_of(x), image, 0);
      expect_same_up_to_rounding(image, image_of(dxdt), robot, floor);
    }
  }
}

TYPED_TEST(RightHandSideTest, IsTheSameAtEveryHeading) {
  Random random(22);
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const auto [floor, robot, model, x, M, torque] = RandomMotion<TypeParam>(random, 1e-3);
    const double angle = random.uniform(-4, 4);
    State turned = x, dxdt, of_turned;
    turned.psi() += angle;
    const SlipSystem<TypeParam> system(model, torque, x);
    system(x, dxdt, 0);
    system(turned, of_turned, 0);
    const auto velocity = std::complex<double>(dxdt.x(), dxdt.y()) * std::polar(1.0, angle);
    EXPECT_NEAR(of_turned.x(), velocity.real(), 1e-14);
    EXPECT_NEAR(of_turned.y(), velocity.imag(), 1e-14);
    of_turned.x() = dxdt.x();
    of_turned.y() = dxdt.y();
    EXPECT_TRUE((of_turned.values == dxdt.values).all());
  }
}

TYPED_TEST(RightHandSideTest, IsTheSameOnEveryRoller) {
  Random random(23);
  for (int trial = 0; trial < 30; ++trial) {
    SCOPED_TRACE(trial);
    const auto [floor, robot, model, x, M, torque] = RandomMotion<TypeParam>(random, 0.1);
    State shifted = x, dxdt, of_shifted;
    double largest = 0;
    for (int i = 0; i < kWheels; ++i) {
      shifted.phi()[i] += std::round(random.uniform(-1000, 1000)) * model.geometry().pitch();
      largest = std::max(largest, std::abs(shifted.phi()[i]));
    }
    SlipSystem<TypeParam>(model, torque, x)(x, dxdt, 0);
    SlipSystem<TypeParam>(model, torque, shifted)(shifted, of_shifted, 0);
    // An angle of `largest` is known to 2e-16 of it; the contact point moves by at most R_d / cos^2 of an edge, and
    // slip is that times rates of up to 200 rad/s.
    RobotParameters blurred = robot;
    FloorParameters coarse = floor;
    coarse.viscous_friction = floor.mu_0(robot)[0] * (1 + 3 * 2e-16 * largest * 2 * robot.R_d * 200 / 2e-15);
    expect_same_up_to_rounding(of_shifted, dxdt, blurred, coarse);
  }
}

/// A second of motion, as exact as it can be had.
Scene second_of_motion(Random& random, Model model) {
  Scene scene = random_scene(random, model, {0, 0.3, 0.7}, 2);
  scene.duration = 1;
  scene.solver.relative_tolerance = 1e-9;
  scene.solver.absolute_tolerance = 1e-12;
  return scene;
}

struct Outcome {
  State state;
  std::vector<RollerSwitch> switches;
  double rounding;  ///< of the run, m and m/s
};

Outcome run(const Scene& scene) {
  Simulation simulation(scene);
  simulation.advance_to(scene.duration);
  EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
  // Each step rounds numbers of up to 4 in their last place; friction does not let it grow.
  const double steps = static_cast<double>(simulation.statistics().steps + simulation.statistics().rejected_steps);
  return {simulation.state(), simulation.take_switches(), 1e-15 * steps};
}

void expect_same_motion(const Outcome& run, const Outcome& expected) {
  const double allowed = run.rounding + expected.rounding;
  EXPECT_LT((run.state.values.col(0).head<3>() - expected.state.values.col(0).head<3>()).abs().maxCoeff(), allowed);
  EXPECT_LT((run.state.values.col(1) - expected.state.values.col(1)).abs().maxCoeff(), allowed);
  // Wheels turn by 1/R for each metre.
  EXPECT_LT((run.state.phi() - expected.state.phi()).abs().maxCoeff(), allowed / 0.05);
  ASSERT_EQ(run.switches.size(), expected.switches.size());
}

const Model kModels[] = {Model::kNoSlip, Model::kViscous, Model::kCoulomb};

TEST(MotionTest, HasTheSymmetriesOfTheRobot) {
  Random random(24);
  std::size_t switches = 0;
  for (const Symmetry& image_of : kSymmetries) {
    for (int trial = 0; trial < 9; ++trial) {
      SCOPED_TRACE(testing::Message() << image_of.name << ", trial " << trial);
      const Scene scene = second_of_motion(random, kModels[trial % 3]);
      Scene mirrored = scene;
      mirrored.robot = image_of(scene.robot);
      mirrored.initial = image_of(scene.initial);
      for (TorqueSegment& segment : std::get<TorqueSegments>(mirrored.drive)) {
        segment.constant = image_of(image_of.phi, segment.constant);
      }
      const Outcome original = run(scene), image = run(mirrored);
      expect_same_motion(image, {image_of(original.state), original.switches, original.rounding});
      const int n = scene.robot.rollers;
      for (std::size_t k = 0; k < image.switches.size(); ++k) {
        const RollerSwitch &seen = image.switches[k], &was = original.switches[k];
        EXPECT_NEAR(seen.t, was.t, 1e-6);
        EXPECT_EQ(image_of.origin[static_cast<std::size_t>(seen.wheel)], was.wheel);
        EXPECT_EQ(seen.direction, image_of.phi * was.direction);
        EXPECT_EQ(seen.roller_from, wrapped(image_of.phi > 0 ? was.roller_from : -was.roller_from, n));
      }
      switches += image.switches.size();
    }
  }
  EXPECT_GT(switches, 100u);
}

TEST(MotionTest, IsTheSameFromEveryPose) {
  Random random(25);
  for (int trial = 0; trial < 9; ++trial) {
    SCOPED_TRACE(trial);
    const Scene scene = second_of_motion(random, kModels[trial % 3]);
    const double angle = random.uniform(-4, 4);
    const std::complex<double> shift(random.uniform(-5, 5), random.uniform(-5, 5));
    const auto moved = [&](State state) {
      const auto point = std::complex<double>(state.x(), state.y()) * std::polar(1.0, angle) + shift;
      state.x() = point.real();
      state.y() = point.imag();
      state.psi() += angle;
      return state;
    };
    Scene elsewhere = scene;
    elsewhere.initial = moved(scene.initial);
    const Outcome original = run(scene);
    expect_same_motion(run(elsewhere), {moved(original.state), original.switches, original.rounding});
  }
}

TEST(MotionTest, IsTheSameOnEveryRoller) {
  Random random(26);
  for (int trial = 0; trial < 9; ++trial) {
    SCOPED_TRACE(trial);
    const Scene scene = second_of_motion(random, kModels[trial % 3]);
    Scene shifted = scene;
    const double pitch = RollerGeometry(scene.robot).pitch();
    std::array<int, kWheels> rollers{};
    for (int i = 0; i < kWheels; ++i) {
      rollers[static_cast<std::size_t>(i)] = static_cast<int>(std::round(random.uniform(-1000, 1000)));
      shifted.initial.phi()[i] += rollers[static_cast<std::size_t>(i)] * pitch;
    }
    Outcome original = run(scene);
    for (int i = 0; i < kWheels; ++i) original.state.phi()[i] += rollers[static_cast<std::size_t>(i)] * pitch;
    original.rounding *= shifted.initial.phi().abs().maxCoeff() / 4;  // of angles beyond 4 rad
    const Outcome on_others = run(shifted);
    expect_same_motion(on_others, original);
    for (std::size_t k = 0; k < on_others.switches.size(); ++k) {
      const RollerSwitch &seen = on_others.switches[k], &was = original.switches[k];
      EXPECT_NEAR(seen.t, was.t, 1e-6);
      EXPECT_EQ(seen.wheel, was.wheel);
      EXPECT_EQ(seen.roller_to,
                wrapped(was.roller_to + rollers[static_cast<std::size_t>(was.wheel)], scene.robot.rollers));
    }
  }
}

}  // namespace
}  // namespace youbot_base_sim
