// Equations of motion of models 2a and 2b (test/data/reference/golden_rhs.json), and the derivatives of their forces.

#include <gtest/gtest.h>

#include <complex>
#include <fstream>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "random_states.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/physics/model.h"

namespace youbot_base_sim {
namespace {

using Vector24 = Eigen::Matrix<double, 24, 1>;

// Entries of State::values, column by column.
Vector24 flat(const State& state) { return Eigen::Map<const Vector24>(state.values.data()); }

Wheels wheels(const nlohmann::json& numbers, std::size_t first = 0) {
  const auto values = numbers.get<std::vector<double>>();
  return Eigen::Map<const Wheels>(values.data() + first);
}

template <class Model>
class SlipModelTest : public testing::Test {};
using Laws = testing::Types<PaperModel<ViscousLaw>, PaperModel<CoulombLaw>>;
TYPED_TEST_SUITE(SlipModelTest, Laws, );

TYPED_TEST(SlipModelTest, AgreesWithAnIndependentSolver) {
  const RobotParameters robot;
  const FloorParameters floor;
  const TypeParam model(robot, floor);
  int cases = 0;
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/reference/golden_rhs.json");
  for (const nlohmann::json& golden : nlohmann::json::parse(file)) {
    const bool coulomb = std::is_same<TypeParam, PaperModel<CoulombLaw>>::value;
    if (golden["model"] != (coulomb ? "coulomb" : "viscous")) continue;
    SCOPED_TRACE(++cases);
    State state;
    state.values.col(1).head<3>() = wheels(golden["velocities"]).head<3>();
    state.phi() = wheels(golden["phi_tilde"]);
    state.dphi() = wheels(golden["velocities"], 3);
    state.dgamma() = wheels(golden["velocities"], 7);
    const Wheels M = wheels(golden["torques"]);
    const Contacts contacts = contacts_of(model, state.velocities(), state.phi());
    State derivative;
    model.derivative(state, contacts, M, derivative);

    // The slip is a difference of speeds of about 1 m/s: known to a few units in their last place, which the contact
    // turns into a force by up to f N / nu, and the smallest inertia that it acts on into an acceleration.
    const double V_rounding = 2e-15;
    const Wheels F_X = wheels(golden["F_X"]), F_Y = wheels(golden["F_Y"]);
    const double F_rounding = 1.5 * floor.mu_0(robot)[0] * V_rounding + 1e-14 * F_X.abs().max(F_Y.abs()).maxCoeff();
    EXPECT_LT((contacts.V_PX - wheels(golden["V_PX"])).abs().maxCoeff(), V_rounding);
    EXPECT_LT((contacts.V_PY - wheels(golden["V_PY"])).abs().maxCoeff(), V_rounding);
    EXPECT_LT((contacts.F_X - F_X).abs().maxCoeff(), F_rounding);
    EXPECT_LT((contacts.F_Y - F_Y).abs().maxCoeff(), F_rounding);
    const Eigen::Vector3d dv = wheels(golden["accelerations"]).head<3>();
    EXPECT_LT((derivative.velocity() - dv).norm(), 4 * F_rounding * 0.4 / robot.I_s);
    EXPECT_LT((derivative.dphi() - wheels(golden["accelerations"], 3)).abs().maxCoeff(),
              F_rounding * robot.R / robot.J_1);
    EXPECT_LT((derivative.dgamma() - wheels(golden["accelerations"], 7)).abs().maxCoeff(),
              F_rounding * (robot.R - robot.R_d) / robot.J_2);
  }
  EXPECT_EQ(cases, 6);
}

TYPED_TEST(SlipModelTest, CoordinatesFollowTheVelocities) {
  Random random(11);
  const RobotParameters robot = random_robot(random);
  const TypeParam model(robot, {});
  const State state = random_state(random, robot, Wheels::Zero(), 1e-3);
  State derivative;
  model.derivative(state, contacts_of(model, state.velocities(), state.phi()), Wheels::Zero(), derivative);
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
    const TypeParam model(robot, floor);
    const Wheels phi_center = Wheels{-2, 0, 1, 7} * model.geometry().pitch();
    const State state = random_state(random, robot, phi_center, floor.nu * std::pow(10, trial % 6 - 3));
    const Wheels M = random.wheels(-3, 3);
    const Contacts contacts = contacts_of(model, state.velocities(), state.phi() - phi_center);
    State derivative;
    model.derivative(state, contacts, M, derivative);
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
    result(dphi, dgamma) = G.dphi_dgamma[i];
    result(dgamma, dphi) = G.dgamma_dphi[i];
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

// Compares the damping of the system with differences of its forces by the velocities, over steps that change the slip
// by 2e-3 of the scale of the friction law (nu, or the slip where that is larger). Error of the law's slope: (2e-3)^4,
// and 1e-16 m/s of rounding over 2e-6 m/s: 1e-10 of it. Wheel `shared`, if there is one, rests on two rollers: its dphi
// is zero, so that what the forces would be off it is of no consequence, and it accelerates by nothing.
template <class Model>
void expect_damping_is_the_slope_of_the_forces(const SlipSystem<Model>& system, const State& state, double t,
                                               double scale, int shared = -1) {
  const Velocities u = state.velocities();
  const auto contacts = system.contacts(state, t);
  DampingMatrix damping;
  const auto stiffness = system.model().stiffness(contacts, system.model().friction(contacts));
  system.damping(u, contacts, stiffness, system.torque().value(t), damping);
  Matrix11 expected = -dense(damping), slope = Matrix11::Zero();
  const PlatformMatrix C = system.model().inertia().coriolis_derivative(u.v);
  for (int k = 0; k < 3; ++k) expected.topLeftCorner<3, 3>().col(k) += C[k].template head<3>().matrix();
  const Vector11 slip = slip_by_velocity();
  for (int j = 0; j < 11; ++j) {
    const auto along_j = [&](double h) -> Vector11 {
      Velocities moved = u;
      (j < 3 ? moved.v[j] : j < 7 ? moved.dphi[j - 3] : moved.dgamma[j - 7]) += h;
      State there = state, dxdt;
      there.set(moved);
      system(there, dxdt, t);
      return flat(system.model().inertia() * dxdt.velocities());
    };
    slope.col(j) = difference(along_j, 2e-3 * scale / slip[j]);
  }
  if (shared >= 0) {  // nothing, but for rounding
    slope.row(3 + shared).setZero();
    slope.col(3 + shared) = expected.col(3 + shared);
  }
  const Vector11 row_scale = (slope * slip.cwiseInverse().asDiagonal()).cwiseAbs().rowwise().maxCoeff();
  // 1e-9 of the largest effect that an entry can have on this row, the accuracy of the differences; shares are
  // quotients of differences of forces.
  const Matrix11 allowed = (shared < 0 ? 1e-9 : 1e-8) * row_scale * slip.transpose();
  EXPECT_TRUE(((expected - slope).cwiseAbs().array() <= allowed.array()).all()) << expected - slope;
}

// A random robot in motion at a slip that is given as a multiple of nu, its wheels on various rollers.
template <class Model>
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
  Model model;
  Wheels phi_center;
  State state;
  PiecewiseTorque torque;
  SlipSystem<Model> system;
};
constexpr double kSlipsByNu[] = {1e-3, 0.1, 1, 10, 1e3};

TYPED_TEST(SlipModelTest, DampingIsTheSlopeOfTheForces) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      Motion<TypeParam> motion(seed, slip_by_nu);
      expect_damping_is_the_slope_of_the_forces(motion.system, motion.state, motion.kTime, motion.scale());
    }
  }
}

TYPED_TEST(SlipModelTest, DampingKnowsAveragedContacts) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    for (const double slip_by_nu : kSlipsByNu) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      Motion<TypeParam> motion(100 + seed, slip_by_nu);
      motion.system.modes().enter_averaging(static_cast<int>(seed % 4));
      if (seed == 4) motion.system.modes().enter_averaging(2);
      expect_damping_is_the_slope_of_the_forces(motion.system, motion.state, motion.kTime, motion.scale());
    }
  }
}

// Wheel i stands on the edge between two rollers, which slip about `slip_by_nu` nu to either side, with a torque such
// that the upper one has a share of 0.3 at kTime.
template <class Model>
struct SharedMotion {
  SharedMotion(unsigned seed, double slip_by_nu, int i)
      : motion(seed, slip_by_nu), state(motion.state), lower(motion.system.modes().roller(i)) {
    const double slip = motion.slip;
    state.phi()[i] = motion.model.geometry().upper_edge(lower);
    const double Delta_Y = motion.model.geometry().at(Wheels::Constant(kPi / motion.robot.rollers)).Delta_Y[i];
    state.Omega() = -slip / Delta_Y;
    state.V_X() = motion.robot.rho_Y()[i] * state.Omega() + 0.1 * slip;
    state.V_Y() = 0.2 * slip - motion.robot.rho_X()[i] * state.Omega();
    state.dphi() = (state.V_X() - motion.robot.rho_Y() * state.Omega() - 0.7 * slip) / motion.robot.R;
    state.dgamma() = motion.random.wheels(-10, 10) * slip;
    state.dphi()[i] = 0;
    const auto friction = [&](double phi_tilde) {
      return contacts_of(motion.model, state.velocities(), Wheels::Constant(phi_tilde)).F_X[i];
    };
    const double edge = kPi / motion.robot.rollers;
    TorqueSegment segment{0, motion.random.wheels(-1, 1), motion.random.wheels(-1, 1), motion.random.wheels(-1, 1),
                          0.7};
    const auto value = [&] {
      torque = PiecewiseTorque({segment});
      torque.begin_segment(motion.kTime);
      return torque.value(motion.kTime)[i];
    };
    segment.constant[i] += motion.robot.R * (0.3 * friction(-edge) + 0.7 * friction(edge)) - value();
    value();
  }
  SlipSystem<Model> system() const { return {motion.model, torque, state}; }

  Motion<Model> motion;
  State state;
  std::int64_t lower;
  PiecewiseTorque torque{{}};
};

// The shares change with the velocities.
TYPED_TEST(SlipModelTest, DampingKnowsSharedContacts) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    for (const double slip_by_nu : {0.1, 1.0, 10.0, 1e3}) {  // the shares change on the scale of the slip
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      const int i = static_cast<int>(seed % 4);
      SharedMotion<TypeParam> shared(200 + seed, slip_by_nu, i);
      SlipSystem<TypeParam> system = shared.system();
      system.enter_sliding(i, shared.lower, shared.state, 0);
      expect_damping_is_the_slope_of_the_forces(system, shared.state, shared.motion.kTime, shared.motion.slip, i);
    }
  }
}

// Filippov's definition: the motion on the edge is the convex combination of those on either side of it for which the
// wheel stays there.
TYPED_TEST(SlipModelTest, SharedContactIsTheConvexCombinationThatKeepsTheWheelOnItsEdge) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    for (const double slip_by_nu : {0.1, 1.0, 10.0}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      const int i = static_cast<int>(seed % 4);
      const double t = 0.3;
      SharedMotion<TypeParam> shared(500 + seed, slip_by_nu, i);
      State x = shared.state;
      SlipSystem<TypeParam> lower = shared.system(), upper = shared.system(), both = shared.system();
      lower.modes().set_roller(i, shared.lower);
      upper.modes().set_roller(i, shared.lower + 1);
      const bool attractive = lower.sharing(i, x, t).attractive;
      both.enter_sliding(i, shared.lower, x, 0);
      EXPECT_TRUE((x.values == shared.state.values).all());  // there was no momentum to give up
      State on_lower, on_upper, dxdt;
      lower(x, on_lower, t);
      upper(x, on_upper, t);
      both(x, dxdt, t);
      const double below = on_lower.dphi()[i], above = on_upper.dphi()[i];
      const double alpha = below / (below - above);
      EXPECT_NEAR(alpha, 0.3, 1e-9);  // by the choice of the torque
      EXPECT_NEAR(both.sharing(i, x, t).alpha, alpha, 1e-9);
      EXPECT_EQ(attractive, below > 0 && above < 0);
      const Vector24 wanted = alpha * flat(on_upper) + (1 - alpha) * flat(on_lower);
      const Vector24 size = flat(on_upper).cwiseAbs() + flat(on_lower).cwiseAbs();
      // What rounds is the slip, a difference of speeds of up to 1 m/s over a scale of 1e-4 m/s.
      EXPECT_TRUE(((flat(dxdt) - wanted).cwiseAbs().array() <= 1e-11 * size.array() + 1e-15).all())
          << (flat(dxdt) - wanted).transpose();
      EXPECT_NEAR(dxdt.dphi()[i], 0, 1e-11 * size[State::kDphi + i]);
    }
  }
}

// Also where contacts are averaged, or shared: the drives' power and what bearings and each contact's friction take
// make up the change of the energy. Wheel i is held on an edge; its friction works on both rollers by their shares.
TYPED_TEST(SlipModelTest, PowerBalanceIsExactWithMixedContacts) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const double slip_by_nu : {0.1, 1.0, 10.0, 1e3}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      const int i = static_cast<int>(seed % 4);
      SharedMotion<TypeParam> shared(600 + seed, slip_by_nu, i);
      const double t = shared.motion.kTime;
      SlipSystem<TypeParam> system = shared.system();
      State x = shared.state, dxdt;
      system.enter_sliding(i, shared.lower, x, 0);
      system.modes().enter_averaging((i + 1) % kWheels);
      system(x, dxdt, t);
      const RobotParameters& robot = shared.motion.robot;
      const Velocities u = x.velocities();
      const Wheels M = shared.torque.value(t);
      const auto friction_power = [&](const Contacts& c) -> Wheels { return c.F_X * c.V_PX + c.F_Y * c.V_PY; };
      const Contacts c = system.contacts(u, x.phi(), x.pose(), M);
      Wheels friction = friction_power(c);
      const double edge = kPi / robot.rollers, alpha = system.sharing(i, x, t).alpha;
      friction[i] = alpha * friction_power(contacts_of(shared.motion.model, u, Wheels::Constant(-edge)))[i] +
                    (1 - alpha) * friction_power(contacts_of(shared.motion.model, u, Wheels::Constant(edge)))[i];
      const Wheels power = M * u.dphi - robot.mu_1 * u.dphi.square() - robot.mu_2 * u.dgamma.square() + friction;
      // What rounds is the power that passes through each wheel and contact, at speeds of up to 1 m/s; of a held wheel,
      // through either roller.
      const double passing = ((M.abs() + robot.mu_1 * u.dphi.abs()) * u.dphi.abs() + robot.mu_2 * u.dgamma.square() +
                              c.F_X.abs() + c.F_Y.abs() + friction.abs())
                                 .sum() +
                             2 * (1 + std::abs(alpha)) * (std::abs(M[i]) / robot.R + std::abs(friction[i]));
      EXPECT_NEAR(dxdt.work(), power.sum(), 1e-14 * passing);
      EXPECT_NEAR(dxdt.work(), dot(u, system.model().inertia() * dxdt.velocities()), 1e-14 * passing);
    }
  }
}

// A shared and an averaged contact on one robot, as a wheel that spins freely beside one that is held.
TYPED_TEST(SlipModelTest, DampingKnowsSharedBesideAveragedContacts) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    for (const double slip_by_nu : {0.1, 1.0, 10.0, 1e3}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", slip / nu = " << slip_by_nu);
      const int i = static_cast<int>(seed % 4);
      SharedMotion<TypeParam> shared(700 + seed, slip_by_nu, i);
      SlipSystem<TypeParam> system = shared.system();
      system.enter_sliding(i, shared.lower, shared.state, 0);
      system.modes().enter_averaging((i + 1 + static_cast<int>(seed / 4)) % kWheels);
      expect_damping_is_the_slope_of_the_forces(system, shared.state, shared.motion.kTime, shared.motion.slip, i);
    }
  }
}

TYPED_TEST(SlipModelTest, ForcesAreInertiaTimesAccelerations) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Motion<TypeParam> motion(400 + seed, 1);
    const Velocities u = motion.state.velocities();
    const Contacts contacts = contacts_of(motion.model, u, motion.state.phi() - motion.phi_center);
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
    EXPECT_EQ(dot(u, motion.model.forces(u, contacts, M)), derivative.work());
  }
}

}  // namespace
}  // namespace youbot_base_sim
