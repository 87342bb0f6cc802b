#pragma once

#include <Eigen/Dense>
#include <algorithm>

#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

/// Wheel i under the torque M (N m), at rest on the edge between two rollers: docs/method.md, "A wheel on two rollers".
template <class Model>
class SharedContact {
 public:
  using Contacts = typename Model::Contacts;

  /// `lower` and `upper` are the contacts of the two rollers, each as if it carried the wheel alone.
  SharedContact(const Model& model, int i, const Velocities& u, double M, const Contacts& lower, const Contacts& upper)
      : model_(model),
        i_(i),
        u_(u),
        lower_(lower),
        upper_(upper),
        F_X_(M / model.robot().R),
        alpha_(upper_.F_X[i] == lower_.F_X[i] ? kEnded : (F_X_ - lower_.F_X[i]) / (upper_.F_X[i] - lower_.F_X[i])) {}

  /// The upper roller's share, which holds the wheel if it lies in [0, 1]; 2 if both pull alike, as off the floor.
  double alpha() const { return alpha_; }

  /// True if the edge is attractive: both rollers drive the wheel back to it rather than away from it.
  bool attractive() const { return alpha_ >= 0 && alpha_ <= 1 && upper_.F_X[i_] > lower_.F_X[i_]; }

  /// Impulses on V_X, V_Y, Omega (N s, N m s) and dgamma (N m s) by which the wheel, which chatters at the rate dphi,
  /// gives its momentum away: through what one roller exerts more than the other.
  Eigen::Vector4d impulse(double dphi) const {
    const double P_X = model_.robot().J_1 * dphi / model_.robot().R;
    Eigen::Vector4d P = P_X * (forces(upper_) - forces(lower_)) / (upper_.F_X[i_] - lower_.F_X[i_]);
    if (!(ripple(dphi) < 1)) P[3] = 0;  // the roller has gone its own way
    return P;
  }

  /// Error of the platform's speed (m/s) if the wheel, which chatters at the rate dphi, rests from now on: forces
  /// differ from those at rest by the square of the ripple of the slip.
  double hold_error(double dphi) const {
    const RobotParameters& robot = model_.robot();
    return robot.J_1 * std::abs(dphi) / (robot.R * robot.m_s()) * ripple(dphi);
  }

  /// What a roller that takes over at rest takes from the platform's speed, m/s: the floor spins it up to the rate that
  /// the one before has now.
  double kick() const {
    if (model_.robot().roller_rate_at_switch != RollerRateAtSwitch::kAtRest) return 0;
    const double r_X = lower_.r_X[i_], r_Y = lower_.r_Y[i_];
    return model_.robot().J_2 * std::abs(u_.dgamma[i_]) / (std::sqrt(r_X * r_X + r_Y * r_Y) * model_.robot().m_s());
  }

  /// Sets the wheel's entries of the contacts. Slip and offset become weighted means, as the friction does.
  void write_to(Contacts& c) const {
    for (Wheels Contacts::*entry : Model::kMeans) (c.*entry)[i_] = mean((upper_.*entry)[i_], (lower_.*entry)[i_]);
  }

  /// Sets the wheel's forces as functions of its normal reaction, if `lower` and `upper` are those of 1 N: the parts
  /// n and N - n of the two rollers are such that the wheel gets no torque, n F_X + (N - n) F_X' = M / R.
  void write_to(ForcePerNormalLoad& per_load) const {
    if (alpha_ == kEnded) return;
    const double difference = upper_.F_X[i_] - lower_.F_X[i_];
    // n = intercept + slope N of the upper roller
    const double intercept = F_X_ / difference, slope = -lower_.F_X[i_] / difference;
    using Terms = ForcePerNormalLoad::Terms;
    const auto set = [&](Wheels Terms::*entry, const Wheels& upper, const Wheels& lower) {
      const double more = upper[i_] - lower[i_];
      (per_load.intercept.*entry)[i_] = more * intercept;
      (per_load.slope.*entry)[i_] = lower[i_] + more * slope;
    };
    set(&Terms::F_X, upper_.F_X, lower_.F_X);
    set(&Terms::F_Y, upper_.F_Y, lower_.F_Y);
    set(&Terms::M_Z, upper_.M_Z, lower_.M_Z);
    set(&Terms::T_S, upper_.T_S, lower_.T_S);
    set(&Terms::D, upper_.Delta_Y, lower_.Delta_Y);
  }

  /// Sets the wheel's entries of the damping matrix: each roller's own, weighted, and the change of the shares. The
  /// rate of rollers without inertia then is a mean without effect, since they have rates of their own.
  void write_to(DampingMatrix& G) const {
    DampingMatrix upper, lower;
    model_.damping(u_, upper_, upper);
    model_.damping(u_, lower_, lower);
    // Forces on V_X, V_Y, Omega and dgamma by the same velocities
    const bool massless = model_.inertia().J_2 == 0;
    const auto matrix = [this, massless](const DampingMatrix& g) {
      Eigen::Matrix4d m;
      for (int row = 0; row < 3; ++row) {
        for (int k = 0; k < 3; ++k) m(row, k) = g.platform_platform[row][k][i_];
        m(row, 3) = g.platform_dgamma[row][i_];
        m(3, row) = g.dgamma_platform[row][i_];
      }
      m(3, 3) = g.dgamma_dgamma[i_];
      if (massless) {  // the roller's rate follows at once
        const Eigen::Matrix4d followed = m.col(3) * m.row(3) / m(3, 3);
        m -= followed;
        m.col(3).setZero();
        m.row(3).setZero();
      }
      return m;
    };
    const Eigen::Matrix4d m = alpha_ * matrix(upper) + (1 - alpha_) * matrix(lower);
    Eigen::Matrix4d all = m;
    if (alpha_ != kEnded) all -= (forces(upper_) - forces(lower_)) * m.row(0) / (upper_.F_X[i_] - lower_.F_X[i_]);
    if (massless) {  // their mean has no effect
      all.row(3).setZero();
      all(3, 3) =
          std::max(kLeastDamping, model_.robot().mu_2[i_] + model_.dry_bearings().rollers.damping(u_.dgamma)[i_]);
    }
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k) G.platform_platform[row][k][i_] = all(row, k);
      G.platform_dgamma[row][i_] = all(row, 3);
      G.dgamma_platform[row][i_] = all(3, row);
      G.platform_dphi[row][i_] = G.dphi_platform[row][i_] = 0;
    }
    G.dgamma_dgamma[i_] = all(3, 3);
    G.dphi_dphi[i_] = model_.robot().mu_1[i_] + model_.dry_bearings().wheels.damping(Wheels::Zero())[i_];
    G.dphi_dgamma[i_] = G.dgamma_dphi[i_] = 0;
  }

 private:
  static constexpr double kEnded = 2;
  static constexpr double kLeastDamping = 1e-9;  // N m s
  static constexpr double kRipple = 8;           // times the rim's speed, with that of the roller

  // Ripple of the contacts' slip while the wheel chatters at the rate dphi, as a share of the slower one's, at most 1:
  // also if rollers take over at rest, which kicks them, or if friction does not saturate, so has no such scale.
  double ripple(double dphi) const {
    if (!Model::kLimited || model_.robot().roller_rate_at_switch == RollerRateAtSwitch::kAtRest) return 1;
    const double scale = std::max(model_.slip_scale(lower_)[i_], model_.slip_scale(upper_)[i_]);
    return std::min(1.0, kRipple * model_.robot().R * std::abs(dphi) * scale);
  }

  double mean(double upper, double lower) const { return alpha_ * upper + (1 - alpha_) * lower; }

  Eigen::Vector4d forces(const Contacts& c) const {
    return {c.F_X[i_], c.F_Y[i_], c.M_Z[i_], model_.roller_torque(c)[i_]};
  }

  const Model& model_;
  int i_;
  Velocities u_;
  Contacts lower_, upper_;
  double F_X_;  // friction that holds the wheel, N
  double alpha_;
};

}  // namespace youbot_base_sim
