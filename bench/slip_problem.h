#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {
namespace bench {

/// What every contestant but the simulator itself integrates:
///
///   0..2    x, y (m), psi (rad)
///   3..5    V_X, V_Y (m/s), Omega (rad/s)
///   6..9    phi~, angle of each wheel's roller on the floor from straight down (rad)
///   10..13  dphi (rad/s)
///   14..17  dgamma (rad/s)
///
/// phi~ rather than phi, so that a tolerance relative to the component does not loosen as the wheels turn.
constexpr int kSize = 18;
enum Index { kPose = 0, kVelocity = 3, kPhi = 6, kDphi = 10, kDgamma = 14 };
using Numbers = std::array<double, kSize>;

/// What a run cost, as far as the contestant tells. Negative: it does not.
struct Counts {
  std::int64_t steps = 0;           ///< accepted
  std::int64_t rejected = 0;        ///< for their error, or for want of convergence
  std::int64_t location_steps = 0;  ///< steps repeated to end on an edge
  std::int64_t evaluations = 0;     ///< of the right-hand side
  std::int64_t jacobians = 0;
  std::int64_t factorizations = 0;
  std::int64_t switches = 0;
};

/// What a contestant hands back.
struct Run {
  std::vector<Numbers> rows;  ///< at the times asked for; phi here counted from the start, not from the roller
  Counts counts;
  std::string failure;  ///< empty: none
};

/// Thrown out of a run that cannot go on; says why.
class RunFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A scene with slipping contacts as a system of first-order equations, smooth between switches and between the
/// segments of its torque. Counts what it is asked.
template <class Law>
class SlipProblem {
 public:
  explicit SlipProblem(const Scene& scene)
      : model_(scene.robot, scene.floor),
        torque_(make_torque_profile(scene)),
        period_(scene.solver.control_period),
        half_pitch_(model_.geometry().upper_edge(0)),
        duration_(scene.duration) {
    if (!torque_) throw RunFailure("the scene's drive is not a torque");
    if (scene.robot.roller_rate_at_switch != RollerRateAtSwitch::kContinuous) {
      throw RunFailure("the benchmark knows only roller_rate_at_switch: continuous");
    }
    const State& x = scene.initial;
    for (int k = 0; k < 3; ++k) {
      initial_[kPose + k] = x.values(k, 0);
      initial_[kVelocity + k] = x.values(k, 1);
    }
    for (int i = 0; i < kWheels; ++i) {
      roller_[i] = model_.geometry().roller_at(x.phi()[i]);
      initial_[kPhi + i] = x.phi()[i] - roller_[i] * model_.geometry().pitch();
      initial_[kDphi + i] = x.dphi()[i];
      initial_[kDgamma + i] = x.dgamma()[i];
    }
  }

  const Numbers& initial() const { return initial_; }
  double duration() const { return duration_; }

  /// Begins the segment of the torque that holds at time t, s; returns where it ends, s.
  double begin_segment(double t) {
    if (!(period_ > 0)) return torque_->begin_segment(t);
    // k * period rather than a sum, as the simulator does; a drive sampled at t must not miss a segment by rounding.
    const std::int64_t k = static_cast<std::int64_t>(t / period_ + 1e-6);
    torque_->begin_segment(t + 1e-6 * period_);
    held_ = torque_->value(t);
    return static_cast<double>(k + 1) * period_;
  }

  void derivative(double t, const double* y, double* dydt) {
    ++counts.evaluations;
    State x, dxdt;
    put(y, x);
    model_.derivative(x, Wheels::Zero(), torque(t), dxdt);
    std::memcpy(dydt + kPose, &dxdt.values(0, 0), 3 * sizeof(double));
    std::memcpy(dydt + kVelocity, &dxdt.values(0, 1), 3 * sizeof(double));
    std::memcpy(dydt + kPhi, &dxdt.values(0, 2), 12 * sizeof(double));
  }

  /// Writes the entries of the Jacobian that are not always zero by `at(row, column) = value`.
  template <class At>
  void jacobian(double t, const double* y, At&& at) {
    ++counts.jacobians;
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
    std::memset(dfdt, 0, kSize * sizeof(double));
    if (period_ > 0) return;
    const Wheels rate = torque_->derivative(t);
    for (int i = 0; i < kWheels; ++i) dfdt[kDphi + i] = rate[i] / model_.inertia().J_1;
  }

  /// phi~ at which a roller hands over to the next, rad; to the one before at the negative.
  double half_pitch() const { return half_pitch_; }

  /// Stands wheel i, which has come to the edge, on the roller beyond; all velocities go on.
  void hand_over(int i, int direction, double* y) {
    ++counts.switches;
    roller_[i] += direction;
    y[kPhi + i] = -direction * half_pitch_;
  }

  /// The same numbers with the wheels' angles counted from the start.
  Numbers row(const double* y) const {
    Numbers numbers;
    std::memcpy(numbers.data(), y, sizeof numbers);
    for (int i = 0; i < kWheels; ++i) numbers[kPhi + i] += roller_[i] * model_.geometry().pitch();
    return numbers;
  }

  Counts counts;

 private:
  Wheels torque(double t) const { return period_ > 0 ? held_ : torque_->value(t); }

  static void put(const double* y, State& x) {
    std::memcpy(&x.values(0, 0), y + kPose, 3 * sizeof(double));
    std::memcpy(&x.values(0, 1), y + kVelocity, 3 * sizeof(double));
    std::memcpy(&x.values(0, 2), y + kPhi, 12 * sizeof(double));
  }

  SlipModel<Law> model_;
  std::unique_ptr<TorqueProfile> torque_;
  double period_;
  double half_pitch_;
  double duration_;
  Wheels held_ = Wheels::Zero();
  std::array<int, kWheels> roller_;
  Numbers initial_;
};

/// When to give a contestant up.
struct Limits {
  std::int64_t most_evaluations = 5000000;  ///< of the right-hand side
  std::int64_t most_switches = 50000;

  bool spent(const Counts& counts) const { return counts.evaluations > most_evaluations; }

  void check(const Counts& counts, double t) const {
    if (spent(counts)) {
      throw RunFailure("more than " + std::to_string(most_evaluations) + " evaluations by t = " + std::to_string(t) +
                       " s");
    }
    if (counts.switches > most_switches) {
      throw RunFailure("more than " + std::to_string(most_switches) + " switches by t = " + std::to_string(t) + " s");
    }
  }
};

}  // namespace bench
}  // namespace youbot_base_sim
