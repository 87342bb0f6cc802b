// Model 1 and the torque profile of section 5.2, against the paper's equations as printed in section 5.1.

#include <gtest/gtest.h>

#include "random_states.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {
namespace {

using Eigen::Vector3d;

Vector3d random_vector(Random& random) { return random.wheels(-1, 1).head<3>().matrix(); }

// A random robot whose four bearings of a kind are alike, as the paper's.
RobotParameters random_paper_robot(Random& random) {
  RobotParameters robot = random_robot(random);
  robot.mu_1 = robot.mu_1[0];
  robot.mu_2 = robot.mu_2[0];
  return robot;
}

TEST(NoSlipModel, RollsWithoutSlip) {
  Random random(21);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const PaperModel<ViscousLaw> slip_model(robot, {});
    const Wheels phi_center = Wheels{0, 1, -4, 2} * slip_model.geometry().pitch();
    State state;
    state.values.col(1).head<3>() = random_vector(random).array();
    state.phi() = phi_center;  // phi~ = 0
    NoSlipModel(robot).constrain(state);
    const Contacts contacts = contacts_of(slip_model, state.velocities(), state.phi() - phi_center);
    // Speeds of 1 m/s cancel.
    EXPECT_LT(contacts.V_PX.abs().maxCoeff(), 2e-15);
    EXPECT_LT(contacts.V_PY.abs().maxCoeff(), 2e-15);
  }
}

TEST(NoSlipModel, ObeysThePapersEquations) {
  Random random(22);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotParameters robot = random_paper_robot(random);
    const double m = robot.m, m_s = m + 4 * robot.m_1, a_X = robot.a_X, a_Y = robot.a_Y, R = robot.R, R_d = robot.R_d;
    const double l = robot.l, h = robot.h, J_1 = robot.J_1, mu_1 = robot.mu_1[0], mu_2 = robot.mu_2[0];
    const double zeta_X = 4 * mu_1 / (R * R);
    const double zeta_Y = 4 * mu_1 / (R * R) + 8 * mu_2 / ((R - R_d) * (R - R_d));
    const double mu_Omega = 4 * mu_1 * (l + h) * (l + h) / (R * R) + 8 * mu_2 * h * h / ((R - R_d) * (R - R_d));

    const Vector3d v = random_vector(random);
    const Wheels M = random.wheels(-3, 3);
    const Vector3d dv = NoSlipModel(robot).acceleration(v, M);
    const double V_X = v[0], V_Y = v[1], Omega = v[2], dV_X = dv[0], dV_Y = dv[1], dOmega = dv[2];
    const double X = (m_s + 4 * J_1 / (R * R)) * dV_X - m_s * Omega * V_Y - m * a_Y * dOmega - m * a_X * Omega * Omega +
                     zeta_X * V_X;
    const double Y = (m_s + 4 * J_1 / (R * R)) * dV_Y + m_s * Omega * V_X + m * a_X * dOmega - m * a_Y * Omega * Omega +
                     zeta_Y * V_Y;
    const double turn = (robot.I_s + 4 * (l + h) * (l + h) / (R * R) * J_1) * dOmega - m * a_Y * (dV_X - Omega * V_Y) +
                        m * a_X * (dV_Y + Omega * V_X) + mu_Omega * Omega;
    // Sums of a dozen terms of up to 1000 N.
    EXPECT_NEAR(X, (M[1] + M[0] + M[3] + M[2]) / R, 1e-12);
    EXPECT_NEAR(Y, (M[1] - M[0] - M[3] + M[2]) / R, 1e-12);
    EXPECT_NEAR(turn, (l + h) / R * (M[1] - M[0] + M[3] - M[2]), 1e-12);
  }
}

// A Swedish wheel by Siegwart and Nourbakhsh, Introduction to Autonomous Mobile Robots, 3.2.3.4.
TEST(NoSlipModel, RatesAreThoseOfThePaperAndOfATextbook) {
  Random random(23);
  for (int trial = 0; trial < 100; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const NoSlipModel model(robot);
    const Vector3d v = random_vector(random);
    for (int i = 0; i < kWheels; ++i) {
      const double rho_X = robot.rho_X()[i], rho_Y = robot.rho_Y()[i], gamma = delta(robot)[i], tan = std::tan(gamma);
      EXPECT_NEAR(model.dphi(v)[i], (v[0] + v[1] * tan + (rho_X * tan - rho_Y) * v[2]) / robot.R, 1e-13);
      EXPECT_NEAR(model.dgamma(v)[i], (v[1] + v[2] * rho_X) / ((robot.R_d - robot.R) * std::cos(gamma)), 1e-13);
      const double L = std::hypot(rho_X, rho_Y), alpha = std::atan2(rho_Y, rho_X), beta = kPi / 2 - alpha;
      const Vector3d J(std::sin(alpha + beta + gamma), -std::cos(alpha + beta + gamma), -L * std::cos(beta + gamma));
      EXPECT_NEAR(model.dphi(v)[i], J.dot(v) / (robot.R * std::cos(gamma)), 1e-12);
    }
    EXPECT_LT((Rolling(robot).velocity(model.dphi(v)) - v).norm(), 1e-12);
  }
}

TEST(NoSlipModel, TorqueInvertsTheMotionWithoutPreload) {
  Random random(24);
  for (int trial = 0; trial < 20; ++trial) {
    RobotParameters robot = random_robot(random);
    robot.roller_angle = random.uniform(20, 70);
    const NoSlipModel model(robot);
    const Vector3d v = random_vector(random), dv = random_vector(random);
    const Wheels M = model.torque(v, dv);
    EXPECT_LT((model.acceleration(v, M) - dv).norm(), 1e-13);  // 10 N m and 40 kg, in and out
    EXPECT_NEAR(M[0] + M[1] - M[2] - M[3], 0, 1e-14 * M.abs().sum());
    // A preload moves nothing: the torques are unique only without it.
    const Wheels preload{1, 1, -1, -1};
    EXPECT_LT((model.acceleration(v, M + preload) - dv).norm(), 1e-13);
  }
}

TEST(NoSlipModel, PowerBalanceIsExact) {
  Random random(26);
  for (int trial = 0; trial < 20; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const NoSlipModel model(robot);
    State state, derivative;
    state.values.col(0) = random.wheels(-2, 2);
    state.values.col(1).head<3>() = random_vector(random).array();
    model.constrain(state);
    const Wheels M = random.wheels(-3, 3);
    model.derivative(state, M, derivative);

    RobotParameters weightless_rollers = robot;
    weightless_rollers.J_2 = 0;
    const double energy = kinetic_energy(weightless_rollers, state);
    EXPECT_NEAR(model.kinetic_energy(state.velocity()), energy, 1e-14 * energy);

    // Quadratic energy: a difference over any length is its slope, to rounding.
    State ahead = state, behind = state;
    ahead.values.col(1) += derivative.values.col(1);
    behind.values.col(1) -= derivative.values.col(1);
    model.constrain(ahead);
    model.constrain(behind);
    const double rate = 0.5 * (kinetic_energy(weightless_rollers, ahead) - kinetic_energy(weightless_rollers, behind));
    const double power =
        (M * state.dphi() - robot.mu_1 * state.dphi().square() - robot.mu_2 * state.dgamma().square()).sum();
    const double rounding = 1e-15 * kinetic_energy(weightless_rollers, ahead);  // of the energies, and of 1000 W
    EXPECT_NEAR(rate, power, 1e-12 + rounding);
    EXPECT_NEAR(derivative.work(), power, 1e-12 + rounding);

    EXPECT_NEAR(derivative.x(), state.V_X() * std::cos(state.psi()) - state.V_Y() * std::sin(state.psi()), 1e-15);
    EXPECT_NEAR(derivative.y(), state.V_X() * std::sin(state.psi()) + state.V_Y() * std::cos(state.psi()), 1e-15);
    EXPECT_EQ(derivative.psi(), state.Omega());
    EXPECT_TRUE((derivative.phi() == state.dphi()).all());
    EXPECT_TRUE((derivative.gamma() == state.dgamma()).all());
  }
}

TEST(NoSlipModel, IsTheLimitOfModel2a) {
  Random random(27);
  for (int trial = 0; trial < 10; ++trial) {
    RobotParameters robot = random_wheels(random);
    robot.J_2 = 1e-12;  // adds 8 J_2 / (R - R_d)^2 = 4e-8 kg
    FloorParameters floor;
    floor.viscous_friction = 1e9;  // slips by 1e-7 m/s under 100 N, and rounds by 1e-7 N
    const PaperModel<ViscousLaw> slip_model(robot, floor);
    const NoSlipModel no_slip_model(robot);
    State rolling;
    rolling.values.col(1).head<3>() = random_vector(random).array();
    no_slip_model.constrain(rolling);
    const Wheels M = random.wheels(-3, 3);

    // Deviations of the wheels' and rollers' rates under which friction makes the wheels go on rolling: those that the
    // stiff modes settle at. The condition is linear in them, so that unit responses solve it.
    using Vector8 = Eigen::Matrix<double, 8, 1>;
    State derivative;
    const auto violation = [&](const Vector8& deviation) -> Vector8 {
      State state = rolling;
      state.dphi() += deviation.head<4>().array();
      state.dgamma() += deviation.tail<4>().array();
      slip_model.derivative(state, contacts_of(slip_model, state.velocities(), state.phi()), M, derivative);
      Vector8 result;
      result << (derivative.dphi() - no_slip_model.dphi(derivative.velocity())) * robot.J_1,
          (derivative.dgamma() - no_slip_model.dgamma(derivative.velocity())) * robot.J_2;
      return result;
    };
    const double unit = 1e-5;  // rad/s
    const Vector8 at_zero = violation(Vector8::Zero());
    Eigen::Matrix<double, 8, 8> response;
    for (int j = 0; j < 8; ++j) response.col(j) = (violation(unit * Vector8::Unit(j)) - at_zero) / unit;
    violation(-response.partialPivLu().solve(at_zero));  // leaves `derivative` there

    const Vector3d dv = no_slip_model.acceleration(rolling.velocity(), M);
    EXPECT_GT(dv.norm(), 0.1);  // there is something to agree on
    EXPECT_LT((derivative.velocity() - dv).norm(), 1e-6 * dv.norm());
  }
}

// A motion of the paper, and what the reference scenes, made by an independent programme, have for it.
struct PaperCase {
  const char* name;
  ReferenceMotion motion;
  Wheels constant, sin, cos;  // torques, N m, period 30 s
  Wheels dphi, dgamma;        // at t = 0, rad/s
};

const double kSpeed = 2.5 * 2 * kPi / 30;  // rho w, m/s

const PaperCase kPaperCases[] = {
    {"Case 1 as printed, clockwise: V_X = -rho w cos(w t - 90 deg), V_Y = rho w sin(w t - 90 deg)",
     {30, {0, 0, -kSpeed}, {0, -kSpeed, 0}, {}},
     {0, 0, 0, 0},
     {-1.2153003900030686, -1.088534222629446, -1.0919522674436761, -1.2118823451888385},
     {2.53245009632121, -2.655798218880602, -2.650243896057478, 2.526895773498086},
     {10.471975511965976, -10.471975511965976, -10.471975511965976, 10.471975511965976},
     Wheels::Constant(51.067619978831765)},
    {"Case 1 counter-clockwise: V_X = -rho w sin(w t - 90 deg), V_Y = rho w cos(w t - 90 deg)",
     {30, {0, kSpeed, 0}, {0, 0, kSpeed}, {}},
     {0, 0, 0, 0},
     {-2.650243896057478, 2.526895773498086, 2.53245009632121, -2.655798218880602},
     {1.088534222629446, 1.2153003900030686, 1.2118823451888385, 1.0919522674436761},
     Wheels::Constant(10.471975511965976),
     Wheels::Constant(0)},
    {"Case 2",
     {30, {}, {kSpeed, 0, 0}, {2 * kPi / 30, 0, 0}},
     {-2.89804529810137, 2.7999194979003175, 2.2855040599920784, -2.383629860193131},
     {0, 0, 0, 0},
     {0, 0, 0, 0},
     {-12.084659740808736, 12.084659740808736, 8.859291283123216, -8.859291283123216},
     {-55.86797625684194, -55.86797625684194, -46.26726370082158, -46.26726370082158}},
};

TEST(TorqueProfile, IsThatOfTheReferenceScenes) {
  const NoSlipModel model{RobotParameters{}};
  for (const PaperCase& paper : kPaperCases) {
    SCOPED_TRACE(paper.name);
    const ReferenceTorque torque(RobotParameters{}, paper.motion);
    PiecewiseTorque literal({TorqueSegment{0, paper.constant, paper.cos, paper.sin, 30}});
    literal.begin_segment(0);
    for (const double t : {0.0, 1.0, 7.5, 11.3, 22.5, 30.0}) {
      const double w_t = 2 * kPi * t / 30;
      const Wheels expected = paper.constant + paper.sin * std::sin(w_t) + paper.cos * std::cos(w_t);
      // Both rest on the same few operations in double precision.
      EXPECT_LT((torque.value(t) - expected).abs().maxCoeff(), 1e-14) << "t = " << t;
      EXPECT_LT((literal.value(t) - expected).abs().maxCoeff(), 1e-14) << "t = " << t;
    }
    const Vector3d v = paper.motion.velocity(0);
    EXPECT_LT((model.dphi(v) - paper.dphi).abs().maxCoeff(), 1e-14 * 20);
    EXPECT_LT((model.dgamma(v) - paper.dgamma).abs().maxCoeff(), 1e-14 * 60);
  }
}

}  // namespace
}  // namespace youbot_base_sim
