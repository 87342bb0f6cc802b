// Geometry and kinematics of the contacts and the contact laws, against their definitions in space: rigid bodies,
// vectors and differences, not the formulas that follow from them.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "random_states.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

// The roller in contact as the paper describes it, in the platform's frame with the wheel's centre C as origin: its
// axis is the line through K = A (0, 0, -R_d) along A (cos delta, sin delta, 0), A a turn by phi~ about the axle.
struct RollerAxis {
  RollerAxis(const RobotParameters& robot, double delta, double phi_tilde) {
    const AngleAxisd turn(phi_tilde, Vector3d::UnitY());
    K = turn * Vector3d(0, 0, -robot.R_d);
    e = turn * Vector3d(std::cos(delta), std::sin(delta), 0);
  }
  // The roller touches the cylinder from within where a common normal runs from the axle through the roller's axis.
  // The floor touches it where that normal is vertical, so below the axis' point with X = 0.
  double Delta_Y() const { return (K - K.x() / e.x() * e).y(); }

  Vector3d K, e;
};

// Position after time t (s), in the fixed frame, of the point of wheel i's roller that touches the floor at t = 0: a
// chain of rigid bodies - platform, wheel, roller - each moving at its rate in `state`.
Vector3d material_point(const RobotParameters& robot, const State& state, double phi_tilde, int i, double t) {
  const RollerAxis now(robot, delta(robot)[i], phi_tilde);
  const Vector3d P_now(0, now.Delta_Y(), -robot.R);

  const Vector3d from_K = AngleAxisd(state.dgamma()[i] * t, now.e) * (P_now - now.K);
  const Vector3d from_C = AngleAxisd(state.dphi()[i] * t, Vector3d::UnitY()) * (now.K + from_K);
  const Vector3d from_O = Vector3d(robot.rho_X()[i], robot.rho_Y()[i], 0) + from_C;
  const Vector3d O = AngleAxisd(state.psi(), Vector3d::UnitZ()) * Vector3d(state.V_X() * t, state.V_Y() * t, robot.R);
  return O + AngleAxisd(state.psi() + state.Omega() * t, Vector3d::UnitZ()) * from_O;
}

TEST(RollerAt, AgreesWithTheModuloOfThePaper) {
  Random random(1);
  for (const int n : {3, 4, 5, 6, 7, 9, 12, 16}) {
    RobotParameters robot;
    robot.rollers = n;
    const RollerGeometry geometry(robot);
    for (const double range : {1.0, 1e2, 1e6}) {
      for (int trial = 0; trial < 1000; ++trial) {
        const double phi = random.uniform(-range, range);
        // (2.1), with a modulo that is never negative
        const double pitch = 2 * kPi / n;
        const double turned = std::fmod(phi + kPi / n, pitch);
        const double phi_tilde = (turned < 0 ? turned + pitch : turned) - kPi / n;
        if (kPi / n - std::abs(phi_tilde) < 1e-8) continue;  // rounding decides; edges have a test of their own
        const double here = phi - geometry.roller_at(phi) * geometry.pitch();
        // 1e6 rad over pitch have a rounding error of 1e-10 rad each way.
        ASSERT_NEAR(here, phi_tilde, 1e-15 * std::max(1.0, range)) << "n = " << n << ", phi = " << phi;
      }
    }
  }
}

TEST(RollerAt, AnEdgeBelongsToTheUpperRoller) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const int n : {3, 4, 5, 6, 7, 9, 12, 16}) {
    RobotParameters robot;
    robot.rollers = n;
    const RollerGeometry geometry(robot);
    for (const int k : {-1000003, -4097, -100, -7, -2, -1, 0, 1, 2, 5, 99, 4096, 1000000}) {
      const double edge = geometry.upper_edge(k);
      // (2k + 1) pi / n, to a few units in the last place
      EXPECT_NEAR(edge, (2.0 * k + 1) * kPi / n, 4e-16 * std::abs(edge));
      EXPECT_EQ(geometry.roller_at(edge), k + 1) << "n = " << n << ", k = " << k;
      EXPECT_EQ(geometry.roller_at(std::nextafter(edge, -infinity)), k) << "n = " << n << ", k = " << k;
      EXPECT_EQ(geometry.roller_at(std::nextafter(edge, infinity)), k + 1) << "n = " << n << ", k = " << k;
    }
  }
}

TEST(RollerAt, ThirtyDegreesOfTheYoubot) {
  const RollerGeometry geometry(RobotParameters{});
  EXPECT_EQ(geometry.roller_at(0.5235987755982988), 1);   // phi~ = -30 deg
  EXPECT_EQ(geometry.roller_at(-0.5235987755982988), 0);  // phi~ = -30 deg
  EXPECT_EQ(geometry.roller_at(0.0), 0);
}

TEST(RollerAt, NumbersHave64BitsOrThereAreNone) {
  const RollerGeometry geometry(RobotParameters{});
  EXPECT_GT(geometry.roller_at(9e18), 8'500'000'000'000'000'000);
  EXPECT_LT(geometry.roller_at(-9e18), -8'500'000'000'000'000'000);
  for (const double phi : {1e19, -1e19, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW(geometry.roller_at(phi), std::domain_error) << phi;
  }
}

TEST(RollerGeometry, RadiusAtTheEndsIsZeroWhereRollersTaperToAPoint) {
  RobotParameters robot;
  EXPECT_NEAR(RollerGeometry(robot).end_radius(), 0.05 - 0.0355 / std::cos(kPi / 6), 1e-15);
  robot.R_d = 0.05 * std::cos(kPi / 6);
  EXPECT_NEAR(RollerGeometry(robot).end_radius(), 0, 1e-15);
}

TEST(ContactGeometry, ContactIsTheLowestPointOfTheRoller) {
  Random random(2);
  for (int trial = 0; trial < 50; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const Wheels phi_tilde = random.wheels(-kPi / 6, kPi / 6);
    const ContactGeometry contact = RollerGeometry(robot).at(phi_tilde);
    for (int i = 0; i < kWheels; ++i) {
      // The roller is the union of all balls about points of its axis that fit into the cylinder of radius R.
      const RollerAxis axis(robot, delta(robot)[i], phi_tilde[i]);
      const auto bottom = [&](double s) {
        const Vector3d Q = axis.K + s * axis.e;
        return Q.z() - (robot.R - std::hypot(Q.x(), Q.z()));
      };
      // Ternary search for the lowest ball.
      double low = -0.1, high = 0.1;
      while (high - low > 1e-12) {
        const double third = (high - low) / 3;
        if (bottom(low + third) < bottom(high - third)) {
          high -= third;
        } else {
          low += third;
        }
      }
      const double s = 0.5 * (low + high);
      EXPECT_NEAR(bottom(s), -robot.R, 1e-15);  // on the cylinder
      // The minimum is flat: it is found to sqrt(1e-17 m x 0.1 m) = 1e-9 m.
      EXPECT_NEAR((axis.K + s * axis.e).y(), contact.Delta_Y[i], 1e-8);
      // The same point by the common normal, to rounding.
      EXPECT_NEAR(axis.Delta_Y(), contact.Delta_Y[i], 1e-16);
    }
  }
}

TEST(ContactGeometry, DerivativesAreThoseOfTheValues) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const RollerGeometry geometry(robot);
    const Wheels phi_tilde = random.wheels(-1, 1);  // also beyond the edge, as far as a step may look
    const auto by_phi = [&](Wheels ContactGeometry::*value) {
      return difference([&](double h) { return Wheels(geometry.at(phi_tilde + h).*value); }, 1e-4);
    };
    const ContactGeometry contact = geometry.at(phi_tilde);
    // Lengths of 0.1 m: 1e-4^4 x 0.1 m x 1000 (fifth derivative of tan at 1 rad, over 30) = 1e-14, rounding 1e-13.
    EXPECT_LT((by_phi(&ContactGeometry::r_Y) - contact.dr_Y).abs().maxCoeff(), 1e-12);
  }
}

TEST(Contacts, SlipIsTheVelocityOfTheRollersMaterialPoint) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const RobotParameters robot = random_wheels(random);
    const PaperModel<CoulombLaw> model(robot, {});
    Wheels phi_center = Wheels{-3, -1, 0, 5} * model.geometry().pitch();
    const State state = random_state(random, robot, phi_center, random.uniform(0, 0.3));
    const Contacts contacts = contacts_of(model, state.velocities(), state.phi() - phi_center);
    for (int i = 0; i < kWheels; ++i) {
      const double phi_tilde = state.phi()[i] - phi_center[i];
      const Vector3d V_P = AngleAxisd(-state.psi(), Vector3d::UnitZ()) *
                           difference([&](double t) { return material_point(robot, state, phi_tilde, i, t); }, 2e-5);
      // Rolling at 1 m/s and up to 150 rad/s: (2e-5 s x 150 rad/s)^4 / 30 x 1 m/s = 3e-12 m/s, and as much rounding.
      EXPECT_NEAR(contacts.V_PX[i], V_P.x(), 2e-11);
      EXPECT_NEAR(contacts.V_PY[i], V_P.y(), 2e-11);
      EXPECT_NEAR(0, V_P.z(), 2e-11);
      EXPECT_NEAR(contacts.Delta_Y[i], RollerAxis(robot, delta(robot)[i], phi_tilde).Delta_Y(), 1e-16);
    }
  }
}

// By Simpson's rule, independent of the antiderivatives.
TEST(ContactGeometry, MeanIsTheMeanOverARoller) {
  Random random(10);
  for (const int n : {3, 4, 6, 9, 16}) {
    RobotParameters robot = random_wheels(random);
    robot.rollers = n;
    const RollerGeometry geometry(robot);
    constexpr int kIntervals = 2000;
    const auto mean = [&](Wheels ContactGeometry::*value) -> Wheels {
      Wheels sum = Wheels::Zero();
      for (int k = 0; k <= kIntervals; ++k) {
        const double weight = k == 0 || k == kIntervals ? 1 : k % 2 == 1 ? 4 : 2;
        sum += weight * (geometry.at(Wheels::Constant((2.0 * k / kIntervals - 1) * kPi / n)).*value);
      }
      return sum / (3 * kIntervals);
    };
    const ContactGeometry& mean_contact = geometry.mean();
    // Lengths of 0.1 m; Simpson's error is (pi / 3 / 1000)^4 / 180 of the fourth derivative, up to 1000 of them.
    EXPECT_LT((mean_contact.Delta_Y - mean(&ContactGeometry::Delta_Y)).abs().maxCoeff(), 1e-12) << "n = " << n;
    EXPECT_LT((mean_contact.r_X - mean(&ContactGeometry::r_X)).abs().maxCoeff(), 1e-12) << "n = " << n;
    EXPECT_LT((mean_contact.r_Y - mean(&ContactGeometry::r_Y)).abs().maxCoeff(), 1e-12) << "n = " << n;
    EXPECT_TRUE((mean_contact.dr_Y == 0).all()) << "n = " << n;  // the mean does not depend on the wheel's angle
  }
}

TEST(NormalReactions, BalanceTheWeight) {
  Random random(5);
  for (int trial = 0; trial < 50; ++trial) {
    const RobotParameters robot = random_wheels(random);
    FloorParameters floor;
    floor.g = random.uniform(1, 20);
    const Wheels N = normal_reactions(robot, floor);
    const double rounding = 1e-15 * robot.m_s() * floor.g;
    EXPECT_NEAR(N.sum(), (robot.m + 4 * robot.m_1) * floor.g, 4 * rounding);                          // (4.13)
    EXPECT_NEAR((N[0] + N[2] - N[1] - N[3]) * robot.l, robot.m * floor.g * robot.a_Y, rounding);      // (4.14)
    EXPECT_NEAR((N[2] + N[3] - N[0] - N[1]) * robot.h + robot.m * floor.g * robot.a_X, 0, rounding);  // (4.15)
    EXPECT_NEAR(N[0] + N[3], N[1] + N[2], 4 * rounding);                                              // (4.16)
  }
}

using Slip = ContactVector<2>;

/// Friction by a law under the normal reactions of the robot at rest.
template <class Law>
struct Friction {
  Friction(const RobotParameters& robot, const FloorParameters& floor)
      : friction(Law(robot, floor), floor.nu), limit(floor.f * normal_reactions(robot, floor)) {}

  Slip force(const Slip& V_P) const { return friction.force(V_P, limit); }
  ContactStiffness<2> stiffness(const Slip& V_P) const { return friction.stiffness(V_P, limit); }

  ContactFriction<Law, 2> friction;
  Wheels limit;
};

TEST(ViscousLaw, ResistsInProportion) {
  const RobotParameters robot;
  FloorParameters floor;
  EXPECT_NEAR(floor.mu_0(robot)[0], 4.4e4, 0.05e4);  // section 5.2, in the two digits that it prints
  EXPECT_DOUBLE_EQ(floor.mu_0(robot)[0], 43654.5);   // 0.5 x 35.6 kg x 9.81 m/s^2 / (4 x 1e-3 m/s)
  for (const double viscous_friction : {-1.0, 0.0, 123.0}) {
    floor.viscous_friction = viscous_friction;
    const double mu_0 = viscous_friction < 0 ? 43654.5 : viscous_friction;
    const Friction<ViscousLaw> friction(robot, floor);
    Random random(6);
    const Slip V_P = {{random.wheels(-1, 1), random.wheels(-1, 1)}};
    const Slip F = friction.force(V_P);
    const auto K = friction.stiffness(V_P);
    for (int i = 0; i < kWheels; ++i) {
      EXPECT_DOUBLE_EQ(F[0][i], -mu_0 * V_P[0][i]);
      EXPECT_DOUBLE_EQ(F[1][i], -mu_0 * V_P[1][i]);
      EXPECT_DOUBLE_EQ(K(0, 0)[i], mu_0);
      EXPECT_DOUBLE_EQ(K(1, 1)[i], mu_0);
      EXPECT_EQ(K(0, 1)[i], 0);
    }
  }
}

// Slip velocities of `speed` (m/s) in four random directions.
Slip random_slip(Random& random, double speed) {
  const Wheels direction = random.wheels(-kPi, kPi);
  return {{speed * direction.cos(), speed * direction.sin()}};
}

TEST(CoulombLaw, OpposesSlipAndSaturates) {
  Random random(7);
  for (const double ratio : {1e-6, 1e-2, 0.3, 1.0, 3.0, 1e2, 1e6}) {  // slip by nu; the last is full slip to 5e-13
    const RobotParameters robot = random_wheels(random);
    const FloorParameters floor;
    const Wheels limit = floor.f * normal_reactions(robot, floor);
    const Slip V_P = random_slip(random, ratio * floor.nu);
    const Slip F = Friction<CoulombLaw>(robot, floor).force(V_P);
    const double share = ratio / std::hypot(1, ratio);  // of f N, by the regularisation of section 5.2
    for (int i = 0; i < kWheels; ++i) {
      // Directly against the slip, and as large as the law says: to rounding.
      EXPECT_NEAR((F[0][i] * V_P[0][i] + F[1][i] * V_P[1][i]) / (ratio * floor.nu), -share * limit[i],
                  1e-14 * share * limit[i]);
      EXPECT_NEAR(F[0][i] * V_P[1][i], F[1][i] * V_P[0][i], 1e-14 * share * limit[i] * ratio * floor.nu);
      EXPECT_LE(std::hypot(F[0][i], F[1][i]), limit[i] * (1 + 1e-15));
    }
  }
}

TEST(CoulombLaw, IsTheViscousLawNearZeroSlip) {
  RobotParameters robot;
  robot.a_X = robot.a_Y = 0;  // N_i = m_s g / 4, of which mu_0 is made
  const FloorParameters floor;
  Random random(8);
  const Slip V_P = random_slip(random, 1e-6 * floor.nu);
  const Slip coulomb = Friction<CoulombLaw>(robot, floor).force(V_P);
  const Slip viscous = Friction<ViscousLaw>(robot, floor).force(V_P);
  // They part by (slip / nu)^2 / 2 = 5e-13.
  EXPECT_LT((coulomb[0] / viscous[0] - 1).abs().maxCoeff(), 1e-12);
  EXPECT_LT((coulomb[1] / viscous[1] - 1).abs().maxCoeff(), 1e-12);
}

TEST(CoulombLaw, StiffnessIsTheForcesDerivative) {
  Random random(9);
  for (const double ratio : {1e-3, 0.1, 1.0, 10.0, 1e3}) {  // slip by nu
    const RobotParameters robot = random_wheels(random);
    const FloorParameters floor;
    const Friction<CoulombLaw> friction(robot, floor);
    const double speed = ratio * floor.nu;
    const Slip V_P = random_slip(random, speed);
    const auto K = friction.stiffness(V_P);
    const double scale = std::hypot(floor.nu, speed);
    // Steps of 1e-3 of the scale of the law: error (1e-3)^4, rounding 1e-16 / 1e-3, both of the slope f N / scale.
    const double h = 1e-3 * scale;
    const Wheels tolerance = 1e-11 * floor.f * normal_reactions(robot, floor) / scale;
    for (int k = 0; k < 2; ++k) {
      for (int l = 0; l < 2; ++l) {
        const auto shifted = [&](double step) {
          Slip V = V_P;
          V[l] += step;
          return Wheels(friction.force(V)[k]);
        };
        EXPECT_TRUE(((K(k, l) + difference(shifted, h)).abs() < tolerance).all()) << "slip / nu = " << ratio;
      }
    }
    // Positive definite, however flat the law has become: (nu / slip)^2 = 1e-6 is far above rounding.
    EXPECT_TRUE((K(0, 0) > 0 && K(1, 1) > 0 && K(0, 0) * K(1, 1) > K(0, 1).square()).all()) << "slip / nu = " << ratio;
  }
}

TEST(CoulombLaw, StiffnessAlongTheSlipKeepsItsDigitsInFullSlip) {
  const RobotParameters robot;
  const FloorParameters floor;
  const Friction<CoulombLaw> friction(robot, floor);
  const Wheels limit = floor.f * normal_reactions(robot, floor);
  const Wheels speed{1e-2, 0.1, 1, 10};
  // d/ds of s / sqrt(nu^2 + s^2) is nu^2 / (nu^2 + s^2)^(3/2); 1 - s^2 / (nu^2 + s^2) would lose it to rounding.
  const Wheels along = limit * floor.nu * floor.nu / (floor.nu * floor.nu + speed.square()).pow(1.5);
  EXPECT_LT((friction.stiffness({{speed, Wheels::Zero()}})(0, 0) / along - 1).abs().maxCoeff(), 1e-14);
  EXPECT_LT((friction.stiffness({{Wheels::Zero(), -speed}})(1, 1) / along - 1).abs().maxCoeff(), 1e-14);
}

}  // namespace
}  // namespace youbot_base_sim
