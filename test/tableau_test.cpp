// The coefficients of the Rosenbrock methods, against the conditions that a method has to meet.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include "youbot_base_sim/integration/rosenbrock_tableaus.h"

namespace youbot_base_sim {
namespace {

template <class Tableau>
class TableauTest : public testing::Test {};
using Tableaus = testing::Types<Rodas4, Rodas5P>;
TYPED_TEST_SUITE(TableauTest, Tableaus, );

// The method's own coefficients, from those of the transformed stages U = Gamma k (Hairer and Wanner, section IV.7):
// C = 1/gamma - Gamma^-1, a = A Gamma^-1, m = b Gamma^-1.
template <class Tableau>
struct Coefficients {
  static constexpr int s = Tableau::stages;
  using Matrix = Eigen::Matrix<double, s, s>;
  using Vector = Eigen::Matrix<double, s, 1>;

  Coefficients() {
    Matrix a = Matrix::Zero(), C = Matrix::Zero();
    for (int i = 0; i < s; ++i) {
      for (int j = 0; j < i; ++j) {
        a(i, j) = Tableau::a[i][j];
        C(i, j) = Tableau::c[i][j];
      }
    }
    Gamma = (Matrix::Identity() / Tableau::gamma - C).inverse();
    A = a * Gamma;
    B = A + Gamma;
    // The new state is y + sum_j a_sj U_j + U_s; without U_s it is the embedded one.
    Vector m = a.row(s - 1).transpose();
    embedded_b = Gamma.transpose() * m;
    m[s - 1] = 1;
    b = Gamma.transpose() * m;
  }

  Matrix Gamma, A, B;  // gamma_ij, alpha_ij, beta_ij = alpha_ij + gamma_ij
  Vector b, embedded_b;

  // Largest violation of the conditions for an order (Hairer and Wanner, section IV.7): one for each rooted tree; a
  // vertex with one branch stands for beta, one with several for alpha.
  double violation(const Vector& weights, int order) const {
    const Vector one = Vector::Ones(), alpha = A * one, beta = B * one;
    const auto times = [](const Vector& x, const Vector& y) -> Vector { return x.cwiseProduct(y); };
    const Vector alpha_2 = times(alpha, alpha), alpha_3 = times(alpha_2, alpha);
    const Vector A_beta = A * beta;
    switch (order) {
      case 1:
        return worst(weights, {{one, 1}});
      case 2:
        return worst(weights, {{beta, 2}});
      case 3:
        return worst(weights, {{alpha_2, 3}, {B * beta, 6}});
      case 4:
        return worst(weights, {{alpha_3, 4}, {times(alpha, A_beta), 8}, {B * alpha_2, 12}, {B * B * beta, 24}});
      default:
        return worst(weights, {{times(alpha_2, alpha_2), 5},
                               {times(alpha_2, A_beta), 10},
                               {times(A_beta, A_beta), 20},
                               {times(alpha, A * alpha_2), 15},
                               {times(alpha, A * B * beta), 30},
                               {B * alpha_3, 20},
                               {B * times(alpha, A_beta), 40},
                               {B * B * alpha_2, 60},
                               {B * B * B * beta, 120}});
    }
  }

  // R(z) on the linear test equation.
  std::complex<double> stability(const Vector& weights, std::complex<double> z) const {
    using ComplexMatrix = Eigen::Matrix<std::complex<double>, s, s>;
    const ComplexMatrix stages = ComplexMatrix::Identity() - z * B;
    const Eigen::Matrix<std::complex<double>, s, 1> one = Vector::Ones();
    return 1.0 + z * weights.dot(stages.partialPivLu().solve(one));
  }
  double stability_at_infinity(const Vector& weights) const {
    return 1 - weights.dot(B.partialPivLu().solve(Vector::Ones()));
  }

 private:
  static double worst(const Vector& weights, const std::vector<std::pair<Vector, double>>& trees) {
    double result = 0;
    for (const auto& tree : trees) result = std::max(result, std::abs(weights.dot(tree.first) - 1 / tree.second));
    return result;
  }
};

TYPED_TEST(TableauTest, HasItsOrder) {
  const Coefficients<TypeParam> method;
  // Sixteen digits of coefficients of up to 150: 2e-14 of rounding were seen.
  const double rounding = 1e-13;
  for (int i = 0; i < TypeParam::stages; ++i) {
    EXPECT_NEAR(method.A.row(i).sum(), TypeParam::alpha[i], rounding) << "stage " << i;
    EXPECT_NEAR(method.Gamma.row(i).sum(), TypeParam::d[i], rounding) << "stage " << i;
    EXPECT_NEAR(method.Gamma(i, i), TypeParam::gamma, rounding);
  }
  for (int order = 1; order <= TypeParam::order; ++order) {
    EXPECT_LT(method.violation(method.b, order), rounding) << "order " << order;
  }
  for (int order = 1; order <= TypeParam::error_order; ++order) {
    EXPECT_LT(method.violation(method.embedded_b, order), rounding) << "embedded, order " << order;
  }
  // The embedded method is of no higher order, or its difference would estimate nothing.
  EXPECT_GT(method.violation(method.embedded_b, TypeParam::error_order + 1), 1e-4);
}

TYPED_TEST(TableauTest, IsLStable) {
  const Coefficients<TypeParam> method;
  EXPECT_NEAR(method.stability_at_infinity(method.b), 0, 1e-13);  // as above
  EXPECT_NEAR(method.stability_at_infinity(method.embedded_b), 0, 1e-13);
  // A-stable: bounded by 1 on the imaginary axis, and so to the left of it.
  for (double y = 1e-3; y < 1e6; y *= 1.05) {
    EXPECT_LE(std::abs(method.stability(method.b, {0, y})), 1 + 1e-12) << "y = " << y;
  }
  EXPECT_NEAR(std::abs(method.stability(method.b, -0.1) - std::exp(-0.1)), 0, 1e-7);  // it is the exponential's
}

}  // namespace
}  // namespace youbot_base_sim
