// Model 1 with dry friction in its bearings, which reverses within a small angular velocity.

#include "youbot_base_sim/integration/no_slip_integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

Scene scene_at(double tolerance) {
  Scene scene = default_scene({});
  scene.model = Model::kNoSlip;
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  return scene;
}

std::unique_ptr<Simulation> advanced(const Scene& scene, double duration, int rows) {
  auto simulation = std::make_unique<Simulation>(scene);
  for (int k = 1; k <= rows; ++k) simulation->advance_to(duration * k / rows);
  return simulation;
}

// Straight ahead one velocity is left: m dv/dt = 4/R (M - mu_1 w - T w / sqrt(rate^2 + w^2)) with w = v/R, here by the
// classical Runge-Kutta method in steps far shorter than the friction takes to turn.
TEST(NoSlipIntegratorTest, FollowsDryFrictionThatTurns) {
  constexpr double kDuration = 2, kTorque = 40, kPeriod = 0.5;
  Scene scene = scene_at(3e-7);
  RobotParameters& robot = scene.robot;
  robot.a_X = robot.a_Y = 0;  // so that nothing turns it
  robot.dry_friction.setConstant(1.5);
  TorqueSegment segment;
  segment.cos.setConstant(kTorque);
  segment.period = kPeriod;
  scene.drive = TorqueSegments{segment};

  const double m = robot.m_s() + 4 * robot.J_1 / (robot.R * robot.R), mu_1 = robot.mu_1[0];
  const auto acceleration = [&](double t, double v) {
    const double w = v / robot.R;
    return 4 / (m * robot.R) *
           (kTorque * std::cos(2 * M_PI * t / kPeriod) - mu_1 * w - 1.5 * w / std::hypot(robot.dry_friction_rate, w));
  };
  constexpr int kSteps = 400000;
  constexpr double h = kDuration / kSteps;
  double x = 0, v = 0, path = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double t = k * h, before = x;
    const double k1 = acceleration(t, v), k2 = acceleration(t + h / 2, v + h / 2 * k1);
    const double k3 = acceleration(t + h / 2, v + h / 2 * k2), k4 = acceleration(t + h, v + h * k3);
    x += h * (v + h / 6 * (k1 + k2 + k3));
    v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    path += std::abs(x - before);
  }
  ASSERT_GT(path, 1.1 * std::abs(x)) << "the base turns back";
  for (const int rows : {1, 200}) {
    EXPECT_NEAR(advanced(scene, kDuration, rows)->state().x(), x, 5 * 3e-7 * path) << rows << " rows";
  }
}

// The error estimate alone ends 2.7 mm off here at the default tolerance, 160 times what the tolerance implies.
TEST(NoSlipIntegratorTest, EndsWithinTheToleranceWhereFourWheelsReverse) {
  constexpr double kDuration = 5, kPath = 67;  // s, m
  const auto scene = [](double tolerance) {
    Scene reversing = scene_at(tolerance);
    reversing.robot.dry_friction = {1.5, 1.3, 1.5, 1.9};
    TorqueSegment first, second, last;
    first.constant = {-57, 24, 8, 6};
    second.start = 0.6;
    second.constant = {-16, 6, 2, 8};
    last.start = 3;
    last.constant = {170, 140, -42, -79};
    last.sin = {28, -159, -15, 11};
    last.period = 0.57;
    reversing.drive = TorqueSegments{first, second, last};
    return reversing;
  };
  const State exact = advanced(scene(1e-12), kDuration, 1)->state();
  for (const int rows : {1, 500}) {
    const auto simulation = advanced(scene(3e-7), kDuration, rows);
    const double off = std::hypot(simulation->state().x() - exact.x(), simulation->state().y() - exact.y());
    EXPECT_LT(off, 5 * 3e-7 * kPath) << rows << " rows";
    EXPECT_LT(simulation->statistics().evaluations, 12000u);
  }
}

// The torques of a desired motion turn where that motion's wheels reverse, which those of the base do elsewhere.
// Without steps that end there, the base ends 75 micrometres off.
TEST(NoSlipIntegratorTest, FollowsTorquesThatTurnWithTheDesiredMotion) {
  constexpr double kDuration = 0.5, kPath = 0.3;  // s, m
  const auto scene = [](double tolerance) {
    Scene drive = scene_at(tolerance);
    drive.robot.dry_friction.setConstant(0.257);
    drive.robot.mu_1.setConstant(0.00474);
    drive.initial.values.col(1).head<3>() << -0.0409, 0.188, 0.0284;
    ReferenceMotion motion;
    motion.period = 0.34085;
    motion.V_X = {-0.290469, 0.544401, 0};
    drive.drive = motion;
    return drive;
  };
  const State exact = advanced(scene(1e-12), kDuration, 50)->state();
  const State x = advanced(scene(3e-7), kDuration, 50)->state();
  EXPECT_LT(std::hypot(x.x() - exact.x(), x.y() - exact.y()), 5 * 3e-7 * kPath);
}

}  // namespace
}  // namespace youbot_base_sim
