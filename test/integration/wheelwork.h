#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "youbot_base_sim/integration/switching_integrator.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Four wheels that turn independently, ddphi = 2 c_2 + 6 c_3 t + 12 c_4 t^2 -+ pull - damping dphi, the pull being
/// towards the edge between rollers 0 and 1. Without pull and damping phi is a polynomial of degree four in time, which
/// a cubic between two of its points does not hit. With damping, c_3 and c_4 have to be zero.
class Wheelwork {
 public:
  using State = youbot_base_sim::State;

  void operator()(const State& x, State& dxdt, double t) const {
    dxdt.values.setZero();
    dxdt.phi() = x.dphi();
    dxdt.dphi() = push() + 6 * c_3 * t + 12 * c_4 * t * t - damping * x.dphi();
  }

  /// 2 c_2 -+ pull, rad/s^2.
  Wheels push() const {
    Wheels result = 2 * c_2;
    for (int i = 0; i < kWheels; ++i) result[i] += roller_[i] <= 0 ? pull : -pull;
    return result;
  }

  const Wheels& lower_edge() const { return lower_edge_; }
  const Wheels& upper_edge() const { return upper_edge_; }
  std::int64_t roller(int i) const { return roller_[i]; }
  void put(int i, std::int64_t k) {
    roller_[i] = k;
    shared_[i] = false;
    lower_edge_[i] = geometry.upper_edge(k - 1);
    upper_edge_[i] = geometry.upper_edge(k);
  }

  /// Between two rollers: only the edge between 0 and 1 holds, where the push of the lower roller is -push of the
  /// upper.
  bool holds(int i, const State&, double) const { return pull > 0 && alpha(i, {}, 0) >= 0 && alpha(i, {}, 0) <= 1; }
  double alpha(int i, const Velocities&, double t) const {
    return (1 + (2 * c_2[i] + 6 * c_3[i] * t + 12 * c_4[i] * t * t) / pull) / 2;
  }
  void share(int i, std::int64_t k, State& x) {
    shared_[i] = true;
    lower_roller_[i] = k;
    lower_edge_[i] = -std::numeric_limits<double>::infinity();
    upper_edge_[i] = std::numeric_limits<double>::infinity();
    x.phi()[i] = geometry.upper_edge(k);
    x.dphi()[i] = 0;
  }
  bool shared(int i) const { return shared_[i]; }
  bool shares() const { return shared_[0] || shared_[1] || shared_[2] || shared_[3]; }
  std::int64_t lower_roller(int i) const { return lower_roller_[i]; }
  double momentum(int i, const State& x) const { return std::abs(x.dphi()[i]); }

  State start() {
    State x;
    x.phi() = c_0;
    x.dphi() = c_1;
    for (int i = 0; i < kWheels; ++i) put(i, geometry.roller_at(c_0[i]));
    return x;
  }

  Wheels c_0 = Wheels::Zero(), c_1 = Wheels::Zero(), c_2 = Wheels::Zero(), c_3 = Wheels::Zero(), c_4 = Wheels::Zero();
  double pull = 0, damping = 0;
  int every_nth_step_fails = 0;                // none, if 0
  RollerGeometry geometry{RobotParameters{}};  // n = 6

 private:
  std::array<std::int64_t, kWheels> roller_{}, lower_roller_{};
  std::array<bool, kWheels> shared_{};
  Wheels lower_edge_ = Wheels::Zero(), upper_edge_ = Wheels::Zero();
};

/// Steps a Wheelwork by its solution in closed form, to rounding. What it tells as its error is what a cubic leaves
/// out: steps have a length that depends on the tolerance, though their ends are exact. It insists on its protocol:
/// nothing is asked of a step that failed or was never made.
class WheelworkStepper {
 public:
  using System = Wheelwork;

  explicit WheelworkStepper(const Tolerance& tolerance) : error_scale_(tolerance.absolute + tolerance.relative) {}

  void begin(const Wheelwork& wheels, const State& x, double t) {
    wheels_ = &wheels;
    x_ = x;
    t_ = t;
    stands_ = false;
  }

  bool step(double dt) {
    dt_ = dt;
    end_ = x_;
    wheels_->damping > 0 ? relax(dt) : fly(dt);
    for (int i = 0; i < kWheels; ++i) {
      if (!wheels_->shared(i)) continue;
      end_.phi()[i] = x_.phi()[i];
      end_.dphi()[i] = 0;
    }
    const int nth = wheels_->every_nth_step_fails;
    stands_ = end_.values.allFinite() && !(nth > 0 && ++steps_ % nth == 0);
    if (!stands_) end_.values.setConstant(std::numeric_limits<double>::quiet_NaN());
    return stands_;
  }

  State end(double beyond = 0) const {
    expect_step();
    State x = end_;
    x.values += beyond * slope().values;
    return x;
  }
  Velocities end_acceleration() const {
    expect_step();
    return slope().velocities();
  }
  Wheels end_phi() const {
    expect_step();
    return end_.phi();
  }
  Wheels end_dphi() const {
    expect_step();
    return end_.dphi();
  }
  Velocities end_velocities() const {
    expect_step();
    return end_.velocities();
  }
  bool negligible(double speed) const { return speed < 1e-9; }
  double error() const {
    expect_step();
    const Wheelwork& w = *wheels_;
    // Fourth derivative at the step's start, over 4!
    Wheels fourth = w.damping > 0 ? Wheels(std::pow(w.damping, 3) / 24 * (w.damping * x_.dphi() - w.push())) : w.c_4;
    for (int i = 0; i < kWheels; ++i) {
      if (w.shared(i)) fourth[i] = 0;
    }
    return (fourth.abs() * std::pow(dt_, 4)).maxCoeff() / error_scale_;
  }
  void keep() { expect_step(); }
  void forget() {}
  void forget(int) {}

 private:
  State slope() const {
    State dxdt;
    (*wheels_)(end_, dxdt, t_ + dt_);
    for (int i = 0; i < kWheels; ++i) {
      if (wheels_->shared(i)) dxdt.phi()[i] = dxdt.dphi()[i] = 0;
    }
    return dxdt;
  }

  void expect_step() const { EXPECT_TRUE(stands_) << "asked for a step that failed, " << dt_ << " s from t = " << t_; }

  void fly(double dt) {
    const Wheelwork& w = *wheels_;
    end_.phi() += dt * (x_.dphi() +
                        dt * (0.5 * w.push() + w.c_3 * (3 * t_ + dt) + w.c_4 * (6 * t_ * t_ + 4 * t_ * dt + dt * dt)));
    end_.dphi() += dt * (w.push() + 3 * w.c_3 * (2 * t_ + dt) + 4 * w.c_4 * (3 * t_ * t_ + 3 * t_ * dt + dt * dt));
  }

  void relax(double dt) {
    const Wheelwork& w = *wheels_;
    const Wheels rate = w.push() / w.damping;  // in the end
    const double decay = std::expm1(-w.damping * dt);
    end_.phi() += dt * rate - decay / w.damping * (x_.dphi() - rate);
    end_.dphi() += decay * (x_.dphi() - rate);
  }

  double error_scale_;
  const Wheelwork* wheels_ = nullptr;
  State x_, end_;
  double t_ = 0, dt_ = 0;
  bool stands_ = false;
  int steps_ = 0;
};

constexpr int kRollers = 6;
inline int wrapped(int k) { return ((k % kRollers) + kRollers) % kRollers; }

/// Switches of polynomial wheels in [0, duration], by bisection in extended precision.
inline std::vector<RollerSwitch> exact_switches(const Wheelwork& wheels, double duration) {
  std::vector<RollerSwitch> switches;
  for (int i = 0; i < kWheels; ++i) {
    const auto phi = [&](long double t) {
      return wheels.c_0[i] +
             t * (wheels.c_1[i] +
                  t * (wheels.c_2[i] + t * (wheels.c_3[i] + t * static_cast<long double>(wheels.c_4[i]))));
    };
    const int grid = 4000;
    for (int j = 0; j < grid; ++j) {
      const long double start = duration * static_cast<long double>(j) / grid;
      const long double end = duration * static_cast<long double>(j + 1) / grid;
      const long double phi_start = phi(start), phi_end = phi(end);
      for (int k = -40; k < 40; ++k) {
        const double edge = wheels.geometry.upper_edge(k);
        const bool rises = phi_start < edge;
        if (rises == (phi_end < edge)) continue;
        long double low = start, high = end;
        for (int halving = 0; halving < 60; ++halving) {
          const long double middle = (low + high) / 2;
          ((phi(middle) < edge) == rises ? low : high) = middle;
        }
        const int from = rises ? k : k + 1, to = rises ? k + 1 : k;
        switches.push_back({static_cast<double>(low), i, wrapped(from), wrapped(to), edge, rises ? 1 : -1});
      }
    }
  }
  return switches;
}

}  // namespace youbot_base_sim
