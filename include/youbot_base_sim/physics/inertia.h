#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Inertia of the robot: the matrix of (V_X, V_Y, Omega) and the wheels' and rollers' own moments (paper, (4.5)), SI.
struct Inertia {
  explicit Inertia(const RobotParameters& robot);

  Eigen::Matrix3d M_v;
  Eigen::Matrix3d M_v_inverse;
  double J_1, J_2;

  /// Forces on v = (V_X, V_Y, Omega) from the rotation of the platform's frame, so that M_v dv/dt = coriolis(v) +
  /// others; N and N m. They do no work.
  Eigen::Vector3d coriolis(const Eigen::Vector3d& v) const {
    const double Omega = v[2];
    return Omega *
           Eigen::Vector3d{m_s_ * v[1] + m_a_X_ * Omega, -m_s_ * v[0] + m_a_Y_ * Omega, -m_a_X_ * v[0] - m_a_Y_ * v[1]};
  }

  /// The matrix times accelerations: forces, N and N m.
  Velocities operator*(const Velocities& a) const {
    return {columns_[0] * a.v[0] + columns_[1] * a.v[1] + columns_[2] * a.v[2], J_1 * a.dphi, J_2 * a.dgamma};
  }

  /// Column k of M_v, with a zero below.
  const Wheels& column(int k) const { return columns_[k]; }

  /// Derivative of `coriolis` by v.
  Eigen::Matrix3d coriolis_by_velocity(const Eigen::Vector3d& v) const {
    const double Omega = v[2];
    Eigen::Matrix3d derivative;
    derivative << 0, m_s_ * Omega, m_s_ * v[1] + 2 * m_a_X_ * Omega,  //
        -m_s_ * Omega, 0, -m_s_ * v[0] + 2 * m_a_Y_ * Omega,          //
        -m_a_X_ * Omega, -m_a_Y_ * Omega, -m_a_X_ * v[0] - m_a_Y_ * v[1];
    return derivative;
  }

 private:
  double m_s_, m_a_X_, m_a_Y_;
  std::array<Wheels, 3> columns_;  // of M_v, with a zero below
};

/// Kinetic energy of `state` in models 2a and 2b, J.
double kinetic_energy(const RobotParameters& robot, const State& state);

}  // namespace youbot_base_sim
