// Dry friction of drives and rollers in all models. Trajectories of an independent solver with it are in
// reference_test.

#include "youbot_base_sim/physics/dry_bearings.h"

#include <gtest/gtest.h>

#include "random_states.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {
namespace {

RobotParameters dry_robot() {
  RobotParameters robot;
  robot.dry_friction << 0.3, 0.2, 0.1, 0.4;
  robot.dry_friction_rate = 0.05;
  robot.roller_dry_friction << 0.07, 0.05, 0.09, 0.03;
  robot.roller_dry_friction_rate = 1.5;
  return robot;
}

TEST(DryBearings, BrakeByTheirLimitWhateverTheRate) {
  const RobotParameters robot = dry_robot();
  const DryBearings dry(robot);
  const auto at = [&](double w) { return dry.wheels.torque(Wheels::Constant(w)); };
  EXPECT_TRUE((at(0) == 0).all());
  EXPECT_LT((at(robot.dry_friction_rate) * std::sqrt(2.0) - robot.dry_friction).abs().maxCoeff(), 1e-15);
  EXPECT_LT((at(1e3) - robot.dry_friction).abs().maxCoeff(), 1e-8);
  EXPECT_LT((at(-1e3) + robot.dry_friction).abs().maxCoeff(), 1e-8);
  EXPECT_FALSE(DryBearings(RobotParameters()).any());
}

// Differences over 2 d have an error of T d^2 / rate^2 and a rounding of 1e-16 T / d.
TEST(DryBearings, DampingIsTheSlopeOfTheTorque) {
  const DryBearings dry(dry_robot());
  constexpr double d = 1e-6;
  for (const double w : {-3.0, -0.04, 0.0, 0.01, 0.3, 20.0}) {
    for (const DryFriction& bearings : {dry.wheels, dry.rollers}) {
      const Wheels slope =
          (bearings.torque(Wheels::Constant(w + d)) - bearings.torque(Wheels::Constant(w - d))) / (2 * d);
      EXPECT_LT((slope - bearings.damping(Wheels::Constant(w))).abs().maxCoeff(), 1e-8) << w;
    }
  }
}

template <class Model>
class DrySlipModel : public testing::Test {};
using Laws = testing::Types<PaperModel<ViscousLaw>, PaperModel<CoulombLaw>>;
TYPED_TEST_SUITE(DrySlipModel, Laws, );

TYPED_TEST(DrySlipModel, BrakesWheelsAndRollersAndNothingElse) {
  const RobotParameters robot = dry_robot();
  const FloorParameters floor;
  const TypeParam with(robot, floor), without(RobotParameters(), floor);
  const DryBearings dry(robot);
  const Velocities u{{0.4, -0.3, 0.5, 0}, {0.01, -7, 12, -0.2}, {1, -40, 0.3, 90}};
  const Wheels M{1, 2, -1, 0.5};
  const Contacts c = contacts_of(with, u, Wheels{0.1, -0.2, 0.3, 0});
  const Velocities change = with.forces(u, c, M) - without.forces(u, c, M);
  EXPECT_TRUE((change.v == 0).all());
  constexpr double kRounding = 1e-11;  // of the contacts' torques, up to 1e3 N m in model 2a
  EXPECT_LT((change.dphi + dry.wheels.torque(u.dphi)).abs().maxCoeff(), kRounding);
  EXPECT_LT((change.dgamma + dry.rollers.torque(u.dgamma)).abs().maxCoeff(), kRounding);
}

TYPED_TEST(DrySlipModel, DampingMatrixIsTheDerivativeOfTheForces) {
  FloorParameters floor;
  floor.nu = 0.1;  // so that differences of the contacts' friction are no harder than those of the bearings'
  const TypeParam model(dry_robot(), floor);
  const Velocities u{{0.4, -0.3, 0.5, 0}, {0.01, -7, 12, -0.2}, {1, -40, 0.3, 90}};
  const Wheels phi{0.1, -0.2, 0.3, 0};
  DampingMatrix G;
  model.damping(u, contacts_of(model, u, phi), G);
  constexpr double d = 1e-6;
  for (int i = 0; i < kWheels; ++i) {
    const auto slope = [&](Wheels Velocities::*rate) {
      Velocities above = u, below = u;
      (above.*rate)[i] += d;
      (below.*rate)[i] -= d;
      const Velocities rise = model.forces(above, contacts_of(model, above, phi), Wheels::Zero()) -
                              model.forces(below, contacts_of(model, below, phi), Wheels::Zero());
      return -(rise.*rate)[i] / (2 * d);
    };
    EXPECT_NEAR(slope(&Velocities::dphi), G.dphi_dphi[i], 1e-7 * (1 + G.dphi_dphi[i])) << i;
    EXPECT_NEAR(slope(&Velocities::dgamma), G.dgamma_dgamma[i], 1e-7 * (1 + G.dgamma_dgamma[i])) << i;
  }
}

// Sideways at V, a wheel turns at V / R and its roller at V / ((R - R_d) cos 45): the roller's torque counts at the
// wheel by the ratio of the two.
TEST(DryNoSlipModel, TorqueAtConstantSpeedIsTheFrictionOfDriveAndRollers) {
  const RobotParameters robot = measured_robot();
  const NoSlipModel model(robot);
  constexpr double V = 0.1;
  const double dphi = V / robot.R, dgamma = V / ((robot.R - robot.R_d) * std::sqrt(0.5));
  const double drive = 0.18 * dphi / std::hypot(0.02, dphi) + 0.01 * dphi;
  const double roller = 0.073 * dgamma / std::hypot(2, dgamma) + 0.0025 * dgamma;
  const Wheels ahead = model.torque({V, 0, 0}, Eigen::Vector3d::Zero());
  const Wheels sideways = model.torque({0, V, 0}, Eigen::Vector3d::Zero());
  EXPECT_LT((ahead - drive).abs().maxCoeff(), 1e-12);
  EXPECT_LT((sideways.abs() - (drive + dgamma / dphi * roller)).abs().maxCoeff(), 1e-12);
  EXPECT_LT(model.acceleration({0, V, 0}, sideways).norm(), 1e-12);
}

TEST(DryNoSlipModel, ReferenceTorqueIsThatOfTheMotion) {
  const RobotParameters robot = dry_robot();
  const ReferenceMotion motion{10, {0.1, 0.3, 0}, {0, 0, 0.4}, {0.2, 0, 0.1}};
  const ReferenceTorque torque(robot, motion);
  const NoSlipModel model(robot);
  for (const double t : {0.3, 2.1, 7.7}) {
    const Eigen::Vector3d dv = model.acceleration(motion.velocity(t), torque.value(t));
    EXPECT_LT((dv - motion.acceleration(t)).norm(), 1e-12) << t;
  }
}

}  // namespace
}  // namespace youbot_base_sim
