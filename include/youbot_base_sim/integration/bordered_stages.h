#pragma once

#include <Eigen/Dense>
#include <array>
#include <utility>

#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

/// The linear systems of an implicit Runge-Kutta method with s stages,
///
///   sum_l D_jl M u_l + (G_j - C_j) u_j = b_j,   j = 1..s,
///
/// where D (1/s) couples the stages, M is the inertia, G_j the damping matrix and C_j the derivative of the Coriolis
/// forces at stage j. Let v hold the platform's velocities at all stages (3 s numbers) and w_i those of wheel i, dphi
/// and dgamma at each stage (2 s numbers). Wheels are coupled to the platform and not to one another, so the system is
/// bordered:
///
///   [ A_1                  B_1 ] [ w_1 ]   [ b_1 ]      A_i = D (x) diag(J_1, J_2) + G_ii    2 s x 2 s, full
///   [      A_2             B_2 ] [ w_2 ]   [ b_2 ]      B_i: force on wheel i by the platform, one stage by itself
///   [           A_3        B_3 ] [ w_3 ] = [ b_3 ]      E_i: force on the platform by wheel i, the same
///   [                A_4   B_4 ] [ w_4 ]   [ b_4 ]      P   = D (x) M_v + G_vv - C           3 s x 3 s, full
///   [ E_1  E_2  E_3  E_4   P   ] [ v   ]   [ b_v ]
///
/// Eliminating the wheels leaves the platform's Schur complement S, and the wheels follow from v:
///
///   S = P - sum_i E_i A_i^-1 B_i,    S v = b_v - sum_i E_i A_i^-1 b_i,    w_i = A_i^-1 b_i - (A_i^-1 B_i) v.
///
/// `factorize` computes L and U of the four A_i, one lane for each wheel, the columns A_i^-1 B_i, and L and U of S in
/// blocks of 3 x 3. Without pivoting: with the D of a Radau method and friction that only takes energy, none vanish.
template <int s>
class BorderedStages {
 public:
  using Vector = std::array<Velocities, s>;

  /// Takes the stages' damping matrices and Coriolis derivatives.
  void factorize(const double (&D)[s][s], const Inertia& inertia, const std::array<DampingMatrix, s>& G,
                 const std::array<PlatformMatrix, s>& C) {
    set_wheels(D, inertia, G);
    decompose_wheels();
    for (int j = 0; j < s; ++j) {
      for (std::size_t k = 0; k < 3; ++k) {
        platform_dphi_[j][k] = pivot_[2 * j] * G[j].platform_dphi[k];
        platform_dgamma_[j][k] = pivot_[2 * j + 1] * G[j].platform_dgamma[k];
      }
    }
    reduce(D, inertia, G, C, std::make_integer_sequence<int, s>());
    decompose_platform();
  }

  /// Solves for u.
  void solve(const Vector& b, Vector& u) const {
    std::array<Column, 1> columns;
    Column& y = columns[0];
    for (int j = 0; j < s; ++j) {
      y[2 * j] = b[j].dphi;
      y[2 * j + 1] = b[j].dgamma;
    }
    for (int i = 1; i < 2 * s; ++i) {
      for (int k = 0; k < i; ++k) {
        if (!vanishes(i, k)) y[i] -= a_[i][k] * y[k];
      }
    }
    substitute_back(columns);
    std::array<Wheels, s> v;
    for (int j = 0; j < s; ++j) {
      v[j] = b[j].v - forces(y, j);
      for (int l = 0; l < j; ++l) v[j] -= S_[l][j](v[l]);
    }
    for (int j = s - 1; j >= 0; --j) {
      for (int l = s - 1; l > j; --l) v[j] -= S_[l][j](v[l]);
      v[j] = S_[j][j](v[j]);
    }
    for (int m = 3 * s - 1; m >= 0; --m) {  // backwards, since the last stage is known first
      const double unit = v[m / 3][m % 3];
      for (int i = 0; i < 2 * s; ++i) y[i] -= unit * wheels_[m][i];
    }
    for (int j = 0; j < s; ++j) u[j] = {v[j], pivot_[2 * j] * y[2 * j], pivot_[2 * j + 1] * y[2 * j + 1]};
  }

 private:
  using Column = std::array<Wheels, 2 * s>;  // (dphi, dgamma) at stage 1, at stage 2, ...

  // The part of S that couples one stage of the platform to another: 3 x 3.
  struct Block : PlatformMatrix {
    Wheels operator()(const Wheels& v) const { return (*this)[0] * v[0] + (*this)[1] * v[1] + (*this)[2] * v[2]; }
    Block operator*(const Block& other) const { return {(*this)(other[0]), (*this)(other[1]), (*this)(other[2])}; }
    Block& operator-=(const Block& other) {
      for (int k = 0; k < 3; ++k) (*this)[k] -= other[k];
      return *this;
    }
  };

  void set_wheels(const double (&D)[s][s], const Inertia& inertia, const std::array<DampingMatrix, s>& G) {
    for (int j = 0; j < s; ++j) {
      for (int l = 0; l < s; ++l) {
        const double J_1 = D[j][l] * inertia.J_1, J_2 = D[j][l] * inertia.J_2;
        if (j == l) {
          a_[2 * j][2 * l] = J_1 + G[j].dphi_dphi;
          a_[2 * j][2 * l + 1] = G[j].dphi_dgamma;
          a_[2 * j + 1][2 * l] = G[j].dgamma_dphi;
          a_[2 * j + 1][2 * l + 1] = J_2 + G[j].dgamma_dgamma;
        } else {
          a_[2 * j][2 * l] = Wheels::Constant(J_1);
          a_[2 * j][2 * l + 1] = Wheels::Constant(0);
          a_[2 * j + 1][2 * l] = Wheels::Constant(0);
          a_[2 * j + 1][2 * l + 1] = Wheels::Constant(J_2);
        }
      }
    }
  }

  template <int... l>
  void reduce(const double (&D)[s][s], const Inertia& inertia, const std::array<DampingMatrix, s>& G,
              const std::array<PlatformMatrix, s>& C, std::integer_sequence<int, l...>) {
    (reduce_stage<l>(D, inertia, G[l], C[l]), ...);
  }

  // Columns of S for the platform's velocities at stage l.
  template <int l>
  void reduce_stage(const double (&D)[s][s], const Inertia& inertia, const DampingMatrix& G, const PlatformMatrix& C) {
    // Columns of A_i^-1 B_i: the wheels' answer to a unit of each platform velocity at stage l
    std::array<Column, 3> w;
    for (int k = 0; k < 3; ++k) {
      w[k][2 * l] = G.dphi_platform[k];
      w[k][2 * l + 1] = G.dgamma_platform[k] - a_[2 * l + 1][2 * l] * w[k][2 * l];
    }
    for (int i = 2 * l + 2; i < 2 * s; ++i) {
      for (int k = 0; k < 3; ++k) {
        w[k][i] = -a_[i][2 * l + 1] * w[k][2 * l + 1];
        if (!vanishes(i, 2 * l)) w[k][i] -= a_[i][2 * l] * w[k][2 * l];
      }
      for (int m = 2 * l + 2; m < i; ++m) {
        for (int k = 0; k < 3; ++k) w[k][i] -= a_[i][m] * w[k][m];
      }
    }
    for (int i = 2 * l - 1; i >= 0; --i) {
      for (int k = 0; k < 3; ++k) w[k][i] = Wheels::Constant(0);
    }
    substitute_back(w);
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < s; ++j) S_[l][j][k] = D[j][l] * inertia.column(k) - forces(w[k], j);
      const auto& P = G.platform_platform;
      S_[l][l][k] += sums(P[0][k], P[1][k], P[2][k]) - C[k];
      wheels_[3 * l + k] = w[k];
    }
  }

  // True if entry (i, k) of A_i is zero, and so of L and U: the first wheel rate and the other stages' roller rates.
  static constexpr bool vanishes(int i, int k) {
    return (i == 0 && k > 1 && k % 2 == 1) || (k == 0 && i > 1 && i % 2 == 1);
  }

  void decompose_wheels() {
    for (int k = 0; k < 2 * s; ++k) {
      pivot_[k] = 1 / a_[k][k];
      for (int i = k + 1; i < 2 * s; ++i) {
        if (vanishes(i, k)) continue;
        a_[i][k] *= pivot_[k];
        for (int j = k + 1; j < 2 * s; ++j) {
          if (!vanishes(k, j)) a_[i][j] -= a_[i][k] * a_[k][j];
        }
      }
    }
    for (int i = 0; i < 2 * s; ++i) {
      for (int k = i + 1; k < 2 * s; ++k) {
        if (!vanishes(i, k)) a_[i][k] *= pivot_[k];
      }
    }
  }

  // Works on several columns at once, so that the processor does not wait for one. Leaves diag(pivot_) out.
  template <std::size_t n>
  void substitute_back(std::array<Column, n>& y) const {
    for (int i = 2 * s - 1; i >= 0; --i) {
      for (int k = 2 * s - 1; k > i; --k) {  // the entry that is known last comes last
        if (vanishes(i, k)) continue;
        for (Column& column : y) column[i] -= a_[i][k] * column[k];
      }
    }
  }

  // E w: forces on the platform at stage j by the motion diag(pivot_) w of the wheels.
  Wheels forces(const Column& w, int j) const {
    const auto of = [&](int i) -> Wheels {
      return platform_dphi_[j][i] * w[2 * j] + platform_dgamma_[j][i] * w[2 * j + 1];
    };
    return sums(of(0), of(1), of(2));
  }

  // Leaves L below the diagonal of blocks, U above it, and the inverses of U's blocks on it.
  void decompose_platform() {
    for (int k = 0; k < s; ++k) {
      S_[k][k] = {inverse(S_[k][k])};
      for (int i = k + 1; i < s; ++i) {
        const Block L = S_[k][i] * S_[k][k];
        S_[k][i] = L;
        for (int l = k + 1; l < s; ++l) S_[l][i] -= L * S_[l][k];
      }
    }
  }

  // L and U, with ones on both diagonals, of A_i = L U diag(1 / pivot_): a product waits for no pivot.
  alignas(kAlignment) std::array<Column, 2 * s> a_;
  Column pivot_;
  std::array<std::array<Wheels, 3>, s> platform_dphi_, platform_dgamma_;  // E_i diag(pivot_)
  std::array<Column, 3 * s> wheels_;                                      // diag(1 / pivot_) A_i^-1 B_i
  std::array<std::array<Block, s>, s> S_;                                 // L and U of S, [column][row]
};

}  // namespace youbot_base_sim
