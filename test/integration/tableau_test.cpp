// The coefficients of Radau IIA, against the conditions that define it and its error estimate.

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <complex>

#include "youbot_base_sim/integration/radau_tableau.h"

namespace youbot_base_sim {
namespace {

using T = RadauTableau;
using Matrix = Eigen::Matrix3d;
using Vector = Eigen::Vector3d;

Matrix matrix(const double (&rows)[3][3]) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&rows[0][0]);
}
Vector vector(const double (&entries)[3]) { return Eigen::Map<const Vector>(entries); }
Vector power(const Vector& c, int k) { return c.array().pow(k).matrix(); }

// Numbers of about 1, sums of three of them.
constexpr double kRounding = 4e-15;

// The nodes are the zeros of d^2/dx^2 (x^2 (x - 1)^3) (Hairer and Wanner, section IV.5), that is of x - 1 and of
// 10 x^2 - 8 x + 1.
TEST(RadauTableau, NodesAreThoseOfRadauRight) {
  for (int j = 0; j < 2; ++j) EXPECT_NEAR(10 * T::c[j] * T::c[j] - 8 * T::c[j] + 1, 0, kRounding);
  EXPECT_LT(T::c[0], T::c[1]);
  EXPECT_EQ(T::c[2], 1);
}

// C(3): sum_l a_jl c_l^(k-1) = c_j^k / k for k <= 3, stage order 3, which defines A. B(5): the same for the step's end,
// the last stage, for k <= 5; with C(3) and D(2) order 5 follows (Butcher).
TEST(RadauTableau, CollocatesWithOrderFive) {
  const Matrix A = matrix(T::A);
  const Vector c = vector(T::c), b = A.row(2).transpose();
  for (int k = 1; k <= 3; ++k) {
    EXPECT_LT((A * power(c, k - 1) - power(c, k) / k).cwiseAbs().maxCoeff(), kRounding) << "C(" << k << ")";
  }
  for (int k = 1; k <= 5; ++k) EXPECT_NEAR(b.dot(power(c, k - 1)), 1.0 / k, kRounding) << "B(" << k << ")";
  EXPECT_GT(std::abs(b.dot(power(c, 5)) - 1.0 / 6), 1e-4);
  // D(2): sum_j b_j c_j^(k-1) a_jl = b_l (1 - c_l^k) / k.
  for (int k = 1; k <= 2; ++k) {
    const Vector left = A.transpose() * b.cwiseProduct(power(c, k - 1));
    const Vector right = b.cwiseProduct(Vector::Ones() - power(c, k)) / k;
    EXPECT_LT((left - right).cwiseAbs().maxCoeff(), kRounding) << "D(" << k << ")";
  }
}

TEST(RadauTableau, ErrorOfAnIntegralIsZeroForQuadraticsOnly) {
  for (int power = 0; power <= 3; ++power) {
    double error = power == 0;
    for (int j = 0; j < 3; ++j) error += T::error_of_integral(j) * std::pow(T::c[j], power);
    EXPECT_EQ(std::abs(error) < 1e-14, power < 3) << error;
  }
}

TEST(RadauTableau, InverseIsThatOfA) {
  EXPECT_LT((matrix(T::A) * matrix(T::A_inverse) - Matrix::Identity()).cwiseAbs().maxCoeff(), 3 * kRounding);
}

// Its real eigenvalue, a zero of the denominator 60 - 36 z + 9 z^2 - z^3 of the stability function (Pade's (2, 3)).
TEST(RadauTableau, GammaIsTheEigenvalueOfTheInverse) {
  const double g = T::gamma;
  EXPECT_NEAR(60 - 36 * g + 9 * g * g - g * g * g, 0, 1e-13);
  EXPECT_NEAR((matrix(T::A_inverse) - g * Matrix::Identity()).determinant(), 0, 1e-12);
}

// R(z), the last stage of y' = z y, is that approximant of the exponential, nothing of infinite z, and no more than 1
// on the imaginary axis, and so to the left of it.
TEST(RadauTableau, IsLStable) {
  using Complex = std::complex<double>;
  const Eigen::Matrix3cd A = matrix(T::A).cast<Complex>();
  const auto R = [&](Complex z) {
    const Eigen::Matrix3cd system = Eigen::Matrix3cd::Identity() - z * A;
    const Eigen::Vector3cd stages = system.partialPivLu().solve(Eigen::Vector3cd::Ones());
    return stages[2];
  };
  for (const Complex z : {Complex(-0.1), Complex(-3, 2), Complex(0.2, -5), Complex(-40)}) {
    const Complex pade = (60.0 + 24.0 * z + 3.0 * z * z) / (60.0 - 36.0 * z + 9.0 * z * z - z * z * z);
    EXPECT_LT(std::abs(R(z) - pade), 1e-14) << z;
  }
  EXPECT_LT(std::abs(R(-1e8)), 1e-7);
  for (double y = 1e-3; y < 1e6; y *= 1.05) EXPECT_LE(std::abs(R({0, y})), 1 + 1e-12) << "y = " << y;
}

// Within a step of length dt no stage turns the base by more than dt times the largest |Omega| of the stages: Radau
// accepts steps in which that is below 1 rad, and its sine is right up to 1.1.
TEST(RadauTableau, IntegralsToTheStagesAreNoLongerThanTheStep) {
  EXPECT_LE(matrix(T::A).cwiseAbs().rowwise().sum().maxCoeff(), 1 + kRounding);
}

// The estimate (8.19) is h/gamma f(y_0) + sum_j e_j z_j, with z_j = h sum_l a_jl f_l and e_j = error_j / gamma: what a
// quadrature on the nodes 0, c_1, c_2, 1 is off the method. That quadrature is right to order 3 where the difference
// is nothing for f = 1, t, t^2. By C(3), z_j = (h c_j)^k / k for f = t^(k-1), so that what has to hold is
// 1 + sum error_j c_j = 0 and sum error_j c_j^k = 0 for k = 2 and 3. For t^3 there is a difference, or it would
// estimate nothing.
TEST(RadauTableau, ErrorEstimateHasOrderThree) {
  const Vector e = vector(T::error), c = vector(T::c);
  const double rounding = 4 * kRounding;  // weights of up to 10
  EXPECT_NEAR(1 + e.dot(c), 0, rounding);
  EXPECT_NEAR(e.dot(power(c, 2)), 0, rounding);
  EXPECT_NEAR(e.dot(power(c, 3)), 0, rounding);
  EXPECT_GT(std::abs(e.dot(matrix(T::A) * power(c, 3))), 1e-2);
}

}  // namespace
}  // namespace youbot_base_sim
