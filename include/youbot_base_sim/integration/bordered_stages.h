#pragma once

#include <Eigen/Dense>
#include <array>
#include <utility>

#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

/// Solves for the stages u_1 ... u_s of an implicit Runge-Kutta method
///
///   sum_l D_jl M u_l + (G_j - C_j) u_j = b_j,   j = 1..s
///
/// where the matrix D (1/s) couples the stages, M is the inertia, G_j the Resistance and C_j the derivative of the
/// Coriolis forces at stage j. Wheels couple to the platform and not to one another: each wheel's block of order 2 s is
/// eliminated, four wheels side by side, then the platform's, of order 3 s, is inverted. Neither looks for pivots: with
/// the D of a Radau method, and friction that takes energy, none vanish.
template <int s>
class BorderedStages {
 public:
  using Vector = std::array<Velocities, s>;

  void factorize(const double (&D)[s][s], const Inertia& inertia, const std::array<Resistance, s>& G,
                 const std::array<Eigen::Matrix3d, s>& C) {
    set_wheels(D, inertia, G);
    decompose_wheels();
    reduce(D, inertia, G, C, std::make_integer_sequence<int, s>());
    invert_platform();
  }

  void solve(const Vector& b, Vector& u) const {
    Column y;
    for (int j = 0; j < s; ++j) {
      y[2 * j] = b[j].dphi;
      y[2 * j + 1] = b[j].dgamma;
    }
#pragma GCC unroll 8
    for (int i = 1; i < 2 * s; ++i) {
#pragma GCC unroll 8
      for (int k = 0; k < i; ++k) y[i] -= a_[i][k] * y[k];
    }
    substitute_back(y);
    std::array<Wheels, s> v;
#pragma GCC unroll 8
    for (int l = 0; l < s; ++l) {
      const Wheels c = b[l].v - forces(y, l);
#pragma GCC unroll 8
      for (int j = 0; j < s; ++j) {
        const Wheels part = c[0] * S_[3 * l][j] + c[1] * S_[3 * l + 1][j] + c[2] * S_[3 * l + 2][j];
        v[j] = l == 0 ? part : v[j] + part;
      }
    }
#pragma GCC unroll 16
    for (int m = 0; m < 3 * s; ++m) {
      const double unit = v[m / 3][m % 3];
#pragma GCC unroll 8
      for (int i = 0; i < 2 * s; ++i) y[i] -= unit * wheels_[m][i];
    }
    for (int j = 0; j < s; ++j) u[j] = {v[j], y[2 * j], y[2 * j + 1]};
  }

 private:
  using Column = std::array<Wheels, 2 * s>;  // (dphi, dgamma) of stage 1, of stage 2, ...

  void set_wheels(const double (&D)[s][s], const Inertia& inertia, const std::array<Resistance, s>& G) {
#pragma GCC unroll 8
    for (int j = 0; j < s; ++j) {
#pragma GCC unroll 8
      for (int l = 0; l < s; ++l) {
        const double J_1 = D[j][l] * inertia.J_1, J_2 = D[j][l] * inertia.J_2;
        if (j == l) {
          a_[2 * j][2 * l] = J_1 + G[j].dphi_dphi;
          a_[2 * j][2 * l + 1] = G[j].dphi_dgamma;
          a_[2 * j + 1][2 * l] = G[j].dphi_dgamma;
          a_[2 * j + 1][2 * l + 1] = J_2 + G[j].dgamma_dgamma;
        } else {
          a_[2 * j][2 * l] = Wheels::Constant(J_1);
          a_[2 * j][2 * l + 1] = Wheels::Constant(0);
          a_[2 * j + 1][2 * l] = Wheels::Constant(0);
          a_[2 * j + 1][2 * l + 1] = Wheels::Constant(J_2);
        }
      }
      platform_dphi_[j] = G[j].platform_dphi;
      platform_dgamma_[j] = G[j].platform_dgamma;
    }
  }

  template <int... l>
  void reduce(const double (&D)[s][s], const Inertia& inertia, const std::array<Resistance, s>& G,
              const std::array<Eigen::Matrix3d, s>& C, std::integer_sequence<int, l...>) {
    (reduce_stage<l>(D, inertia, G[l], C[l]), ...);
  }

  // Columns of the platform's remainder for its velocities at stage l.
  template <int l>
  void reduce_stage(const double (&D)[s][s], const Inertia& inertia, const Resistance& G, const Eigen::Matrix3d& C) {
    for (int k = 0; k < 3; ++k) {
      // What the wheels do under a unit of platform velocity k at stage l
      Column w;
      w[2 * l] = G.dphi_platform[k];
      w[2 * l + 1] = G.dgamma_platform[k] - a_[2 * l + 1][2 * l] * w[2 * l];
#pragma GCC unroll 8
      for (int i = 2 * l + 2; i < 2 * s; ++i) {
        w[i] = -a_[i][2 * l] * w[2 * l] - a_[i][2 * l + 1] * w[2 * l + 1];
#pragma GCC unroll 8
        for (int m = 2 * l + 2; m < i; ++m) w[i] -= a_[i][m] * w[m];
      }
#pragma GCC unroll 8
      for (int i = 2 * l - 1; i >= 0; --i) w[i] = Wheels::Constant(0);
      substitute_back(w);
      std::array<Wheels, s>& S = S_[3 * l + k];
#pragma GCC unroll 8
      for (int j = 0; j < s; ++j) S[j] = D[j][l] * inertia.column(k) - forces(w, j);
      const auto& P = G.platform_platform;
      S[l] += sums(P[0][k], P[1][k], P[2][k]) - Wheels{C(0, k), C(1, k), C(2, k), 0};
      wheels_[3 * l + k] = w;
    }
  }

  void decompose_wheels() {
#pragma GCC unroll 8
    for (int k = 0; k < 2 * s; ++k) {
      pivot_[k] = 1 / a_[k][k];
#pragma GCC unroll 8
      for (int i = k + 1; i < 2 * s; ++i) {
        a_[i][k] *= pivot_[k];
#pragma GCC unroll 8
        for (int j = k + 1; j < 2 * s; ++j) a_[i][j] -= a_[i][k] * a_[k][j];
      }
    }
  }

  void substitute_back(Column& y) const {
#pragma GCC unroll 8
    for (int i = 2 * s - 1; i >= 0; --i) {
#pragma GCC unroll 8
      for (int k = i + 1; k < 2 * s; ++k) y[i] -= a_[i][k] * y[k];
      y[i] *= pivot_[i];
    }
  }

  // Forces on the platform by what the wheels do at stage j.
  Wheels forces(const Column& w, int j) const {
    const auto of = [&](int i) -> Wheels {
      return platform_dphi_[j][i] * w[2 * j] + platform_dgamma_[j][i] * w[2 * j + 1];
    };
    return sums(of(0), of(1), of(2));
  }

  // Gauss and Jordan, in place: S_[column][stage][row] becomes its inverse.
  void invert_platform() {
#pragma GCC unroll 16
    for (int k = 0; k < 3 * s; ++k) {
      const int stage = k / 3, row = k % 3;
      const double pivot = 1 / S_[k][stage][row];
      Wheels keep = Wheels::Ones(), place = Wheels::Zero();
      keep[row] = 0;
      place[row] = pivot;
      std::array<Wheels, s> column;
      for (int j = 0; j < s; ++j) column[j] = -pivot * S_[k][j];
      column[stage] = column[stage] * keep + place;
#pragma GCC unroll 16
      for (int m = 0; m < 3 * s; ++m) {
        if (m == k) continue;
        const double head = S_[m][stage][row];
#pragma GCC unroll 8
        for (int j = 0; j < s; ++j) {
          S_[m][j] = (j == stage ? Wheels(S_[m][j] * keep) : S_[m][j]) + head * column[j];
        }
      }
      S_[k] = column;
    }
  }

  std::array<Column, 2 * s> a_;  // L and U
  Column pivot_;                 // inverse
  std::array<std::array<Wheels, 3>, s> platform_dphi_, platform_dgamma_;
  std::array<Column, 3 * s> wheels_;
  std::array<std::array<Wheels, s>, 3 * s> S_;
};

}  // namespace youbot_base_sim
