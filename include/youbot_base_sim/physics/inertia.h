#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Columns of a matrix that maps (V_X, V_Y, Omega), with a zero below each.
using PlatformMatrix = std::array<Wheels, 3>;

/// (w[1], w[2], w[0], w[3])
inline Wheels rotated(const Wheels& w) {
#ifdef __AVX2__
  Wheels result;
  _mm256_storeu_pd(result.data(), _mm256_permute4x64_pd(_mm256_loadu_pd(w.data()), 0b11001001));
  return result;
#else
  return {w[1], w[2], w[0], w[3]};
#endif
}

/// The matrix with these rows.
inline PlatformMatrix transposed(const Wheels& x, const Wheels& y, const Wheels& z) {
#ifdef __AVX__
  const __m256d a = _mm256_loadu_pd(x.data()), b = _mm256_loadu_pd(y.data()), c = _mm256_loadu_pd(z.data()),
                zero = _mm256_setzero_pd(), ab = _mm256_unpacklo_pd(a, b), c0 = _mm256_unpacklo_pd(c, zero);
  PlatformMatrix m;
  _mm256_storeu_pd(m[0].data(), _mm256_permute2f128_pd(ab, c0, 0x20));
  _mm256_storeu_pd(m[1].data(), _mm256_permute2f128_pd(_mm256_unpackhi_pd(a, b), _mm256_unpackhi_pd(c, zero), 0x20));
  _mm256_storeu_pd(m[2].data(), _mm256_permute2f128_pd(ab, c0, 0x31));
  return m;
#else
  return {Wheels{x[0], y[0], z[0], 0}, Wheels{x[1], y[1], z[1], 0}, Wheels{x[2], y[2], z[2], 0}};
#endif
}

/// The inverse, by cofactors with one division.
inline PlatformMatrix inverse(const PlatformMatrix& m) {
  const Wheels m0 = rotated(m[0]), m1 = rotated(m[1]), m2 = rotated(m[2]);
  // Rows, as products of the columns' vectors
  const Wheels x = rotated(m[1] * m2 - m1 * m[2]), y = rotated(m[2] * m0 - m2 * m[0]),
               z = rotated(m[0] * m1 - m0 * m[1]), terms = m[0] * x;
  const double f = 1 / (terms[0] + terms[1] + terms[2]);
  return transposed(f * x, f * y, f * z);
}
Eigen::Matrix3d inverse(const Eigen::Matrix3d& m);

/// Inertia of the robot: the matrix of (V_X, V_Y, Omega) and the wheels' and rollers' own moments (paper, (4.5)), SI.
struct Inertia {
  explicit Inertia(const RobotParameters& robot);

  Eigen::Matrix3d M_v;
  Eigen::Matrix3d M_v_inverse;
  double J_1, J_2;

  /// Forces on v = (V_X, V_Y, Omega, 0) from the rotation of the platform's frame, so that M_v dv/dt = coriolis(v) +
  /// others; N and N m. They do no work.
  Wheels coriolis(const Wheels& v) const { return v[2] * turned(v); }

  /// The matrix times accelerations: forces, N and N m.
  Velocities operator*(const Velocities& a) const {
    return {columns_[0] * a.v[0] + columns_[1] * a.v[1] + columns_[2] * a.v[2], J_1 * a.dphi, J_2 * a.dgamma};
  }

  /// Column k of M_v, with a zero below.
  const Wheels& column(int k) const { return columns_[k]; }

  /// Derivative of `coriolis` by v.
  PlatformMatrix coriolis_derivative(const Wheels& v) const {
    return {v[2] * turning_[0], v[2] * turning_[1], v[2] * turning_[2] + turned(v)};
  }

 private:
  Wheels turned(const Wheels& v) const { return v[0] * turning_[0] + v[1] * turning_[1] + v[2] * turning_[2]; }

  alignas(kAlignment) PlatformMatrix columns_;  // of M_v
  PlatformMatrix turning_;                      // of the Coriolis forces by v, for Omega = 1
};

/// Kinetic energy of `state` in models 2a and 2b, J.
double kinetic_energy(const RobotParameters& robot, const State& state);

}  // namespace youbot_base_sim
