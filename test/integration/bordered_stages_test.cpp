// The solver for the stages, against dense elimination of the same system; with normal reactions that follow, against
// the equations themselves.

#include "youbot_base_sim/integration/bordered_stages.h"

#include <gtest/gtest.h>

#include "physics/random_states.h"
#include "youbot_base_sim/integration/reacting_stages.h"
#include "youbot_base_sim/physics/model.h"

namespace youbot_base_sim {
namespace {

constexpr int kPerStage = 11;  // three velocities of the platform, four of wheels, four of rollers

// Radau's inverse coefficients, from its nodes: A solves A c^(k-1) = c^k / k for k = 1..3.
Eigen::Matrix3d radau_inverse() {
  const Eigen::Array3d c{(4 - std::sqrt(6.0)) / 10, (4 + std::sqrt(6.0)) / 10, 1};
  Eigen::Matrix3d powers, integrals;
  powers << Eigen::Vector3d::Ones(), c.matrix(), c.square().matrix();
  integrals << c.matrix(), c.square().matrix() / 2, c.cube().matrix() / 3;
  return powers * integrals.inverse();
}

template <int s>
struct StageSystem {
  static constexpr int kSize = kPerStage * s;
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::MatrixXd;
  using Stages = typename BorderedStages<s>::Vector;

  explicit StageSystem(const RobotParameters& robot) : inertia(robot) {}

  // The step's coupling of the stages, for a length of dt (s).
  void set_step(double dt) {
    if (s == 1) {
      D[0][0] = 3.6 / dt;
      return;
    }
    const Eigen::Matrix3d inverse = radau_inverse();
    for (int j = 0; j < s; ++j) {
      for (int l = 0; l < s; ++l) D[j][l] = inverse(j, l) / dt;
    }
  }

  Matrix dense() const {
    Matrix A = Matrix::Zero(kSize, kSize);
    for (int j = 0; j < s; ++j) {
      for (int l = 0; l < s; ++l) {
        auto block = A.template block<kPerStage, kPerStage>(kPerStage * j, kPerStage * l);
        block.template topLeftCorner<3, 3>() = D[j][l] * inertia.M_v;
        block.diagonal().template segment<4>(3).setConstant(D[j][l] * inertia.J_1);
        block.diagonal().template tail<4>().setConstant(D[j][l] * inertia.J_2);
      }
      auto block = A.template block<kPerStage, kPerStage>(kPerStage * j, kPerStage * j);
      for (int k = 0; k < 3; ++k) block.template topLeftCorner<3, 3>().col(k) -= C[j][k].template head<3>().matrix();
      for (int i = 0; i < kWheels; ++i) add_wheel(block, G[j], i);
    }
    return A;
  }

  template <class Block>
  static void add_wheel(Block& block, const DampingMatrix& damping, int i) {
    const int dphi = 3 + i, dgamma = 7 + i;
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) block(k, l) += damping.platform_platform[k][l][i];
      block(k, dphi) += damping.platform_dphi[k][i];
      block(k, dgamma) += damping.platform_dgamma[k][i];
      block(dphi, k) += damping.dphi_platform[k][i];
      block(dgamma, k) += damping.dgamma_platform[k][i];
    }
    block(dphi, dphi) += damping.dphi_dphi[i];
    block(dphi, dgamma) += damping.dphi_dgamma[i];
    block(dgamma, dphi) += damping.dgamma_dphi[i];
    block(dgamma, dgamma) += damping.dgamma_dgamma[i];
  }

  static Vector flat(const Stages& stages) {
    Vector vector(kSize);
    for (int j = 0; j < s; ++j) {
      vector.template segment<kPerStage>(kPerStage * j) << stages[j].v.template head<3>(), stages[j].dphi,
          stages[j].dgamma;
    }
    return vector;
  }

  static Stages unflat(const Vector& vector) {
    Stages stages;
    for (int j = 0; j < s; ++j) {
      const auto segment = vector.template segment<kPerStage>(kPerStage * j).array();
      stages[j].v << segment.template head<3>(), 0;
      stages[j].dphi = segment.template segment<4>(3);
      stages[j].dgamma = segment.template tail<4>();
    }
    return stages;
  }

  Inertia inertia;
  double D[s][s] = {};
  std::array<DampingMatrix, s> G;
  std::array<PlatformMatrix, s> C;
};

// Nothing symmetric, and no zero, about it. What holds a motion lies on the diagonal, so that none of it is singular.
DampingMatrix random_damping(Random& random) {
  DampingMatrix G;
  for (int k = 0; k < 3; ++k) {
    for (int l = 0; l < 3; ++l) G.platform_platform[k][l] = random.wheels(-10, 10) + (k == l ? 100 : 0);
    G.platform_dphi[k] = random.wheels(-1, 1);
    G.dphi_platform[k] = random.wheels(-1, 1);
    G.platform_dgamma[k] = random.wheels(-1, 1);
    G.dgamma_platform[k] = random.wheels(-1, 1);
  }
  G.dphi_dphi = random.wheels(0.5, 1);
  G.dgamma_dgamma = random.wheels(0.5, 1);
  G.dphi_dgamma = random.wheels(-0.3, 0.3);
  G.dgamma_dphi = random.wheels(-0.3, 0.3);
  return G;
}

template <class System>
class BorderedStagesTest : public testing::Test {};
using Sizes = testing::Types<StageSystem<1>, StageSystem<3>>;
TYPED_TEST_SUITE(BorderedStagesTest, Sizes, );

template <int s>
typename StageSystem<s>::Vector solution(const StageSystem<s>& system, const typename StageSystem<s>::Vector& b) {
  BorderedStages<s> solver;
  solver.factorize(system.D, system.inertia, system.G, system.C);
  typename BorderedStages<s>::Vector u;
  solver.solve(StageSystem<s>::unflat(b), u);
  for (const Velocities& stage : u) EXPECT_EQ(stage.v[3], 0);
  return StageSystem<s>::flat(u);
}

// The largest change of an entry of A, relative to it, that makes u a solution: what elimination leaves to rounding.
template <class System>
double backward_error(const typename System::Matrix& A, const typename System::Vector& u,
                      const typename System::Vector& b) {
  return ((A * u - b).cwiseAbs().array() / (A.cwiseAbs() * u.cwiseAbs()).array()).maxCoeff();
}

TYPED_TEST(BorderedStagesTest, SolvesAnySystem) {
  Random random(51);
  for (int trial = 0; trial < 100; ++trial) {
    TypeParam system(random_robot(random));
    system.set_step(std::pow(10, random.uniform(-4, 0)));
    for (DampingMatrix& G : system.G) G = random_damping(random);
    for (PlatformMatrix& C : system.C) {
      for (Wheels& column : C) column = random.wheels(-30, 30) * Wheels{1, 1, 1, 0};
    }
    typename TypeParam::Vector wanted(TypeParam::kSize);
    for (int k = 0; k < wanted.size(); ++k) wanted[k] = random.uniform(-1, 1);
    const typename TypeParam::Matrix A = system.dense();
    const typename TypeParam::Vector b = A * wanted, u = solution(system, b);
    EXPECT_LT(backward_error<TypeParam>(A, u, b), 1e-13);
    // And what such a change moves the solution by, to first order.
    const typename TypeParam::Vector sensitivity = A.inverse().cwiseAbs() * (A.cwiseAbs() * u.cwiseAbs());
    const typename TypeParam::Vector scale = A.cwiseAbs().rowwise().maxCoeff().cwiseInverse();
    const typename TypeParam::Matrix scaled = scale.asDiagonal() * A;  // so that pivots are chosen among equals
    const typename TypeParam::Vector apart = u - scaled.partialPivLu().solve(scale.cwiseProduct(b));
    EXPECT_TRUE((apart.cwiseAbs().array() <= 1e-13 * sensitivity.array()).all()) << apart.transpose();
  }
}

// Contacts that grip, slip or both; steps from what a switch needs to a second; friction from mild to regularised at
// 1e-9 m/s.
TYPED_TEST(BorderedStagesTest, SolvesForEveryStepAndStiffness) {
  Random random(52);
  for (const double nu : {1e-1, 1e-3, 1e-6, 1e-9}) {
    for (const double dt : {1e-9, 1e-6, 1e-4, 1e-2, 1.0}) {
      for (const double slip_by_nu : {1e-3, 1.0, 1e3}) {
        const RobotParameters robot = random_robot(random);
        FloorParameters floor;
        floor.nu = nu;
        const PaperModel<CoulombLaw> model(robot, floor);
        TypeParam system(robot);
        system.set_step(dt);
        for (std::size_t j = 0; j < system.G.size(); ++j) {
          const State x = random_state(random, robot, Wheels::Zero(), nu * slip_by_nu);
          model.damping(x.velocities(), contacts_of(model, x.velocities(), x.phi()), system.G[j]);
          system.C[j] = model.inertia().coriolis_derivative(x.velocities().v);
        }
        typename TypeParam::Vector wanted(TypeParam::kSize);
        for (int k = 0; k < wanted.size(); ++k) wanted[k] = random.uniform(-1, 1);
        const typename TypeParam::Matrix A = system.dense();
        const typename TypeParam::Vector b = A * wanted, u = solution(system, b);
        EXPECT_LT(backward_error<TypeParam>(A, u, b), 1e-13)
            << "nu " << nu << ", dt " << dt << ", slip / nu " << slip_by_nu;
      }
    }
  }
}

// Forces that are small beside those that reactions which stay leave, as friction's are.
Velocities random_velocities(Random& random, double size) {
  Velocities u = {random.wheels(-size, size), random.wheels(-size, size), random.wheels(-size, size)};
  u.v[3] = 0;
  return u;
}

TYPED_TEST(BorderedStagesTest, ReactionsThatFollowSolveTheirEquations) {
  constexpr int s = std::tuple_size_v<typename TypeParam::Stages>;
  Random random(53);
  for (int trial = 0; trial < 100; ++trial) {
    TypeParam system(random_robot(random));
    system.set_step(std::pow(10, random.uniform(-4, 0)));
    for (DampingMatrix& G : system.G) G = random_damping(random);
    for (PlatformMatrix& C : system.C) C.fill(Wheels::Zero());
    typename ReactingStages<s>::Couplings couplings;
    for (ReactionCoupling& coupling : couplings) {
      for (int m = 0; m < 3; ++m) {
        coupling.balance[m] = random_velocities(random, 1);
        coupling.forces[m] = random_velocities(random, 0.1);
        coupling.N[m] = Wheels::Zero();
        coupling.N[m][m] = 1;  // so that the change of the reactions is that of the moments
      }
    }
    BorderedStages<s> K;
    K.factorize(system.D, system.inertia, system.G, system.C);
    typename TypeParam::Stages b, u;
    for (Velocities& stage : b) stage = random_velocities(random, 1);
    K.solve(b, u);
    const auto moments = [&](int j, int m) {
      const Velocities& row = couplings[j].balance[m];
      return (row.v * u[j].v + row.dphi * u[j].dphi + row.dgamma * u[j].dgamma).sum();
    };
    double asked = 0, missing = 0;
    for (int j = 0; j < s; ++j) {
      for (int m = 0; m < 3; ++m) asked += std::pow(moments(j, m), 2);
    }
    std::array<Wheels, s> y;
    ReactingStages<s>::correct(K, couplings, u, y);
    typename TypeParam::Stages right = b;
    for (int j = 0; j < s; ++j) {
      for (int m = 0; m < 3; ++m) {
        right[j] = right[j] + y[j][m] * couplings[j].forces[m];
        missing += std::pow(moments(j, m) - y[j][m], 2);
      }
    }
    EXPECT_LE(missing, 1.001 * 0.02 * 0.02 * asked);
    EXPECT_LT(backward_error<TypeParam>(system.dense(), TypeParam::flat(u), TypeParam::flat(right)), 1e-12);
  }
}

}  // namespace
}  // namespace youbot_base_sim
