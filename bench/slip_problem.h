#pragma once

#include <array>
#include <memory>

#include "solver.h"
#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {
namespace bench {

/// A SlipSystem as SUNDIALS integrates it: a vector of numbers, smooth between switches and between the segments of the
/// torque. It leaves out work and roller angles of a State, on which nothing depends, and counts phi from the middle of
/// the roller in contact, so that a relative tolerance does not loosen as the wheels turn.
class SlipProblem {
 public:
  static constexpr int kSize = 18;
  static constexpr int kPhi = 6, kDphi = 10, kDgamma = 14;  ///< of the first wheel

  virtual ~SlipProblem() = default;
  virtual void derivative(double t, const double* y, double* dydt) = 0;
  /// By columns.
  virtual void jacobian(double t, const double* y, double* J) = 0;
  /// The effect of a switch: wheel i, at the edge of its roller, goes over to the next one in `direction`.
  virtual void hand_over(int i, int direction, double* y) = 0;
  virtual State state(const double* y) const = 0;
  virtual void put_initial(const State& x, double* y) const = 0;

  /// Begins the segment of the torque that holds at time t, s; returns where it ends, s.
  double begin_segment(double t) {
    if (!(period_ > 0)) return torque_->begin_segment(t);
    // k * period rather than a sum, as Simulation does; a drive sampled at t must not miss a segment by rounding.
    const auto k = static_cast<std::int64_t>(t / period_ + 1e-6);
    torque_->begin_segment(t + 1e-6 * period_);
    held_.set(torque_->value(t));
    return static_cast<double>(k + 1) * period_;
  }

  double half_pitch() const { return half_pitch_; }  ///< |phi| at the edges of a roller, rad

  IntegrationStatistics statistics;
  std::uint64_t jacobians = 0;

 protected:
  explicit SlipProblem(const Scene& scene)
      : torque_(make_torque_profile(scene)),
        period_(scene.solver.control_period),
        half_pitch_(RollerGeometry(scene.robot).upper_edge(0)) {
    if (!torque_) throw RunFailure("the scene's drive is not a torque");
    if (scene.robot.roller_rate_at_switch != RollerRateAtSwitch::kContinuous) {
      throw RunFailure("only roller_rate_at_switch: continuous is known here");
    }
  }

  const TorqueProfile& torque() const {
    if (period_ > 0) return held_;
    return *torque_;
  }

 private:
  std::unique_ptr<TorqueProfile> torque_;
  HeldTorque held_;
  double period_;
  double half_pitch_;
};

/// The problem of one friction law.
template <class Law>
class SlipProblemOf : public SlipProblem {
 public:
  explicit SlipProblemOf(const Scene& scene)
      : SlipProblem(scene), system_(SlipModel<Law>(scene.robot, scene.floor), torque(), scene.initial) {}

  void derivative(double t, const double* y, double* dydt) override {
    ++statistics.evaluations;
    State dxdt;
    system_(state(y), dxdt, t);
    put(dxdt, dydt);
  }

  void jacobian(double t, const double* y, double* J) override {
    ++jacobians;
    Eigen::Matrix<double, State::kSize, State::kSize> all;
    State rate;
    system_.jacobian(state(y), all, t, rate);
    for (int column = 0; column < kSize; ++column) {
      for (int row = 0; row < kSize; ++row) *J++ = all(kIndices[row], kIndices[column]);
    }
  }

  void hand_over(int i, int direction, double* y) override {
    ++statistics.switches;
    system_.put(i, system_.roller(i) + direction);
    y[kPhi + i] = -direction * half_pitch();
  }

  State state(const double* y) const override {
    State x;
    for (int k = 0; k < kSize; ++k) x.begin()[kIndices[k]] = y[k];
    x.phi() += middle();
    return x;
  }

  void put_initial(const State& x, double* y) const override {
    put(x, y);
    for (int i = 0; i < kWheels; ++i) y[kPhi + i] -= middle()[i];
  }

 private:
  static constexpr std::array<int, kSize> kIndices = {0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19};

  static void put(const State& x, double* y) {
    for (int k = 0; k < kSize; ++k) y[k] = x.begin()[kIndices[k]];
  }
  Wheels middle() const { return 0.5 * (system_.lower_edge() + system_.upper_edge()); }

  SlipSystem<Law> system_;
};

}  // namespace bench
}  // namespace youbot_base_sim
