#pragma once

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/physics/reactions.h"

namespace youbot_base_sim {

/// The linear systems of BorderedStages for normal reactions that follow the motion, K u - U y = b with y = B u
/// (docs/method.md): the columns of U are the couplings' `forces`, the rows of B their `balance`, and y has at most 3 s
/// moments. B K^-1 U is below f h / l, with the centre of mass h above the floor: minimal residuals converge within one
/// to three substitutions with K, which take less than the columns of K^-1 U would.
template <int s>
class ReactingStages {
 public:
  using Vector = typename BorderedStages<s>::Vector;
  using Couplings = std::array<ReactionCoupling, s>;

  /// Turns u from u_0 into the solution; dN is the change of the reactions at each stage, N. `K` is factorized.
  static void correct(const BorderedStages<s>& K, const Couplings& couplings, Vector& u, std::array<Wheels, s>& dN) {
    Moments left = moments(couplings, u), y;
    y.fill(Wheels::Zero());
    const double enough = kEnough * kEnough * product(left, left);
    for (int iteration = 0; iteration < 3 * s; ++iteration) {  // y has 3 s components
      Vector change;
      K.solve(forces(couplings, left), change);
      const Moments answered = moments(couplings, change);
      Moments fall;  // of what is left, if all of it is added to y
      for (int j = 0; j < s; ++j) fall[j] = left[j] - answered[j];
      const double length = product(fall, left) / std::max(product(fall, fall), std::numeric_limits<double>::min());
      for (int j = 0; j < s; ++j) {
        u[j] = u[j] + length * change[j];
        y[j] += length * left[j];
        left[j] -= length * fall[j];
      }
      if (!(product(left, left) > enough)) break;
    }
    for (int j = 0; j < s; ++j) {
      const auto& N = couplings[j].N;
      dN[j] = y[j][0] * N[0] + y[j][1] * N[1] + y[j][2] * N[2];
    }
  }

 private:
  using Moments = std::array<Wheels, s>;  // three at each stage

  static constexpr double kEnough = 0.02;

  static double product(const Moments& a, const Moments& b) {
    Wheels products = Wheels::Zero();
    for (int j = 0; j < s; ++j) products += a[j] * b[j];
    return sum(products);
  }

  // B u
  static Moments moments(const Couplings& couplings, const Vector& u) {
    Moments y;
    for (int j = 0; j < s; ++j) {
      const auto product = [&](const Velocities& row) -> Wheels {
        return row.v * u[j].v + row.dphi * u[j].dphi + row.dgamma * u[j].dgamma;
      };
      const auto& rows = couplings[j].balance;
      y[j] = sums(product(rows[0]), product(rows[1]), product(rows[2]));
    }
    return y;
  }

  // U y
  static Vector forces(const Couplings& couplings, const Moments& y) {
    Vector b;
    for (int j = 0; j < s; ++j) {
      const auto& columns = couplings[j].forces;
      b[j] = y[j][0] * columns[0] + y[j][1] * columns[1] + y[j][2] * columns[2];
    }
    return b;
  }
};

}  // namespace youbot_base_sim
