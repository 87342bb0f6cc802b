#pragma once

#include <Eigen/Dense>

#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

/// Solves (alpha I - J) u = b for the Jacobian J of a SlipModel, in closed form: phi_i is eliminated from each wheel's
/// block, then the 2x2 blocks of (dphi_i, dgamma_i), four wheels side by side, then the platform's 3x3 remainder; pose,
/// work and gamma follow, since nothing depends on them but the position on the heading.
class BorderedSolver {
 public:
  /// Prepares `solve` for one alpha (1/s). The inertia must outlive the solver.
  void factorize(const BorderedJacobian& jacobian, const Inertia& inertia, double alpha) {
    J_ = &jacobian;
    inertia_ = &inertia;
    beta_ = 1 / alpha;

    const Wheels a11 = alpha * inertia.J_1 - jacobian.dphi_dphi - beta_ * jacobian.dphi_phi;
    const Wheels a12 = -jacobian.dphi_dgamma;
    const Wheels a21 = -jacobian.dphi_dgamma - beta_ * jacobian.dgamma_phi;
    const Wheels a22 = alpha * inertia.J_2 - jacobian.dgamma_dgamma;
    const Wheels scale = 1 / (a11 * a22 - a12 * a21);
    inverse_11_ = scale * a22;
    inverse_12_ = -scale * a12;
    inverse_21_ = -scale * a21;
    inverse_22_ = scale * a11;

    Eigen::Matrix3d S = alpha * inertia.M_v - jacobian.Q_v;
    for (int k = 0; k < 3; ++k) {
      // What (dphi, dgamma) do under a unit of platform velocity k.
      follow_dphi_[k] = inverse_11_ * jacobian.Q_dphi[k] + inverse_12_ * jacobian.Q_dgamma[k];
      follow_dgamma_[k] = inverse_21_ * jacobian.Q_dphi[k] + inverse_22_ * jacobian.Q_dgamma[k];
      Q_dphi_[k] = jacobian.Q_dphi[k] + beta_ * jacobian.Q_phi[k];
    }
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k) {
        S(row, k) -= (Q_dphi_[row] * follow_dphi_[k] + jacobian.Q_dgamma[row] * follow_dgamma_[k]).sum();
      }
    }
    S_inverse_ = S.inverse();
  }

  /// u for the right-hand side `b`; both in the layout of State.
  void solve(const State& b, State& u) const {
    const BorderedJacobian& J = *J_;
    const Wheels phi_0 = beta_ * b.phi();
    const Wheels c_1 = inertia_->J_1 * b.dphi() + J.dphi_phi * phi_0;
    const Wheels c_2 = inertia_->J_2 * b.dgamma() + J.dgamma_phi * phi_0;
    const Wheels dphi_0 = inverse_11_ * c_1 + inverse_12_ * c_2;
    const Wheels dgamma_0 = inverse_21_ * c_1 + inverse_22_ * c_2;

    Eigen::Vector3d c = inertia_->M_v * b.velocity();
    for (int k = 0; k < 3; ++k) {
      c[k] += (J.Q_phi[k] * phi_0 + Q_dphi_[k] * dphi_0 + J.Q_dgamma[k] * dgamma_0).sum();
    }
    const Eigen::Vector3d v = S_inverse_ * c;

    const Wheels dphi = dphi_0 + follow_dphi_[0] * v[0] + follow_dphi_[1] * v[1] + follow_dphi_[2] * v[2];
    const Wheels dgamma = dgamma_0 + follow_dgamma_[0] * v[0] + follow_dgamma_[1] * v[1] + follow_dgamma_[2] * v[2];
    const Wheels phi = phi_0 + beta_ * dphi;
    const double psi = beta_ * (b.psi() + v[2]);
    u.x() = beta_ * (b.x() + J.cos_psi * v[0] - J.sin_psi * v[1] - J.V_y * psi);
    u.y() = beta_ * (b.y() + J.sin_psi * v[0] + J.cos_psi * v[1] + J.V_x * psi);
    u.psi() = psi;
    u.work() = beta_ * (b.work() + J.power_v.dot(v) +
                        (J.power_phi * phi + J.power_dphi * dphi + J.power_dgamma * dgamma).sum());
    u.values.col(1) << v[0], v[1], v[2], 0;
    u.phi() = phi;
    u.dphi() = dphi;
    u.dgamma() = dgamma;
    u.gamma() = beta_ * (b.gamma() + dgamma);
  }

 private:
  const BorderedJacobian* J_ = nullptr;
  const Inertia* inertia_ = nullptr;
  double beta_ = 0;  // 1 / alpha
  Wheels inverse_11_, inverse_12_, inverse_21_, inverse_22_;
  std::array<Wheels, 3> follow_dphi_, follow_dgamma_;
  std::array<Wheels, 3> Q_dphi_;
  Eigen::Matrix3d S_inverse_;
};

}  // namespace youbot_base_sim
