#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/physics/contact_law.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Derivatives of the equations of motion, as blocks: the platform's three velocities couple to each wheel, the wheels
/// not to one another, and nothing depends on the position or on the rollers' angles. Rows of velocities are in force
/// form, that is of M_v d(V_X, V_Y, Omega)/dt, J_1 ddphi and J_2 ddgamma. N, N m and so on by SI units.
struct BorderedJacobian {
  Eigen::Matrix3d Q_v;               ///< platform by platform
  std::array<Wheels, 3> Q_phi;       ///< platform by phi_i
  std::array<Wheels, 3> Q_dphi;      ///< platform by dphi_i, and J_1 ddphi_i by the platform: friction is symmetric
  std::array<Wheels, 3> Q_dgamma;    ///< platform by dgamma_i, and J_2 ddgamma_i by the platform
  Wheels dphi_phi, dphi_dphi;        ///< J_1 ddphi_i by phi_i, dphi_i
  Wheels dphi_dgamma;                ///< J_1 ddphi_i by dgamma_i, and J_2 ddgamma_i by dphi_i
  Wheels dgamma_phi, dgamma_dgamma;  ///< J_2 ddgamma_i by phi_i, dgamma_i
  Eigen::Vector3d power_v;           ///< power by platform
  Wheels power_phi, power_dphi, power_dgamma;
  double cos_psi, sin_psi, V_x, V_y;  ///< heading; velocity of O in the fixed frame, m/s
};

/// What happens at the four contacts: V_P (m/s), F (N), Delta_Y (m), all in the platform's frame.
struct Contacts {
  Wheels V_PX, V_PY;
  Wheels F_X, F_Y;
  Wheels Delta_Y;
};

/// Models 2a and 2b: the equations of motion (4.9) with slipping contacts, for one fixed choice of the rollers that
/// stand on the floor, in which they are smooth. The rollers are given by `roller_angle`, the wheel angles (rad) at
/// which they point straight down, so that phi~ = phi - roller_angle, also somewhat beyond the rollers' edges.
template <class Law>
class SlipModel {
 public:
  SlipModel(const RobotParameters& robot, const FloorParameters& floor);

  /// Time derivative of `state` under the wheel torques `M`, N m.
  void derivative(const State& state, const Wheels& roller_angle, const Wheels& M, State& derivative) const;

  /// Derivatives of all that `derivative` returns, by the state.
  void linearize(const State& state, const Wheels& roller_angle, const Wheels& M, BorderedJacobian& jacobian) const;

  /// Slip, friction and offset of the contact points.
  Contacts contacts(const State& state, const Wheels& roller_angle) const;

  const Inertia& inertia() const { return inertia_; }
  const RollerGeometry& geometry() const { return geometry_; }
  const RobotParameters& robot() const { return robot_; }

 private:
  struct Slip {
    Wheels V_PX, V_PY;
  };
  Slip slip(const State& state, const ContactGeometry& contact) const {
    // (3.3) in its compact form
    return {state.V_X() - (rho_Y_ + contact.Delta_Y) * state.Omega() - robot_.R * state.dphi() -
                contact.r_X * state.dgamma(),
            state.V_Y() + rho_X_ * state.Omega() + contact.r_Y * state.dgamma()};
  }

  RobotParameters robot_;
  RollerGeometry geometry_;
  Law law_;
  Inertia inertia_;
  Wheels rho_X_, rho_Y_;
};

template <class Law>
SlipModel<Law>::SlipModel(const RobotParameters& robot, const FloorParameters& floor)
    : robot_(robot),
      geometry_(robot),
      law_(robot, floor),
      inertia_(robot),
      rho_X_(robot.rho_X()),
      rho_Y_(robot.rho_Y()) {}

template <class Law>
void SlipModel<Law>::derivative(const State& state, const Wheels& roller_angle, const Wheels& M,
                                State& derivative) const {
  const ContactGeometry contact = geometry_.at(state.phi() - roller_angle);
  const Slip V_P = slip(state, contact);
  const ContactForce F = law_.force(V_P.V_PX, V_P.V_PY);

  const Eigen::Vector3d v = state.velocity();
  const Eigen::Vector3d Q =
      inertia_.coriolis(v) +
      Eigen::Vector3d{F.F_X.sum(), F.F_Y.sum(), (F.F_Y * rho_X_ - F.F_X * (rho_Y_ + contact.Delta_Y)).sum()};

  const double cos_psi = std::cos(state.psi()), sin_psi = std::sin(state.psi());
  derivative.x() = v[0] * cos_psi - v[1] * sin_psi;
  derivative.y() = v[0] * sin_psi + v[1] * cos_psi;
  derivative.psi() = v[2];
  derivative.work() = (M * state.dphi() - robot_.mu_1 * state.dphi().square() - robot_.mu_2 * state.dgamma().square() +
                       F.F_X * V_P.V_PX + F.F_Y * V_P.V_PY)
                          .sum();
  derivative.values.col(1).head<3>() = (inertia_.M_v_inverse * Q).array();
  derivative.values(3, 1) = 0;
  derivative.phi() = state.dphi();
  derivative.dphi() = (M - robot_.mu_1 * state.dphi() - robot_.R * F.F_X) * (1 / robot_.J_1);
  derivative.dgamma() = (contact.r_Y * F.F_Y - contact.r_X * F.F_X - robot_.mu_2 * state.dgamma()) * (1 / robot_.J_2);
  derivative.gamma() = state.dgamma();
}

template <class Law>
void SlipModel<Law>::linearize(const State& state, const Wheels& roller_angle, const Wheels& M,
                               BorderedJacobian& jacobian) const {
  const ContactGeometry contact = geometry_.at(state.phi() - roller_angle);
  const Slip V_P = slip(state, contact);
  const ContactForce F = law_.force(V_P.V_PX, V_P.V_PY);
  const ContactStiffness K = law_.stiffness(V_P.V_PX, V_P.V_PY);
  const double R = robot_.R;
  const double V_X = state.V_X(), V_Y = state.V_Y(), Omega = state.Omega();
  const Wheels arm = rho_Y_ + contact.Delta_Y;

  // How V_P moves with phi and dgamma, and the force that answers: -dF = K dV_P.
  const Wheels V_PX_phi = -contact.dDelta_Y * Omega - contact.dr_X * state.dgamma();
  const Wheels V_PY_phi = contact.dr_Y * state.dgamma();
  const Wheels X_phi = K.XX * V_PX_phi + K.XY * V_PY_phi;
  const Wheels Y_phi = K.XY * V_PX_phi + K.YY * V_PY_phi;
  const Wheels X_dgamma = K.XY * contact.r_Y - K.XX * contact.r_X;
  const Wheels Y_dgamma = K.YY * contact.r_Y - K.XY * contact.r_X;

  jacobian.Q_phi = {-X_phi, -Y_phi, arm * X_phi - rho_X_ * Y_phi - F.F_X * contact.dDelta_Y};
  jacobian.Q_dphi = {R * K.XX, R * K.XY, R * (rho_X_ * K.XY - arm * K.XX)};
  jacobian.Q_dgamma = {-X_dgamma, -Y_dgamma, arm * X_dgamma - rho_X_ * Y_dgamma};
  jacobian.dphi_phi = R * X_phi;
  jacobian.dphi_dphi = -robot_.mu_1 - R * R * K.XX;
  jacobian.dphi_dgamma = R * X_dgamma;
  jacobian.dgamma_phi = contact.r_X * X_phi - contact.r_Y * Y_phi - contact.dr_X * F.F_X + contact.dr_Y * F.F_Y;
  jacobian.dgamma_dgamma = contact.r_X * X_dgamma - contact.r_Y * Y_dgamma - robot_.mu_2;

  const Wheels X_Omega = rho_X_ * K.XY - arm * K.XX;
  const Wheels Y_Omega = rho_X_ * K.YY - arm * K.XY;
  const double XX = -K.XX.sum(), XY = -K.XY.sum(), YY = -K.YY.sum();
  const double XO = -X_Omega.sum(), YO = -Y_Omega.sum();
  jacobian.Q_v << XX, XY, XO, XY, YY, YO, XO, YO, (arm * X_Omega - rho_X_ * Y_Omega).sum();
  jacobian.Q_v += inertia_.coriolis_by_velocity(state.velocity());

  // d(F . V_P) = G . dV_P with G = F - K V_P
  const Wheels G_X = F.F_X - K.XX * V_P.V_PX - K.XY * V_P.V_PY;
  const Wheels G_Y = F.F_Y - K.XY * V_P.V_PX - K.YY * V_P.V_PY;
  jacobian.power_v = {G_X.sum(), G_Y.sum(), (rho_X_ * G_Y - arm * G_X).sum()};
  jacobian.power_phi = G_X * V_PX_phi + G_Y * V_PY_phi;
  jacobian.power_dphi = M - 2 * robot_.mu_1 * state.dphi() - R * G_X;
  jacobian.power_dgamma = contact.r_Y * G_Y - contact.r_X * G_X - 2 * robot_.mu_2 * state.dgamma();

  jacobian.cos_psi = std::cos(state.psi());
  jacobian.sin_psi = std::sin(state.psi());
  jacobian.V_x = V_X * jacobian.cos_psi - V_Y * jacobian.sin_psi;
  jacobian.V_y = V_X * jacobian.sin_psi + V_Y * jacobian.cos_psi;
}

template <class Law>
Contacts SlipModel<Law>::contacts(const State& state, const Wheels& roller_angle) const {
  const ContactGeometry contact = geometry_.at(state.phi() - roller_angle);
  const Slip V_P = slip(state, contact);
  const ContactForce F = law_.force(V_P.V_PX, V_P.V_PY);
  return {V_P.V_PX, V_P.V_PY, F.F_X, F.F_Y, contact.Delta_Y};
}

}  // namespace youbot_base_sim
