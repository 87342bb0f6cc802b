#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "run.h"
#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {
namespace bench {

/// A scene with slipping contacts as a system of first-order equations for solvers that know nothing of this package:
/// smooth between switches and between the segments of its torque. Its numbers are those of a row, but with phi~, the
/// angle of each wheel's roller on the floor from straight down, in the place of phi: a tolerance relative to the
/// component does not loosen then as the wheels turn. Counts what it is asked.
class SlipProblem {
 public:
  virtual ~SlipProblem() = default;

  virtual void derivative(double t, const double* y, double* dydt) = 0;

  /// Writes the entries of the Jacobian that are not always zero: (i, j) to J[i * row_stride + j * column_stride].
  virtual void jacobian(double t, const double* y, double* J, int row_stride, int column_stride) = 0;

  const Numbers& initial() const { return initial_; }

  /// Begins the segment of the torque that holds at time t, s; returns where it ends, s.
  double begin_segment(double t) {
    if (!(period_ > 0)) return torque_->begin_segment(t);
    // k * period rather than a sum, as Simulation does; a drive sampled at t must not miss a segment by rounding.
    const auto k = static_cast<std::int64_t>(t / period_ + 1e-6);
    torque_->begin_segment(t + 1e-6 * period_);
    held_ = torque_->value(t);
    return static_cast<double>(k + 1) * period_;
  }

  /// phi~ at which a roller hands over to the next, rad; to the one before at the negative.
  double half_pitch() const { return half_pitch_; }

  /// Stands wheel i, which has come to the edge, on the roller beyond; all velocities go on.
  void hand_over(int i, int direction, double* y) {
    ++counts.switches;
    roller_[i] += direction;
    y[kPhi + i] = -direction * half_pitch_;
  }

  /// The row of `y`.
  Numbers row(const double* y) const {
    Numbers numbers;
    std::copy_n(y, kSize, numbers.begin());
    for (int i = 0; i < kWheels; ++i) numbers[kPhi + i] += pitch_ * roller_[i];
    return numbers;
  }

  Counts counts;

 protected:
  SlipProblem(const Scene& scene, const RollerGeometry& geometry)
      : torque_(make_torque_profile(scene)),
        period_(scene.solver.control_period),
        pitch_(geometry.pitch()),
        half_pitch_(geometry.upper_edge(0)),
        initial_(numbers_of(scene.initial)) {
    if (!torque_) throw RunFailure("the scene's drive is not a torque");
    if (scene.robot.roller_rate_at_switch != RollerRateAtSwitch::kContinuous) {
      throw RunFailure("only roller_rate_at_switch: continuous is known here");
    }
    for (int i = 0; i < kWheels; ++i) {
      roller_[i] = static_cast<int>(geometry.roller_at(initial_[kPhi + i]));
      initial_[kPhi + i] -= pitch_ * roller_[i];
    }
  }

  Wheels torque(double t) const { return period_ > 0 ? held_ : torque_->value(t); }
  Wheels torque_rate(double t) const { return period_ > 0 ? Wheels::Zero() : torque_->derivative(t); }

 private:
  std::unique_ptr<TorqueProfile> torque_;
  double period_;
  double pitch_;
  double half_pitch_;
  Wheels held_ = Wheels::Zero();
  std::array<int, kWheels> roller_;
  Numbers initial_;
};

/// The problem of one contact law.
template <class Law>
class SlipProblemOf : public SlipProblem {
 public:
  explicit SlipProblemOf(const Scene& scene)
      : SlipProblem(scene, RollerGeometry(scene.robot)), model_(scene.robot, scene.floor) {}

  void derivative(double t, const double* y, double* dydt) override {
    ++counts.evaluations;
    State x, dxdt;
    put(y, x);
    model_.derivative(x, Wheels::Zero(), torque(t), dxdt);
    std::memcpy(dydt + kPose, &dxdt.values(0, 0), 3 * sizeof(double));
    std::memcpy(dydt + kVelocity, &dxdt.values(0, 1), 3 * sizeof(double));
    std::memcpy(dydt + kPhi, &dxdt.values(0, 2), 12 * sizeof(double));
  }

  void jacobian(double t, const double* y, double* data, int row_stride, int column_stride) override {
    ++counts.jacobians;
    const auto at = [&](int row, int column) -> double& { return data[row * row_stride + column * column_stride]; };
    State x;
    put(y, x);
    BorderedJacobian J;
    model_.linearize(x, Wheels::Zero(), torque(t), J);
    at(0, 2) = -J.V_y;
    at(0, 3) = J.cos_psi;
    at(0, 4) = -J.sin_psi;
    at(1, 2) = J.V_x;
    at(1, 3) = J.sin_psi;
    at(1, 4) = J.cos_psi;
    at(2, 5) = 1;
    const Inertia& inertia = model_.inertia();
    const Eigen::Matrix3d& W = inertia.M_v_inverse;
    const Eigen::Matrix3d platform = W * J.Q_v;
    const double by_J_1 = 1 / inertia.J_1, by_J_2 = 1 / inertia.J_2;
    for (int row = 0; row < 3; ++row) {
      for (int k = 0; k < 3; ++k) at(kVelocity + row, kVelocity + k) = platform(row, k);
      const auto mixed = [&](const std::array<Wheels, 3>& Q, int i) {
        return W(row, 0) * Q[0][i] + W(row, 1) * Q[1][i] + W(row, 2) * Q[2][i];
      };
      for (int i = 0; i < kWheels; ++i) {
        at(kVelocity + row, kPhi + i) = mixed(J.Q_phi, i);
        at(kVelocity + row, kDphi + i) = mixed(J.Q_dphi, i);
        at(kVelocity + row, kDgamma + i) = mixed(J.Q_dgamma, i);
        at(kDphi + i, kVelocity + row) = by_J_1 * J.Q_dphi[static_cast<std::size_t>(row)][i];
        at(kDgamma + i, kVelocity + row) = by_J_2 * J.Q_dgamma[static_cast<std::size_t>(row)][i];
      }
    }
    for (int i = 0; i < kWheels; ++i) {
      at(kPhi + i, kDphi + i) = 1;
      at(kDphi + i, kPhi + i) = by_J_1 * J.dphi_phi[i];
      at(kDphi + i, kDphi + i) = by_J_1 * J.dphi_dphi[i];
      at(kDphi + i, kDgamma + i) = by_J_1 * J.dphi_dgamma[i];
      at(kDgamma + i, kPhi + i) = by_J_2 * J.dgamma_phi[i];
      at(kDgamma + i, kDphi + i) = by_J_2 * J.dphi_dgamma[i];
      at(kDgamma + i, kDgamma + i) = by_J_2 * J.dgamma_dgamma[i];
    }
  }

  /// Partial derivative of the right-hand side by time: only the torque depends on it.
  void time_derivative(double t, double* dfdt) const {
    std::fill_n(dfdt, kSize, 0.0);
    const Wheels rate = torque_rate(t);
    for (int i = 0; i < kWheels; ++i) dfdt[kDphi + i] = rate[i] / model_.inertia().J_1;
  }

 private:
  static void put(const double* y, State& x) {
    std::memcpy(&x.values(0, 0), y + kPose, 3 * sizeof(double));
    std::memcpy(&x.values(0, 1), y + kVelocity, 3 * sizeof(double));
    std::memcpy(&x.values(0, 2), y + kPhi, 12 * sizeof(double));
  }

  SlipModel<Law> model_;
};

/// Calls `use(problem)` with the scene as a problem of its contact law.
template <class Use>
auto with_problem(const Scene& scene, Use&& use) {
  if (scene.model == Model::kViscous) {
    SlipProblemOf<ViscousLaw> problem(scene);
    return use(problem);
  }
  if (scene.model != Model::kCoulomb) throw RunFailure("only models 2a and 2b are known here");
  SlipProblemOf<CoulombLaw> problem(scene);
  return use(problem);
}

}  // namespace bench
}  // namespace youbot_base_sim
