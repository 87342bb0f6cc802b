#pragma once

#include <Eigen/Dense>
#include <cmath>

#include "youbot_base_sim/physics/contact_law.h"
#include "youbot_base_sim/physics/contacts.h"
#include "youbot_base_sim/physics/damping_matrix.h"
#include "youbot_base_sim/physics/dry_bearings.h"
#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Power of the forces `Q` on the velocities `u`, W. Coriolis forces contribute nothing.
inline double power(const Velocities& u, const Velocities& Q) {
  return (u.v * Q.v + u.dphi * Q.dphi + u.dgamma * Q.dgamma).sum();
}

/// Derivative of the forces by each wheel's angle phi_i, N/rad and N m/rad: on the platform, on dphi_i, on dgamma_i.
struct AngleStiffness {
  std::array<Wheels, 3> platform;
  Wheels dphi, dgamma;
};

/// Sets `derivative` to the time derivative of `state` under the forces Q on its velocities.
inline void set_derivative(const Inertia& inertia, const State& state, const Velocities& Q, State& derivative) {
  const Velocities u = state.velocities();
  const double cos_psi = std::cos(state.psi()), sin_psi = std::sin(state.psi());
  derivative.x() = u.v[0] * cos_psi - u.v[1] * sin_psi;
  derivative.y() = u.v[0] * sin_psi + u.v[1] * cos_psi;
  derivative.psi() = u.v[2];
  derivative.work() = power(u, Q);
  const Eigen::Vector3d dv = inertia.M_v_inverse * Eigen::Vector3d{Q.v[0], Q.v[1], Q.v[2]};
  derivative.values.col(1) << dv[0], dv[1], dv[2], 0;
  derivative.phi() = u.dphi;
  derivative.dphi() = Q.dphi * (1 / inertia.J_1);
  derivative.dgamma() = Q.dgamma * (1 / inertia.J_2);
  derivative.gamma() = u.dgamma;
}

/// The velocities that each bring about the model's transition speed, m/s and rad/s.
template <class Model>
Velocities transition_velocities(const Model& model) {
  const double speed = model.transition_speed(), R = model.robot().R, R_d = model.robot().R_d;
  return {Wheels::Constant(speed), Wheels::Constant(speed / R), Wheels::Constant(speed / (R - R_d))};
}

/// Models 2a and 2b: the equations of motion (4.9) with slipping contacts, for one fixed choice of the rollers in
/// contact, for which they are smooth. The wheel angle enters as `phi_tilde` = phi - phi_center (rad), where phi_center
/// is the wheel angle at which the roller points straight down; it may lie somewhat beyond the roller's edges.
///
/// `Law` is the friction law, a policy of contact_law.h.
template <class Law>
class SlipModel {
 public:
  using Contacts = youbot_base_sim::Contacts;
  using Friction = ContactForce;  ///< at the contacts
  using Mask = Eigen::Array<bool, kWheels, 1>;

  SlipModel(const RobotParameters& robot, const FloorParameters& floor)
      : robot_(robot),
        geometry_(robot),
        law_(robot, floor),
        inertia_(robot),
        dry_(robot),
        limit_{floor.f, normal_reactions(robot, floor)},
        rho_X_(robot.rho_X()),
        rho_Y_(robot.rho_Y()) {}

  /// Slip, friction and position of the contact points at the velocities u.
  void contacts(const Velocities& u, const ContactGeometry& geometry, Contacts& c) const {
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
  Contacts contacts(const Velocities& u, const Wheels& phi_tilde) const {
    Contacts c;
    contacts(u, geometry_.at(phi_tilde), c);
    return c;
  }

  /// Sets the moment of the friction by the other entries.
  void set_moment(Contacts& c) const { c.M_Z = c.F_Y * rho_X_ - c.F_X * (rho_Y_ + c.Delta_Y); }

  /// Right-hand sides of (4.9), with dry friction of the bearings: forces on the velocities under the wheel torques `M`
  /// (N m), N and N m.
  Velocities forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    Velocities Q = viscous_forces(u, c, M);
    if (dry_.any()) dry_.add_to(u, Q);
    return Q;
  }
  /// The same at three stages at once. What is rare stays out of the loop.
  void forces(const std::array<Velocities, 3>& u, const std::array<Contacts, 3>& c, const std::array<Wheels, 3>& M,
              std::array<Velocities, 3>& Q) const {
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) Q[j] = viscous_forces(u[j], c[j], M[j]);
    if (!dry_.any()) return;
    for (int j = 0; j < 3; ++j) dry_.add_to(u[j], Q[j]);
  }

  /// Time derivative of `state`, whose contacts are `c`, under the wheel torques `M` (N m).
  void derivative(const State& state, const Contacts& c, const Wheels& M, State& derivative) const {
    set_derivative(inertia_, state, forces(state.velocities(), c, M), derivative);
  }

  /// Sets G to minus the derivative of `forces` by the velocities u, Coriolis forces excluded, where the contacts are
  /// `c`.
  void damping(const Velocities& u, const Contacts& c, DampingMatrix& G) const {
    damping(u, c, law_.stiffness(c.V_PX, c.V_PY), G);
  }

  /// The same where the friction is taken to be F, which need not be the friction of c's slip: see the law.
  void damping(const Velocities& u, const Contacts& c, const ContactForce& F, DampingMatrix& G) const {
    damping(u, c, law_.stiffness(c.V_PX, c.V_PY, F), G);
  }

  /// Derivative of `forces` by the wheels' angles. `c` are the contacts at the velocities u and this geometry.
  AngleStiffness angle_stiffness(const Velocities& u, const ContactGeometry& geometry, const Contacts& c) const;

  /// Friction after the velocities have changed by du from where the contacts are `c`, to first order.
  ContactForce friction_after(const Contacts& c, const ContactForce& F, const Velocities& du) const {
    const ContactStiffness K = law_.stiffness(c.V_PX, c.V_PY, F);
    const Wheels dX = du.v[0] - (rho_Y_ + c.Delta_Y) * du.v[2] - robot_.R * du.dphi - c.r_X * du.dgamma;
    const Wheels dY = du.v[1] + rho_X_ * du.v[2] + c.r_Y * du.dgamma;
    return law_.bounded({c.F_X - K.XX * dX - K.XY * dY, c.F_Y - K.XY * dX - K.YY * dY});
  }

  /// F, shortened to the largest friction that the law allows.
  ContactForce bounded(const ContactForce& F, const Contacts&) const { return law_.bounded(F); }

  ContactForce friction(const Contacts& c) const { return {c.F_X, c.F_Y}; }

  /// Replaces the friction of the wheels in `mask`.
  void put_friction(const Mask& mask, const ContactForce& F, Contacts& c) const {
    c.F_X = mask.select(F.F_X, c.F_X);
    c.F_Y = mask.select(F.F_Y, c.F_Y);
    const Wheels M_Z = c.M_Z;
    set_moment(c);
    c.M_Z = mask.select(c.M_Z, M_Z);  // for a shared contact the mean of moments is no moment of means
  }

  /// `c` for whoever looks at it.
  ContactDetails details(const Contacts& c) const {
    ContactDetails details{c};
    details.N = limit_.N;
    details.f = limit_.f;
    return details;
  }

  /// The torque that a roller gets from its contact, N m.
  Wheels roller_torque(const Contacts& c) const { return c.r_Y * c.F_Y - c.r_X * c.F_X; }

  /// Slip speed over which the friction changes by its own size, m/s; infinite for a linear law. Setting it has no
  /// effect on a law without one.
  double transition_speed() const { return law_.transition_speed(); }
  void set_transition_speed(double nu) { law_.set_transition_speed(nu); }

  const Inertia& inertia() const { return inertia_; }
  const RollerGeometry& geometry() const { return geometry_; }
  const RobotParameters& robot() const { return robot_; }
  const DryBearings& dry_bearings() const { return dry_; }

 private:
  Velocities viscous_forces(const Velocities& u, const Contacts& c, const Wheels& M) const {
    return {sums(c.F_X, c.F_Y, c.M_Z) + inertia_.coriolis(u.v), M - robot_.mu_1 * u.dphi - robot_.R * c.F_X,
            c.r_Y * c.F_Y - c.r_X * c.F_X - robot_.mu_2 * u.dgamma};
  }

  void damping(const Velocities& u, const Contacts& c, const ContactStiffness& K, DampingMatrix& G) const {
    const double R = robot_.R;
    const Wheels arm = rho_Y_ + c.Delta_Y;
    // K dV_P/du for u = V_X, V_Y, Omega, dphi, dgamma, by (3.3); rows of forces combine F_X and F_Y as V_P does.
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
    if (dry_.any()) dry_.add_to(u, G);
  }

  struct Limit {
    Wheels f, N;
  };

  RobotParameters robot_;
  RollerGeometry geometry_;
  Law law_;
  Inertia inertia_;
  DryBearings dry_;
  Limit limit_;
  alignas(kAlignment) Wheels rho_X_, rho_Y_;
};

template <class Law>
AngleStiffness SlipModel<Law>::angle_stiffness(const Velocities& u, const ContactGeometry& g, const Contacts& c) const {
  const ContactStiffness K = law_.stiffness(c.V_PX, c.V_PY);
  const Wheels V_PX_phi = -g.dDelta_Y * u.v[2] - g.dr_X * u.dgamma, V_PY_phi = g.dr_Y * u.dgamma;
  const Wheels X = K.XX * V_PX_phi + K.XY * V_PY_phi, Y = K.XY * V_PX_phi + K.YY * V_PY_phi;
  const Wheels arm = rho_Y_ + c.Delta_Y;
  return {{-X, -Y, arm * X - rho_X_ * Y - c.F_X * g.dDelta_Y},
          robot_.R * X,
          g.r_X * X - g.r_Y * Y - g.dr_X * c.F_X + g.dr_Y * c.F_Y};
}

}  // namespace youbot_base_sim
