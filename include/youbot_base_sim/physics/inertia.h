#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Columns of a matrix that maps (V_X, V_Y, Omega), with a zero below each.
using PlatformMatrix = std::array<Wheels, 3>;

/// The inverse, by cofactors with one division.
inline PlatformMatrix inverse(const PlatformMatrix& m) {
  const auto cross = [](const Wheels& a, const Wheels& b) {
    return std::array<double, 3>{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto x = cross(m[1], m[2]), y = cross(m[2], m[0]), z = cross(m[0], m[1]);
  const double f = 1 / (m[0][0] * x[0] + m[0][1] * x[1] + m[0][2] * x[2]);
  return {f * Wheels{x[0], y[0], z[0], 0}, f * Wheels{x[1], y[1], z[1], 0}, f * Wheels{x[2], y[2], z[2], 0}};
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
