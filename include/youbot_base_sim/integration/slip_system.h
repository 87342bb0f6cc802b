#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// A SlipModel under given wheel torques, with the roller of each wheel that stands on the floor: what a step between
/// two switches integrates. Models odeint's System too.
template <class Law>
class SlipSystem {
 public:
  /// Both must outlive the system. Rollers are those that `state` stands on.
  SlipSystem(const SlipModel<Law>& model, const TorqueProfile& torque, const State& state)
      : model_(&model), torque_(&torque) {
    for (int i = 0; i < kWheels; ++i) put(i, model.geometry().roller_at(state.phi()[i]));
  }

  void operator()(const State& x, State& dxdt, double t) const {
    model_->derivative(x, roller_angle_, torque_->value(t), dxdt);
  }

  /// What SlipModel says for each wheel's roller, or for its two.
  void contacts(const Velocities& u, const Wheels& phi, const Wheels& M, Contacts& c) const {
    model_->contacts(u, phi - roller_angle_, c);
    if (shares_) {
      for (int i = 0; i < kWheels; ++i) {
        if (shared_[i]) SharedContact(*model_, i, u, M[i]).put(c);
      }
    }
  }
  Contacts contacts(const Velocities& u, const Wheels& phi, const Wheels& M) const {
    Contacts c;
    contacts(u, phi, M, c);
    return c;
  }
  void resistance(const Velocities& u, const Contacts& c, const ContactForce& F, const Wheels& M, Resistance& G) const {
    model_->resistance(c, F, G);
    if (shares_) {
      for (int i = 0; i < kWheels; ++i) {
        if (shared_[i]) SharedContact(*model_, i, u, M[i]).put(G);
      }
    }
  }

  /// Whether the rollers at the edge where wheel i is would hold it there, if it stood still.
  bool holds(int i, const State& x, double t) const {
    return SharedContact(*model_, i, stopped(i, x.velocities()), torque_->value(t)[i]).holds();
  }

  /// Share of the upper roller of a wheel between two.
  double alpha(int i, const Velocities& u, double t) const {
    return SharedContact(*model_, i, u, torque_->value(t)[i]).alpha();
  }

  bool shared(int i) const { return shared_[i]; }
  const Eigen::Array<bool, kWheels, 1>& shared() const { return shared_; }
  bool shares() const { return shares_; }

  /// Stands wheel i, which is at the upper edge of roller k, on rollers k and k + 1. What momentum it had goes to the
  /// platform, through the contact that took it.
  void share(int i, std::int64_t k, State& x) {
    const RobotParameters& robot = model_->robot();
    const double energy = kinetic_energy(robot, x);
    // A free roller passes on only what is along its axis.
    const ContactGeometry g = model_->geometry().at(Wheels::Constant(0.5 * model_->geometry().pitch()));
    const double P_X = robot.J_1 * x.dphi()[i] / robot.R, P_Y = g.r_X[i] / g.r_Y[i] * P_X;
    const Eigen::Vector3d dv =
        model_->inertia().M_v_inverse * Eigen::Vector3d{P_X, P_Y, P_Y * robot.rho_X()[i] - P_X * robot.rho_Y()[i]};
    x.values.col(1) += Wheels{dv[0], dv[1], dv[2], 0};
    x.dphi()[i] = 0;
    x.phi()[i] = model_->geometry().upper_edge(k);
    x.work() += kinetic_energy(robot, x) - energy;
    roller_angle_[i] = static_cast<double>(k) * model_->geometry().pitch();
    lower_edge_[i] = -std::numeric_limits<double>::infinity();
    upper_edge_[i] = std::numeric_limits<double>::infinity();
    shared_[i] = shares_ = true;
    lower_roller_[i] = k;
  }

  /// The lower of the two rollers that wheel i stands on.
  std::int64_t lower_roller(int i) const { return lower_roller_[i]; }

  /// Speed that the platform owes to the momentum of wheel i, m/s.
  double momentum(int i, const State& x) const {
    const RobotParameters& robot = model_->robot();
    return robot.J_1 * std::abs(x.dphi()[i]) / (robot.R * robot.m_s());
  }

  /// Wheel angles between which each wheel stays on its roller, [lower, upper), rad; infinite for one on two.
  const Wheels& lower_edge() const { return lower_edge_; }
  const Wheels& upper_edge() const { return upper_edge_; }

  /// Unwrapped number of the roller that wheel i stands on; of two, the one that it came to last.
  std::int64_t roller(int i) const { return roller_[i]; }

  /// Stands wheel i on roller k (unwrapped number).
  void put(int i, std::int64_t k) {
    roller_[i] = k;
    shared_[i] = false;
    shares_ = shared_.any();
    roller_angle_[i] = static_cast<double>(k) * model_->geometry().pitch();
    lower_edge_[i] = model_->geometry().upper_edge(k - 1);
    upper_edge_[i] = model_->geometry().upper_edge(k);
  }

  /// Wheel angles at which the rollers on the floor point straight down, rad.
  const Wheels& roller_angle() const { return roller_angle_; }
  const SlipModel<Law>& model() const { return *model_; }
  const TorqueProfile& torque() const { return *torque_; }

 private:
  using SharedContact = typename SlipModel<Law>::SharedContact;

  static Velocities stopped(int i, Velocities u) {
    u.dphi[i] = 0;
    return u;
  }

  const SlipModel<Law>* model_;
  const TorqueProfile* torque_;
  std::array<std::int64_t, kWheels> roller_{}, lower_roller_{};
  Eigen::Array<bool, kWheels, 1> shared_ = Eigen::Array<bool, kWheels, 1>::Constant(false);
  bool shares_ = false;  // whether any is
  alignas(kAlignment) Wheels roller_angle_, lower_edge_, upper_edge_;
};

}  // namespace youbot_base_sim
