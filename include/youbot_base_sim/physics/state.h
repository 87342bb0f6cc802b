#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>

#include "youbot_base_sim/physics/elementary.h"

#ifdef __AVX__
#include <immintrin.h>
#endif

namespace youbot_base_sim {

constexpr int kWheels = 4;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// One number for each wheel: front-left, front-right, rear-left, rear-right; also the four lanes of the physics.
/// Not aligned, so that its layout does not depend on a program's instruction set.
using Wheels = Eigen::Array<double, kWheels, 1, Eigen::DontAlign>;

/// True if something holds for each wheel.
using WheelMask = Eigen::Array<bool, kWheels, 1>;

/// Alignment of the operands of inner loops: four doubles never straddle a cache line.
constexpr std::size_t kAlignment = 32;

// The order of Eigen's own sums and products of matrices depends on the instruction set.

/// The sum of four entries.
inline double sum(const Wheels& w) { return (w[0] + w[1]) + (w[2] + w[3]); }

/// The sums of three times four entries, and a zero.
inline Wheels sums(const Wheels& a, const Wheels& b, const Wheels& c) {
#ifdef __AVX__
  const __m256d ab = _mm256_hadd_pd(_mm256_loadu_pd(a.data()), _mm256_loadu_pd(b.data()));
  const __m256d c0 = _mm256_hadd_pd(_mm256_loadu_pd(c.data()), _mm256_setzero_pd());
  Wheels result;
  _mm256_storeu_pd(result.data(),
                   _mm256_add_pd(_mm256_permute2f128_pd(ab, c0, 0x20), _mm256_permute2f128_pd(ab, c0, 0x31)));
  return result;
#else
  return {sum(a), sum(b), sum(c), 0};
#endif
}

/// The product of small matrices.
template <class A, class B>
Eigen::Matrix<double, A::RowsAtCompileTime, B::ColsAtCompileTime> product(const Eigen::MatrixBase<A>& a,
                                                                          const Eigen::MatrixBase<B>& b) {
  Eigen::Matrix<double, A::RowsAtCompileTime, B::ColsAtCompileTime> product;
  for (int j = 0; j < b.cols(); ++j) {
    for (int i = 0; i < a.rows(); ++i) {
      product(i, j) = a(i, 0) * b(0, j);
      for (int k = 1; k < a.cols(); ++k) product(i, j) += a(i, k) * b(k, j);
    }
  }
  return product;
}

/// Suffixes of the driver's joint names in wheel order: `wheel_joint_fl` and so on.
constexpr std::array<const char*, kWheels> kWheelNames = {"fl", "fr", "bl", "br"};

/// The velocities of the equations of motion, or the forces on them, N and N m, or their accelerations.
struct alignas(kAlignment) Velocities {
  Wheels v;       ///< (V_X, V_Y, Omega, 0), m/s and rad/s, in the platform's frame
  Wheels dphi;    ///< of each wheel, rad/s
  Wheels dgamma;  ///< of each roller in contact, rad/s
};

inline Velocities operator+(const Velocities& a, const Velocities& b) {
  return {a.v + b.v, a.dphi + b.dphi, a.dgamma + b.dgamma};
}
inline Velocities operator-(const Velocities& a, const Velocities& b) {
  return {a.v - b.v, a.dphi - b.dphi, a.dgamma - b.dgamma};
}
inline Velocities operator*(double factor, const Velocities& a) {
  return {factor * a.v, factor * a.dphi, factor * a.dgamma};
}

/// Sum of the products of all entries: the power of forces on velocities, W.
inline double dot(const Velocities& a, const Velocities& b) {
  return sum(a.v * b.v + a.dphi * b.dphi + a.dgamma * b.dgamma);
}

/// Pose of O in the fixed frame, m, with cosine and sine of the heading.
struct Pose {
  double x = 0, y = 0, cosine = 1, sine = 0;
};

/// The variables of the equations of motion in one array, so that a stepper's sums are plain arithmetic on `values`.
///
///   column  0     x, y (m), psi (rad, unwrapped): pose of O in the fixed frame; row 3: work (J)
///           1     V_X, V_Y (m/s), Omega (rad/s): velocity in the platform's frame; row 3: unused, zero
///           2..5  phi (rad), dphi (rad/s), dgamma (rad/s), gamma (rad), one row for each wheel
///
/// `work` integrates the power of all torques and friction forces: it mirrors the change of kinetic energy, and so
/// audits the integration. `gamma` is the angle of the roller in contact.
struct State {
  using Values = Eigen::Array<double, 4, 6, Eigen::DontAlign>;
  Values values = Values::Zero();

  /// Index of each quantity's first entry in the 24 numbers of `values`, column by column.
  enum Index { kX = 0, kY, kPsi, kWork, kV, kOmega = 6, kPhi = 8, kDphi = 12, kDgamma = 16, kGamma = 20, kSize = 24 };

  double& x() { return values(0, 0); }
  double& y() { return values(1, 0); }
  double& psi() { return values(2, 0); }
  double& work() { return values(3, 0); }
  double& V_X() { return values(0, 1); }
  double& V_Y() { return values(1, 1); }
  double& Omega() { return values(2, 1); }
  auto phi() { return values.col(2); }
  auto dphi() { return values.col(3); }
  auto dgamma() { return values.col(4); }
  auto gamma() { return values.col(5); }

  double x() const { return values(0, 0); }
  double y() const { return values(1, 0); }
  double psi() const { return values(2, 0); }
  double work() const { return values(3, 0); }
  double V_X() const { return values(0, 1); }
  double V_Y() const { return values(1, 1); }
  double Omega() const { return values(2, 1); }
  auto phi() const { return values.col(2); }
  auto dphi() const { return values.col(3); }
  auto dgamma() const { return values.col(4); }
  auto gamma() const { return values.col(5); }

  Pose pose() const {
    const auto [sine, cosine] = sine_and_cosine(psi());
    return {x(), y(), cosine, sine};
  }
  Velocities velocities() const { return {values.col(1), values.col(3), values.col(4)}; }
  void set(const Velocities& u) {
    values.col(1) = u.v;
    values.col(3) = u.dphi;
    values.col(4) = u.dgamma;
  }

  // The range of 24 numbers on which odeint's algebras work.
  using value_type = double;
  using iterator = double*;
  using const_iterator = const double*;
  iterator begin() { return values.data(); }
  iterator end() { return values.data() + values.size(); }
  const_iterator begin() const { return values.data(); }
  const_iterator end() const { return values.data() + values.size(); }

  /// (V_X, V_Y, Omega)
  Eigen::Vector3d velocity() const { return values.col(1).head<3>().matrix(); }
};

}  // namespace youbot_base_sim
