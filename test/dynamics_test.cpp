// Equations of motion of models 2a and 2b, their Jacobian and the solver for it.

#include <gtest/gtest.h>

#include <complex>
#include <type_traits>

#include "golden_rhs.h"
#include "random_states.h"
#include "youbot_base_sim/drive/torque_programmes.h"
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
    const Wheels roller_angle = Wheels{-2, 0, 1, 7} * model.geometry().pitch();
    const State state = random_state(random, robot, roller_angle, floor.nu * std::pow(10, trial % 6 - 3));
    const Wheels M = random.wheels(-3, 3);
    State derivative;
    model.derivative(state, roller_angle, M, derivative);
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
    const Contacts contacts = model.contacts(state, roller_angle);
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
        roller_angle(Wheels{-3, -1, 0, 5} * model.geometry().pitch()),
        state(random_state(random, robot, roller_angle, slip)),
        torque({TorquePiece{0, random.wheels(-1, 1), random.wheels(-1, 1), random.wheels(-1, 1), 0.7}}),
        system(model, torque, state) {
    torque.enter(kTime);
  }
  static constexpr double kTime = 0.3;  // s
  double scale() const { return std::max(floor.nu, slip); }

  Random random;
  RobotParameters robot;
  FloorParameters floor;
  double slip;
  SlipModel<Law> model;
  Wheels roller_angle;
  State state;
  PiecewiseTorque torque;
  SlipSystem<Law> system;
};
constexpr double kSlipsByNu[] = {1e-3, 0.1, 1, 10, 1e3};

TYPED_TEST(SlipModelTest, JacobianIsThatOfTheRightHandSide) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      Motion<TypeParam> motion(seed, slip_by_nu);
      const Matrix24 J = jacobian_by_differences(motion.system, motion.state, motion.kTime, motion.scale());
      typename SlipSystem<TypeParam>::Linearization linearization;
      State dfdt;
      motion.system.linearize(motion.state, motion.kTime, linearization, dfdt);
      // For large alpha, (alpha I - J_s)^-1 (alpha I - J) e_j - e_j is column j of (J_s - J) / alpha, to 1 %: every
      // entry of the Jacobian J_s that the solver stands for shows.
      const double alpha = 100 * J.diagonal().cwiseAbs().maxCoeff();
      linearization.factorize(alpha);
      const Vector24 slip = slip_by_entry();
      const Vector24 row_scale = (J * slip.cwiseInverse().asDiagonal()).cwiseAbs().rowwise().maxCoeff();
      for (int j = 0; j < 24; ++j) {
        if (j == kUnused) continue;
        State u;
        linearization.solve(unflat(alpha * Vector24::Unit(j) - J.col(j)), u);
        const Vector24 error = alpha * (flat(u) - Vector24::Unit(j));
        for (int i = 0; i < 24; ++i) {
          // 1e-9 of the largest effect that an entry can have on this row, the accuracy of the differences; and alpha's
          // rounding, a few times over by the mass matrix.
          ASSERT_LT(std::abs(error[i]), 1e-9 * row_scale[i] * slip[j] + 2e-15 * alpha)
              << "row " << i << ", column " << j << ", entry " << J(i, j) << ", slip / nu = " << slip_by_nu;
        }
      }
    }
  }
}

TYPED_TEST(SlipModelTest, SolverSolvesForEveryStepSize) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      Motion<TypeParam> motion(100 + seed, slip_by_nu);
      const Matrix24 J = jacobian_by_differences(motion.system, motion.state, motion.kTime, motion.scale());
      typename SlipSystem<TypeParam>::Linearization linearization;
      State dfdt;
      motion.system.linearize(motion.state, motion.kTime, linearization, dfdt);
      for (const double alpha : {1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9}) {
        // A right-hand side whose solution moves every contact by as much as any entry can.
        Vector24 wanted;
        for (int j = 0; j < 24; ++j) wanted[j] = motion.random.uniform(-1, 1) / slip_by_entry()[j];
        wanted[kUnused] = 0;
        const Matrix24 A = alpha * Matrix24::Identity() - J;
        const Vector24 b = A * wanted;
        linearization.factorize(alpha);
        State u;
        linearization.solve(unflat(b), u);
        // Row by row the equations hold to the accuracy of the differences in J.
        const Vector24 terms = A.cwiseAbs() * wanted.cwiseAbs();
        const Vector24 residual = (A * flat(u) - b).cwiseAbs();
        EXPECT_TRUE((residual.array() <= 1e-9 * terms.array()).all())
            << "alpha = " << alpha << ", slip / nu = " << slip_by_nu;
        // And so the solution is that of dense elimination, to what slow motions make of it for the smallest alpha:
        // friction is a thousand times as strong as inertia there.
        const Vector24 error = (flat(u) - A.partialPivLu().solve(b)).cwiseProduct(slip_by_entry());
        EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-9 * std::max(1.0, 1e4 / alpha))
            << "alpha = " << alpha << ", slip / nu = " << slip_by_nu;
      }
    }
  }
}

TYPED_TEST(SlipModelTest, TimeDerivativeIsThatOfTheRightHandSide) {
  Motion<TypeParam> motion(200, 0.5);
  typename SlipSystem<TypeParam>::Linearization linearization;
  State dfdt;
  motion.system.linearize(motion.state, motion.kTime, linearization, dfdt);
  const auto in_time = [&](double h) -> Vector24 {
    State dxdt;
    motion.system(motion.state, dxdt, motion.kTime + h);
    return flat(dxdt);
  };
  // Torques of 1 N m on 6e-3 kg m^2 at w = 9 rad/s: (1e-3 s)^4 w^5 / 30 x 170 rad/s^2 = 4e-7; friction is the same at
  // all times and drops out.
  const Vector24 error = difference(in_time, 1e-3) - flat(dfdt);
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_GT(dfdt.dphi().abs().minCoeff(), 10);
}

}  // namespace
}  // namespace youbot_base_sim
