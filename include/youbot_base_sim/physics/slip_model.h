#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/physics/contact_law.h"
#include "youbot_base_sim/physics/contacts.h"
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

/// Power of forces `Q` on the velocities `u`, W. Coriolis forces have none.
inline double power(const Velocities& u, const Velocities& Q) {
  return (u.v * Q.v + u.dphi * Q.dphi + u.dgamma * Q.dgamma).sum();
}

/// -d(forces)/d(velocities) at fixed positions, but for the Coriolis forces: what friction and damping hold against a
/// motion. One entry for each wheel; `platform_dphi[i]` is the force on platform velocity i by dphi, `dphi_platform[k]`
/// that on dphi by platform velocity k, and so on. N s/m and so on by SI units.
struct alignas(kAlignment) Resistance {
  std::array<std::array<Wheels, 3>, 3> platform_platform;
  std::array<Wheels, 3> platform_dphi, platform_dgamma;
  std::array<Wheels, 3> dphi_platform, dgamma_platform;
  Wheels dphi_dphi, dphi_dgamma, dgamma_dgamma;  ///< dgamma_dphi is dphi_dgamma
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

  /// Slip, friction and place of the contact points.
  Contacts contacts(const State& state, const Wheels& roller_angle) const {
    return contacts(state.velocities(), state.phi() - roller_angle);
  }

  // The same equations in the parts that an implicit method needs. `phi_tilde` is phi - roller_angle, rad.

  Contacts contacts(const Velocities& u, const Wheels& phi_tilde) const {
    Contacts c;
    contacts(u, phi_tilde, c);
    return c;
  }
  void contacts(const Velocities& u, const Wheels& phi_tilde, Contacts& c) const {
    const ContactGeometry geometry = geometry_.at(phi_tilde);
    c.Delta_Y = geometry.Delta_Y;
    c.r_X = geometry.r_X;
    c.r_Y = geometry.r_Y;
    // (3.3) in its compact form
    c.V_PX = u.v[0] - (rho_Y_ + c.Delta_Y) * u.v[2] - robot_.R * u.dphi - c.r_X * u.dgamma;
    c.V_PY = u.v[1] + rho_X_ * u.v[2] + c.r_Y * u.dgamma;
    const ContactForce F = law_.force(c.V_PX, c.V_PY);
    c.F_X = F.F_X;
    c.F_Y = F.F_Y;
    set_moment(c);
  }

  /// Sets the moment by the other entries.
  void set_moment(Contacts& c) const { c.M_Z = c.F_Y * rho_X_ - c.F_X * (rho_Y_ + c.Delta_Y); }

  /// Sets G to the derivative of `forces`, where the contacts are `c`.
  void resistance(const Contacts& c, Resistance& G) const { resistance(c, law_.stiffness(c.V_PX, c.V_PY), G); }

  /// The same for friction that is taken to be F, not yet the one of c's slip: see the law.
  void resistance(const Contacts& c, const ContactForce& F, Resistance& G) const {
    resistance(c, law_.stiffness(c.V_PX, c.V_PY, F), G);
  }

  /// Friction when the velocities have changed by du from where the contacts are `c`, by that derivative.
  ContactForce friction_after(const Contacts& c, const ContactForce& F, const Velocities& du) const {
    const ContactStiffness K = law_.stiffness(c.V_PX, c.V_PY, F);
    const Wheels dX = du.v[0] - (rho_Y_ + c.Delta_Y) * du.v[2] - robot_.R * du.dphi - c.r_X * du.dgamma;
    const Wheels dY = du.v[1] + rho_X_ * du.v[2] + c.r_Y * du.dgamma;
    return law_.bounded({c.F_X - K.XX * dX - K.XY * dY, c.F_Y - K.XY * dX - K.YY * dY});
  }

  /// F, shortened to what friction can bear.
  ContactForce bounded(const ContactForce& F) const { return law_.bounded(F); }

  /// Velocities that slip as fast as friction takes to turn; infinite where it does not.
  Velocities turning_point() const {
    const double speed = law_.turning_speed();
    return {Wheels::Constant(speed), Wheels::Constant(speed / robot_.R),
            Wheels::Constant(speed / (robot_.R - robot_.R_d))};
  }

  /// Right-hand sides of (4.9): forces on the velocities under the wheel torques `M` (N m), N and N m.
  Velocities forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    return {sums(c.F_X, c.F_Y, c.M_Z) + inertia_.coriolis(u.v), M - robot_.mu_1 * u.dphi - robot_.R * c.F_X,
            c.r_Y * c.F_Y - c.r_X * c.F_X - robot_.mu_2 * u.dgamma};
  }

  /// A wheel that stands on two rollers at once, by the edge between them, where each alone would drive it back to the
  /// other: dphi = 0, and the friction is alpha that of the upper roller plus 1 - alpha that of the lower one, with the
  /// alpha that keeps it there, J_1 ddphi = 0 (A. F. Filippov, Differential Equations with Discontinuous Righthand
  /// Sides, 1988). Here for wheel i under the torque M (N m), where dphi_i must be zero.
  class SharedContact {
   public:
    SharedContact(const SlipModel& model, int i, const Velocities& u, double M)
        : model_(model),
          i_(i),
          lower_(model.contacts(u, Wheels::Constant(0.5 * model.geometry().pitch()))),
          upper_(model.contacts(u, Wheels::Constant(-0.5 * model.geometry().pitch()))),
          alpha_((M / model.robot().R - lower_.F_X[i]) / (upper_.F_X[i] - lower_.F_X[i])) {}

    /// The upper roller's share; the wheel is held where it lies from 0 to 1. Not finite where both pull alike.
    double alpha() const { return alpha_; }

    /// Whether the rollers drive the wheel back to the edge, rather than away from it.
    bool holds() const { return alpha_ >= 0 && alpha_ <= 1 && upper_.F_X[i_] > lower_.F_X[i_]; }

    /// Sets the wheel's entries. Slip and offset become means, as the friction does.
    void put(Contacts& c) const {
      for (Wheels Contacts::*entry :
           {&Contacts::V_PX, &Contacts::V_PY, &Contacts::F_X, &Contacts::F_Y, &Contacts::Delta_Y, &Contacts::M_Z}) {
        (c.*entry)[i_] = alpha_ * (upper_.*entry)[i_] + (1 - alpha_) * (lower_.*entry)[i_];
      }
    }

    /// Sets the wheel's entries: each roller's own, by their shares, and the shares' change.
    void put(Resistance& G) const {
      Resistance upper, lower;
      model_.resistance(upper_, upper);
      model_.resistance(lower_, lower);
      // Forces on V_X, V_Y, Omega and dgamma by the same
      const auto matrix = [this](const Resistance& g) {
        Eigen::Matrix4d m;
        for (int row = 0; row < 3; ++row) {
          for (int k = 0; k < 3; ++k) m(row, k) = g.platform_platform[row][k][i_];
          m(row, 3) = g.platform_dgamma[row][i_];
          m(3, row) = g.dgamma_platform[row][i_];
        }
        m(3, 3) = g.dgamma_dgamma[i_];
        return m;
      };
      const Eigen::Matrix4d m = alpha_ * matrix(upper) + (1 - alpha_) * matrix(lower);
      const Eigen::RowVector4d F_X = alpha_ * matrix(upper).row(0) + (1 - alpha_) * matrix(lower).row(0);
      const Eigen::Matrix4d all = m - (forces(upper_) - forces(lower_)) * F_X / (upper_.F_X[i_] - lower_.F_X[i_]);
      for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) G.platform_platform[row][k][i_] = all(row, k);
        G.platform_dgamma[row][i_] = all(row, 3);
        G.dgamma_platform[row][i_] = all(3, row);
        G.platform_dphi[row][i_] = G.dphi_platform[row][i_] = 0;
      }
      G.dgamma_dgamma[i_] = all(3, 3);
      G.dphi_dphi[i_] = model_.robot().mu_1[i_];
      G.dphi_dgamma[i_] = 0;
    }

   private:
    Eigen::Vector4d forces(const Contacts& c) const {
      return {c.F_X[i_], c.F_Y[i_], c.M_Z[i_], c.r_Y[i_] * c.F_Y[i_] - c.r_X[i_] * c.F_X[i_]};
    }

    const SlipModel& model_;
    int i_;
    Contacts lower_, upper_;
    double alpha_;
  };

  const Inertia& inertia() const { return inertia_; }
  const RollerGeometry& geometry() const { return geometry_; }
  const RobotParameters& robot() const { return robot_; }

 private:
  void resistance(const Contacts& c, const ContactStiffness& K, Resistance& G) const {
    const double R = robot_.R;
    const Wheels arm = rho_Y_ + c.Delta_Y;
    // K dV_P/du for u = V_X, V_Y, Omega, dphi, dgamma, by (3.3); rows of forces are combined of F_X and F_Y as V_P is.
    const std::array<Wheels, 3> X = {K.XX, K.XY, rho_X_ * K.XY - arm * K.XX};
    const std::array<Wheels, 3> Y = {K.XY, K.YY, rho_X_ * K.YY - arm * K.XY};
    const Wheels X_dgamma = c.r_Y * K.XY - c.r_X * K.XX, Y_dgamma = c.r_Y * K.YY - c.r_X * K.XY;
    for (int k = 0; k < 3; ++k) {
      G.platform_platform[0][k] = X[k];
      G.platform_platform[1][k] = Y[k];
      G.platform_platform[2][k] = rho_X_ * Y[k] - arm * X[k];
      G.dphi_platform[k] = -R * X[k];
      G.dgamma_platform[k] = c.r_Y * Y[k] - c.r_X * X[k];
      G.platform_dphi[k] = G.dphi_platform[k];
      G.platform_dgamma[k] = G.dgamma_platform[k];
    }
    G.dphi_dphi = robot_.mu_1 + R * R * K.XX;
    G.dphi_dgamma = -R * X_dgamma;
    G.dgamma_dgamma = robot_.mu_2 + c.r_Y * Y_dgamma - c.r_X * X_dgamma;
  }

  RobotParameters robot_;
  RollerGeometry geometry_;
  Law law_;
  Inertia inertia_;
  alignas(kAlignment) Wheels rho_X_, rho_Y_;
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
  const Velocities u = state.velocities();
  const Contacts c = contacts(u, state.phi() - roller_angle);
  const Velocities Q = forces(u, c, M);
  const double cos_psi = std::cos(state.psi()), sin_psi = std::sin(state.psi());
  derivative.x() = u.v[0] * cos_psi - u.v[1] * sin_psi;
  derivative.y() = u.v[0] * sin_psi + u.v[1] * cos_psi;
  derivative.psi() = u.v[2];
  derivative.work() = power(u, Q);
  const Eigen::Vector3d dv = inertia_.M_v_inverse * Eigen::Vector3d{Q.v[0], Q.v[1], Q.v[2]};
  derivative.values.col(1) << dv[0], dv[1], dv[2], 0;
  derivative.phi() = u.dphi;
  derivative.dphi() = Q.dphi * (1 / inertia_.J_1);
  derivative.dgamma() = Q.dgamma * (1 / inertia_.J_2);
  derivative.gamma() = u.dgamma;
}

template <class Law>
void SlipModel<Law>::linearize(const State& state, const Wheels& roller_angle, const Wheels& M,
                               BorderedJacobian& jacobian) const {
  const ContactGeometry contact = geometry_.at(state.phi() - roller_angle);
  const Contacts c = contacts(state, roller_angle);
  const ContactStiffness K = law_.stiffness(c.V_PX, c.V_PY);
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

  jacobian.Q_phi = {-X_phi, -Y_phi, arm * X_phi - rho_X_ * Y_phi - c.F_X * contact.dDelta_Y};
  jacobian.Q_dphi = {R * K.XX, R * K.XY, R * (rho_X_ * K.XY - arm * K.XX)};
  jacobian.Q_dgamma = {-X_dgamma, -Y_dgamma, arm * X_dgamma - rho_X_ * Y_dgamma};
  jacobian.dphi_phi = R * X_phi;
  jacobian.dphi_dphi = -robot_.mu_1 - R * R * K.XX;
  jacobian.dphi_dgamma = R * X_dgamma;
  jacobian.dgamma_phi = contact.r_X * X_phi - contact.r_Y * Y_phi - contact.dr_X * c.F_X + contact.dr_Y * c.F_Y;
  jacobian.dgamma_dgamma = contact.r_X * X_dgamma - contact.r_Y * Y_dgamma - robot_.mu_2;

  const Wheels X_Omega = rho_X_ * K.XY - arm * K.XX;
  const Wheels Y_Omega = rho_X_ * K.YY - arm * K.XY;
  const double XX = -K.XX.sum(), XY = -K.XY.sum(), YY = -K.YY.sum();
  const double XO = -X_Omega.sum(), YO = -Y_Omega.sum();
  jacobian.Q_v << XX, XY, XO, XY, YY, YO, XO, YO, (arm * X_Omega - rho_X_ * Y_Omega).sum();
  const PlatformMatrix coriolis = inertia_.coriolis_by_velocity(state.values.col(1));
  for (int k = 0; k < 3; ++k) jacobian.Q_v.col(k) += coriolis[k].head<3>().matrix();

  // d(F . V_P) = G . dV_P with G = F - K V_P
  const Wheels G_X = c.F_X - K.XX * c.V_PX - K.XY * c.V_PY;
  const Wheels G_Y = c.F_Y - K.XY * c.V_PX - K.YY * c.V_PY;
  jacobian.power_v = {G_X.sum(), G_Y.sum(), (rho_X_ * G_Y - arm * G_X).sum()};
  jacobian.power_phi = G_X * V_PX_phi + G_Y * V_PY_phi;
  jacobian.power_dphi = M - 2 * robot_.mu_1 * state.dphi() - R * G_X;
  jacobian.power_dgamma = contact.r_Y * G_Y - contact.r_X * G_X - 2 * robot_.mu_2 * state.dgamma();

  jacobian.cos_psi = std::cos(state.psi());
  jacobian.sin_psi = std::sin(state.psi());
  jacobian.V_x = V_X * jacobian.cos_psi - V_Y * jacobian.sin_psi;
  jacobian.V_y = V_X * jacobian.sin_psi + V_Y * jacobian.cos_psi;
}

}  // namespace youbot_base_sim
