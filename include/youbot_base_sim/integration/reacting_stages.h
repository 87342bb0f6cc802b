#pragma once

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/physics/reactions.h"

namespace youbot_base_sim {

/// The linear systems of BorderedStages for normal reactions that follow the motion. With K the bordered matrix, for
/// reactions that stay, and a ReactionCoupling at each stage, they are
///
///   K u - U y = b,   y = B u,
///
/// where the columns of U are the couplings' `forces` and the rows of B their `balance`: at most 3 s of them. y is what
/// moments the conditions on the reactions must bear more, which follows from the solution u_0 = K^-1 b for reactions
/// that stay (Woodbury's formula):
///
///   (1 - B K^-1 U) y = B u_0,   u = u_0 + (K^-1 U) y.
///
/// `factorize` computes K^-1 U (answers_) and the inverse of 1 - B K^-1 U (inverse_), which is near 1: friction moves
/// reactions by less than f h / l of what they move friction, with h the height of the centre of mass over the floor. So
/// no pivots are needed.
template <int s>
class ReactingStages {
 public:
  using Vector = typename BorderedStages<s>::Vector;
  using Couplings = std::array<ReactionCoupling, s>;

  /// `frozen` is factorized.
  void factorize(const BorderedStages<s>& frozen, const Couplings& couplings) {
    couplings_ = couplings;
    size_ = couplings[0].size;
    for (int j = 0; j < s; ++j) {
      for (int m = 0; m < size_; ++m) {
        const int q = kMaxSize * j + m;
        Vector force;
        force.fill({Wheels::Zero(), Wheels::Zero(), Wheels::Zero()});
        force[j] = couplings[j].forces[m];
        frozen.solve(force, answers_[q]);
        inverse_[q] = moments(answers_[q]);
        for (Wheels& entry : inverse_[q]) entry = -entry;
        inverse_[q][j][m] += 1;
      }
    }
    invert();
  }

  /// Turns u_0 into u, and tells by how much the reactions change at each stage.
  void correct(Vector& u, std::array<Wheels, s>& dN) const {
    const Moments right = moments(u);
    Moments y;
    y.fill(Wheels::Zero());
    each([&](int, int j, int m) {
      for (int l = 0; l < s; ++l) y[l] += right[j][m] * inverse_[kMaxSize * j + m][l];
    });
    dN.fill(Wheels::Zero());
    each([&](int q, int j, int m) {
      for (int l = 0; l < s; ++l) u[l] = u[l] + y[j][m] * answers_[q][l];
      dN[j] += y[j][m] * couplings_[j].N[m];
    });
  }

 private:
  static constexpr int kMaxSize = ReactionCoupling::kMaxSize;
  using Moments = std::array<Wheels, s>;  // of each condition, stage by stage

  // Calls f(q, j, m) for condition m at stage j, which has the number q.
  template <class Function>
  void each(const Function& f) const {
    for (int j = 0; j < s; ++j) {
      for (int m = 0; m < size_; ++m) f(kMaxSize * j + m, j, m);
    }
  }

  // B u
  Moments moments(const Vector& u) const {
    Moments y;
    for (int j = 0; j < s; ++j) {
      const auto& b = couplings_[j].balance;
      const auto product = [&](int m) -> Wheels {
        return b[m].v * u[j].v + b[m].dphi * u[j].dphi + b[m].dgamma * u[j].dgamma;
      };
      y[j] = sums(product(0), product(1), size_ < kMaxSize ? Wheels(Wheels::Zero()) : product(2));
    }
    return y;
  }

  // Gauss and Jordan's, in place.
  void invert() {
    each([&](int p, int j, int m) {
      Moments& column = inverse_[p];
      const double per_pivot = 1 / column[j][m];
      each([&](int q, int, int) {
        if (q == p) return;
        const double factor = inverse_[q][j][m] * per_pivot;
        for (int l = 0; l < s; ++l) inverse_[q][l] -= factor * column[l];
        inverse_[q][j][m] = factor;
      });
      for (Wheels& entry : column) entry *= -per_pivot;
      column[j][m] = per_pivot;
    });
  }

  int size_ = 0;
  Couplings couplings_;
  alignas(kAlignment) std::array<Vector, kMaxSize * s> answers_;
  std::array<Moments, kMaxSize * s> inverse_;
};

}  // namespace youbot_base_sim
