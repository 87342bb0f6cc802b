// The step of last resort: right where the accurate one is, and standing where that one falls.

#include "youbot_base_sim/integration/fallback_stepper.h"

#include <gtest/gtest.h>

#include <functional>

#include "explicit_solution.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/physics/model.h"

namespace youbot_base_sim {
namespace {

// In the middle of the rollers, rolling nearly without slip.
State rolling_state() {
  State x;
  x.values.col(0) << 1, 2, 0.5, 0;
  x.values.col(1) << 0.4, 0.1, 0.2, 0;
  x.phi() << 0.1, -0.1, 0.2, 0.05;
  x.dphi() = Wheels::Constant(8);
  return x;
}

double distance(const State& a, const State& b) { return (a.values - b.values).abs().maxCoeff(); }

TEST(FallbackStepperTest, ConvergesWithTheFirstOrder) {
  const PaperModel<CoulombLaw> model{RobotParameters(), FloorParameters()};
  const HeldTorque torque(Wheels{1, -0.5, 0.7, 1.2});
  constexpr double kEnd = 2e-3;  // s; no wheel reaches an edge

  SlipSystem<PaperModel<CoulombLaw>> system(model, torque, rolling_state());
  const State exact = explicit_solution(system, rolling_state(), 0, kEnd, 1e-11);

  const auto error = [&](int steps) {
    State x = rolling_state();
    FallbackStepper<PaperModel<CoulombLaw>> fallback;
    for (int k = 0; k < steps; ++k) fallback.do_step(system, x, k * kEnd / steps, kEnd / steps);
    return distance(x, exact);
  };
  const double coarse = error(1000), fine = error(2000);
  EXPECT_GT(fine, 1e-6);  // not lost in rounding
  EXPECT_NEAR(coarse / fine, 2, 0.1);
}

// The step solves its equations whatever its length, and dissipates: without torque no kinetic energy comes from it.
TEST(FallbackStepperTest, StandsWhereStepsAndStiffnessAreExtreme) {
  for (const double nu : {1e-2, 1e-6, 1e-12}) {
    FloorParameters floor;
    floor.nu = nu;
    const PaperModel<CoulombLaw> model(RobotParameters(), floor);
    const HeldTorque torque;
    FallbackStepper<PaperModel<CoulombLaw>> fallback;
    for (const double dt : {1e-7, 1e-4, 1e-1}) {
      State x = rolling_state();
      for (int k = 0; k < 100; ++k) {
        const double before = kinetic_energy(model.robot(), x);
        SlipSystem<PaperModel<CoulombLaw>> system(model, torque, x);
        fallback.do_step(std::ref(system), x, 0, dt);
        ASSERT_TRUE(x.values.allFinite()) << "nu " << nu << ", dt " << dt;
        // Coriolis forces are held over the step: they may add (dt Omega)^2 of it.
        ASSERT_LE(kinetic_energy(model.robot(), x), before * (1 + 0.05 * dt * dt + 1e-12))
            << "nu " << nu << ", dt " << dt;
      }
    }
  }
}

TEST(FallbackStepperTest, AbsurdTorqueGivesWhatItsInertiaAllows) {
  const PaperModel<CoulombLaw> model{RobotParameters(), FloorParameters()};
  FallbackStepper<PaperModel<CoulombLaw>> fallback;
  State x;
  constexpr double kTorque = 1e6, kStep = 1e-5;
  const HeldTorque torque(Wheels::Constant(kTorque));
  SlipSystem<PaperModel<CoulombLaw>> system(model, torque, x);
  fallback.do_step(std::ref(system), x, 0, kStep);
  // J_1 dphi / dt = M - mu_1 dphi, next to which friction, some 50 N, is nothing.
  const double dphi = kTorque / (model.robot().J_1 / kStep + 0.11);
  EXPECT_NEAR(x.dphi()[0], dphi, 1e-5 * dphi);
}

// Beyond the edges of the rollers on which the wheels stand when the step begins, or with a contact that is averaged.
TEST(FallbackStepperTest, StandsFarFromTheRollersOfItsStart) {
  const PaperModel<CoulombLaw> model{RobotParameters(), FloorParameters()};
  const HeldTorque torque;
  State x = rolling_state();
  SlipSystem<PaperModel<CoulombLaw>> system(model, torque, x);
  system.modes().enter_averaging(2);
  FallbackStepper<PaperModel<CoulombLaw>> fallback;
  double energy = kinetic_energy(model.robot(), x);
  for (int k = 0; k < 100; ++k) {
    fallback.do_step(std::ref(system), x, 1e-3 * k, 1e-3);
    ASSERT_TRUE(x.values.allFinite()) << k;
    ASSERT_LE(kinetic_energy(model.robot(), x), energy * (1 + 1e-6)) << k;
    energy = kinetic_energy(model.robot(), x);
  }
  EXPECT_GT(x.phi()[2], 0.2 + 0.5);
}

}  // namespace
}  // namespace youbot_base_sim
