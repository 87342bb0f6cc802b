// Equations of motion of models 2a and 2b, and their derivatives.

#include <gtest/gtest.h>

#include <complex>
#include <type_traits>

#include "golden_rhs.h"
#include "random_states.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {
namespace {

using Vector24 = Eigen::Matrix<double, 24, 1>;
using Matrix24 = Eigen::Matrix<double, 24, 24>;

// Entries of State::values, column by column.
Vector24 flat(const State& state) { return Eigen::Map<const Vector24>(state.values.data()); }
State unflat(const Vector24& vector) {
  State state;
  Eigen::Map<Vector24>(state.values.data()) = vector;
  return state;
}
constexpr int kUnused = 7;  // row 3 of the velocities' column

Wheels wheels(const double* values) { return Eigen::Map<const Wheels>(values); }

template <class Law>
class SlipModelTest : public testing::Test {};
using Laws = testing::Types<ViscousLaw, CoulombLaw>;
TYPED_TEST_SUITE(SlipModelTest, Laws, );

TYPED_TEST(SlipModelTest, AgreesWithAnIndependentSolver) {
  const RobotParameters robot;
  const FloorParameters floor;
  const SlipModel<TypeParam> model(robot, floor);
  int cases = 0;
  for (const GoldenCase& golden : kGoldenCases) {
    if (golden.coulomb != std::is_same<TypeParam, CoulombLaw>::value) continue;
    SCOPED_TRACE(++cases);
    State state;
    state.values.col(1).head<3>() = Eigen::Map<const Eigen::Array3d>(golden.velocities);
    state.phi() = wheels(golden.phi_tilde);
    state.dphi() = wheels(golden.velocities + 3);
    state.dgamma() = wheels(golden.velocities + 7);
    const Wheels M = wheels(golden.torques);
    State derivative;
    model.derivative(state, Wheels::Zero(), M, derivative);
    const Contacts contacts = model.contacts(state, Wheels::Zero());

    // The slip is a difference of speeds of about 1 m/s: known to a few units in their last place, which the contact
    // turns into a force by up to f N / nu, and the smallest inertia that it acts on into an acceleration.
    const double V_rounding = 2e-15;
    const Wheels F_X = wheels(golden.F_X), F_Y = wheels(golden.F_Y);
    const double F_rounding = 1.5 * floor.mu_0(robot) * V_rounding + 1e-14 * F_X.abs().max(F_Y.abs()).maxCoeff();
    EXPECT_LT((contacts.V_PX - wheels(golden.V_PX)).abs().maxCoeff(), V_rounding);
    EXPECT_LT((contacts.V_PY - wheels(golden.V_PY)).abs().maxCoeff(), V_rounding);
    EXPECT_LT((contacts.F_X - F_X).abs().maxCoeff(), F_rounding);
    EXPECT_LT((contacts.F_Y - F_Y).abs().maxCoeff(), F_rounding);
    const Eigen::Vector3d dv = Eigen::Map<const Eigen::Vector3d>(golden.accelerations);
    EXPECT_LT((derivative.velocity() - dv).norm(), 4 * F_rounding * 0.4 / robot.I_s);
    EXPECT_LT((derivative.dphi() - wheels(golden.accelerations + 3)).abs().maxCoeff(),
              F_rounding * robot.R / robot.J_1);
    EXPECT_LT((derivative.dgamma() - wheels(golden.accelerations + 7)).abs().maxCoeff(),
              F_rounding * (robot.R - robot.R_d) / robot.J_2);
  }
  EXPECT_EQ(cases, 6);
}

TYPED_TEST(SlipModelTest, CoordinatesFollowTheVelocities) {
  Random random(11);
  const RobotParameters robot = random_robot(random);
  const SlipModel<TypeParam> model(robot, {});
  const State state = random_state(random, robot, Wheels::Zero(), 1e-3);
  State derivative;
  model.derivative(state, Wheels::Zero(), Wheels::Zero(), derivative);
  const std::complex<double> velocity =
      std::complex<double>(state.V_X(), state.V_Y()) * std::polar(1.0, state.psi());  // (3.1)
  EXPECT_NEAR(derivative.x(), velocity.real(), 1e-15);
  EXPECT_NEAR(derivative.y(), velocity.imag(), 1e-15);
  EXPECT_EQ(derivative.psi(), state.Omega());
  EXPECT_TRUE((derivative.phi() == state.dphi()).all());
  EXPECT_TRUE((derivative.gamma() == state.dgamma()).all());
  EXPECT_EQ(derivative.values(3, 1), 0);
}

// Kinetic energy as the sum over bodies: the body about C, wheels about C_i, and what is left of I_s as pure rotation.
double energy_of_bodies(const RobotParameters& robot, const State& state) {
  const auto square_of_speed_at = [&](double X, double Y) {
    return std::norm(std::complex<double>(state.V_X() - state.Omega() * Y, state.V_Y() + state.Omega() * X));
  };
  double twice = robot.m * square_of_speed_at(robot.a_X, robot.a_Y);
  double rotational = robot.I_s - robot.m * (robot.a_X * robot.a_X + robot.a_Y * robot.a_Y);
  for (const double X : {robot.h, -robot.h}) {
    for (const double Y : {robot.l, -robot.l}) {
      twice += robot.m_1 * square_of_speed_at(X, Y);
      rotational -= robot.m_1 * (X * X + Y * Y);
    }
  }
  return 0.5 * (twice + rotational * state.Omega() * state.Omega() + robot.J_1 * state.dphi().square().sum() +
                robot.J_2 * state.dgamma().square().sum());
}

TEST(KineticEnergy, IsThatOfTheBodies) {
  Random random(12);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotParameters robot = random_robot(random);
    const State state = random_state(random, robot, Wheels::Zero(), 0.1);
    const double energy = energy_of_bodies(robot, state);
    EXPECT_NEAR(kinetic_energy(robot, state), energy, 1e-14 * energy);  // rounding of a dozen terms
  }
}

TYPED_TEST(SlipModelTest, PowerBalanceIsExact) {
  Random random(13);
  for (int trial = 0; trial < 60; ++trial) {
    const RobotParameters robot = random_robot(random);
    const FloorParameters floor;
    const SlipModel<TypeParam> model(robot, floor);
    const Wheels phi_center = Wheels{-2, 0, 1, 7} * model.geometry().pitch();
    const State state = random_state(random, robot, phi_center, floor.nu * std::pow(10, trial % 6 - 3));
    const Wheels M = random.wheels(-3, 3);
    State derivative;
    model.derivative(state, phi_center, M, derivative);
    // The energy is quadratic in the velocities: its slope is a difference over any length, exactly. One as long as
    // the velocities themselves loses the fewest digits.
    State change = derivative;
    change.values.col(0).setZero();
    change.values.col(2).setZero();
    const double length = std::sqrt(energy_of_bodies(robot, state) / energy_of_bodies(robot, change));
    State ahead = state, behind = state;
    ahead.values += length * change.values;
    behind.values -= length * change.values;
    const double rate = (energy_of_bodies(robot, ahead) - energy_of_bodies(robot, behind)) / (2 * length);
    // Forces in equilibrium cancel: what rounds is the power that passes through each wheel and contact.
    const Contacts contacts = model.contacts(state, phi_center);
    const double passing = ((M.abs() + robot.mu_1 * state.dphi().abs()) * state.dphi().abs() +
                            robot.mu_2 * state.dgamma().square() + contacts.F_X.abs() + contacts.F_Y.abs())
                               .sum() +
                           energy_of_bodies(robot, state) / length;
    EXPECT_NEAR(derivative.work(), rate, 1e-14 * passing);
    // And its terms, one by one.
    const Wheels power = M * state.dphi() - robot.mu_1 * state.dphi().square() - robot.mu_2 * state.dgamma().square() +
                         contacts.F_X * contacts.V_PX + contacts.F_Y * contacts.V_PY;
    EXPECT_NEAR(derivative.work(), power.sum(), 1e-14 * passing);
  }
}

// Slip speed that a unit of each entry of the state brings about, in round figures; 1 for what brings about none.
Vector24 slip_by_entry() {
  State slip;
  slip.values << 1, 1, 3, 0.05, 0.015, 1,  //
      1, 1, 3, 0.05, 0.015, 1,             //
      1, 0.4, 3, 0.05, 0.015, 1,           //
      1, 1, 3, 0.05, 0.015, 1;
  return flat(slip);
}

// Jacobian by differences, of steps that change the slip by 2e-3 of the scale of the friction law (nu, or the slip
// where that is larger). Error of the law's slope: (2e-3)^4, and 1e-16 m/s of rounding over 2e-6 m/s: 1e-10 of it.
template <class Law>
Matrix24 jacobian_by_differences(const SlipSystem<Law>& system, const State& state, double t, double scale) {
  const Vector24 slip = slip_by_entry();
  Matrix24 J;
  for (int j = 0; j < 24; ++j) {
    const auto along_j = [&](double h) -> Vector24 {
      State dxdt;
      system(unflat(flat(state) + h * Vector24::Unit(j)), dxdt, t);
      return flat(dxdt);
    };
    J.col(j) = difference(along_j, 2e-3 * scale / slip[j]);
  }
  return J;
}

// A random robot in motion at a slip that is given as a multiple of nu, its wheels on various rollers.
template <class Law>
struct Motion {
  Motion(unsigned seed, double slip_by_nu)
      : random(seed),
        robot(random_robot(random)),
        slip(slip_by_nu * floor.nu),
        model(robot, floor),
        phi_center(Wheels{-3, -1, 0, 5} * model.geometry().pitch()),
        state(random_state(random, robot, phi_center, slip)),
        torque({TorqueSegment{0, random.wheels(-1, 1), random.wheels(-1, 1), random.wheels(-1, 1), 0.7}}),
        system(model, torque, state) {
    torque.begin_segment(kTime);
  }
  static constexpr double kTime = 0.3;  // s
  double scale() const { return std::max(floor.nu, slip); }

  Random random;
  RobotParameters robot;
  FloorParameters floor;
  double slip;
  SlipModel<Law> model;
  Wheels phi_center;
  State state;
  PiecewiseTorque torque;
  SlipSystem<Law> system;
};
constexpr double kSlipsByNu[] = {1e-3, 0.1, 1, 10, 1e3};

// The blocks in their places.
Matrix24 dense(const BorderedJacobian& blocks, const Inertia& inertia) {
  constexpr int kPsi = 2, kWork = 3, kV = 4, kOmega = 6, kPhi = 8, kDphi = 12, kDgamma = 16, kGamma = 20;
  Matrix24 J = Matrix24::Zero();
  J(0, kPsi) = -blocks.V_y;
  J(1, kPsi) = blocks.V_x;
  J.block<2, 2>(0, kV) << blocks.cos_psi, -blocks.sin_psi, blocks.sin_psi, blocks.cos_psi;
  J(kPsi, kOmega) = 1;
  J.block<1, 3>(kWork, kV) = blocks.power_v.transpose();
  J.block<3, 3>(kV, kV) = blocks.Q_v;
  for (int i = 0; i < kWheels; ++i) {
    J(kWork, kPhi + i) = blocks.power_phi[i];
    J(kWork, kDphi + i) = blocks.power_dphi[i];
    J(kWork, kDgamma + i) = blocks.power_dgamma[i];
    for (int k = 0; k < 3; ++k) {
      J(kV + k, kPhi + i) = blocks.Q_phi[k][i];
      J(kV + k, kDphi + i) = J(kDphi + i, kV + k) = blocks.Q_dphi[k][i];
      J(kV + k, kDgamma + i) = J(kDgamma + i, kV + k) = blocks.Q_dgamma[k][i];
    }
    J(kPhi + i, kDphi + i) = J(kGamma + i, kDgamma + i) = 1;
    J(kDphi + i, kPhi + i) = blocks.dphi_phi[i];
    J(kDphi + i, kDphi + i) = blocks.dphi_dphi[i];
    J(kDphi + i, kDgamma + i) = J(kDgamma + i, kDphi + i) = blocks.dphi_dgamma[i];
    J(kDgamma + i, kPhi + i) = blocks.dgamma_phi[i];
    J(kDgamma + i, kDgamma + i) = blocks.dgamma_dgamma[i];
  }
  J.middleRows<3>(kV) = (inertia.M_v_inverse * J.middleRows<3>(kV)).eval();
  J.middleRows<4>(kDphi) /= inertia.J_1;
  J.middleRows<4>(kDgamma) /= inertia.J_2;
  return J;
}

TYPED_TEST(SlipModelTest, JacobianIsThatOfTheRightHandSide) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      Motion<TypeParam> motion(seed, slip_by_nu);
      const Matrix24 J = jacobian_by_differences(motion.system, motion.state, motion.kTime, motion.scale());
      BorderedJacobian blocks;
      motion.model.linearize(motion.state, motion.phi_center, motion.torque.value(motion.kTime), blocks);
      const Matrix24 error = (dense(blocks, motion.model.inertia()) - J).cwiseAbs();
      const Vector24 slip = slip_by_entry();
      const Vector24 row_scale = (J * slip.cwiseInverse().asDiagonal()).cwiseAbs().rowwise().maxCoeff();
      for (int j = 0; j < 24; ++j) {
        if (j == kUnused) continue;
        for (int i = 0; i < 24; ++i) {
          // 1e-9 of the largest effect that an entry can have on this row, the accuracy of the differences.
          ASSERT_LE(error(i, j), 1e-9 * row_scale[i] * slip[j])
              << "row " << i << ", column " << j << ", entry " << J(i, j) << ", slip / nu = " << slip_by_nu;
        }
      }
    }
  }
}

using Vector11 = Eigen::Matrix<double, 11, 1>;
using Matrix11 = Eigen::Matrix<double, 11, 11>;

// The platform's velocities, those of the wheels, those of the rollers.
Vector11 flat(const Velocities& u) {
  Vector11 vector;
  vector << u.v.head<3>(), u.dphi, u.dgamma;
  return vector;
}

Matrix11 dense(const DampingMatrix& G) {
  Matrix11 result = Matrix11::Zero();
  for (int i = 0; i < kWheels; ++i) {
    const int dphi = 3 + i, dgamma = 7 + i;
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) result(k, l) += G.platform_platform[k][l][i];
      result(k, dphi) = G.platform_dphi[k][i];
      result(k, dgamma) = G.platform_dgamma[k][i];
      result(dphi, k) = G.dphi_platform[k][i];
      result(dgamma, k) = G.dgamma_platform[k][i];
    }
    result(dphi, dphi) = G.dphi_dphi[i];
    result(dphi, dgamma) = result(dgamma, dphi) = G.dphi_dgamma[i];
    result(dgamma, dgamma) = G.dgamma_dgamma[i];
  }
  return result;
}

// Slip speed that a unit of each velocity brings about, in round figures.
Vector11 slip_by_velocity() {
  Vector11 slip;
  slip << 1, 1, 0.4, Eigen::Vector4d::Constant(0.05), Eigen::Vector4d::Constant(0.015);
  return slip;
}

TYPED_TEST(SlipModelTest, DampingMatrixIsTheSlopeOfTheForces) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      Motion<TypeParam> motion(300 + seed, slip_by_nu);
      const Velocities u = motion.state.velocities();
      const Wheels phi_tilde = motion.state.phi() - motion.phi_center, M = motion.torque.value(0.1);
      const Vector11 slip = slip_by_velocity();
      Matrix11 slope;
      for (int j = 0; j < 11; ++j) {
        const auto along_j = [&](double h) -> Vector11 {
          Velocities moved = u;
          (j < 3 ? moved.v[j] : j < 7 ? moved.dphi[j - 3] : moved.dgamma[j - 7]) += h;
          return flat(motion.model.forces(moved, motion.model.contacts(moved, phi_tilde), M));
        };
        slope.col(j) = difference(along_j, 2e-3 * motion.scale() / slip[j]);
      }
      DampingMatrix damping;
      motion.model.damping(motion.model.contacts(u, phi_tilde), damping);
      Matrix11 told = -dense(damping);
      const PlatformMatrix C = motion.model.inertia().coriolis_derivative(motion.state.velocities().v);
      for (int k = 0; k < 3; ++k) told.topLeftCorner<3, 3>().col(k) += C[k].head<3>().matrix();
      const Vector11 row_scale = (slope * slip.cwiseInverse().asDiagonal()).cwiseAbs().rowwise().maxCoeff();
      const Matrix11 allowed = 1e-9 * row_scale * slip.transpose();  // as above
      EXPECT_TRUE(((told - slope).cwiseAbs().array() <= allowed.array()).all()) << "slip / nu = " << slip_by_nu << "\n"
                                                                                << told - slope;
    }
  }
}

TYPED_TEST(SlipModelTest, ForcesAreInertiaTimesAccelerations) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Motion<TypeParam> motion(400 + seed, 1);
    const Velocities u = motion.state.velocities();
    const Contacts contacts = motion.model.contacts(u, motion.state.phi() - motion.phi_center);
    const Wheels M = motion.torque.value(motion.kTime);
    State derivative;
    motion.system(motion.state, derivative, motion.kTime);
    // The matrix as the paper has it, (4.5), on the accelerations.
    const RobotParameters& r = motion.robot;
    Matrix11 inertia = Matrix11::Zero();
    inertia.topLeftCorner<3, 3>() << r.m_s(), 0, -r.m * r.a_Y,  //
        0, r.m_s(), r.m * r.a_X,                                //
        -r.m * r.a_Y, r.m * r.a_X, r.I_s;
    inertia.diagonal().segment<4>(3).setConstant(r.J_1);
    inertia.diagonal().tail<4>().setConstant(r.J_2);
    const Vector11 forces = flat(motion.model.forces(u, contacts, M)), a = flat(derivative.velocities());
    EXPECT_LT((inertia * a - forces).cwiseAbs().maxCoeff(), 1e-14 * 4 * r.m_s());
    EXPECT_LT((flat(motion.model.inertia() * derivative.velocities()) - inertia * a).cwiseAbs().maxCoeff(),
              1e-14 * 4 * r.m_s());
    EXPECT_EQ(power(u, motion.model.forces(u, contacts, M)), derivative.work());
  }
}

}  // namespace
}  // namespace youbot_base_sim
