#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "youbot_base_sim/integration/contact_system.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// A System with contacts: four wheels that turn independently, ddphi = 2 c_2 + 6 c_3 t + 12 c_4 t^2 -+ pull - damping
/// dphi, the pull being towards the edge between rollers 0 and 1. Without pull and damping phi is a polynomial of
/// degree four in time, which a cubic between two of its points does not hit. With damping, c_3 and c_4 have to be
/// zero.
class Wheelwork final : public ContactSystem {
 public:
  Wheelwork()
      : ContactSystem(ContactModes(RobotParameters(), Wheels::Zero()), RestFriction(RobotParameters(), kInfinity, 0)) {}

  void operator()(const State& x, State& dxdt, double t) const override {
    dxdt.values.setZero();
    dxdt.phi() = x.dphi();
    dxdt.dphi() = push() + 6 * c_3 * t + 12 * c_4 * t * t - damping * x.dphi();
  }

  /// 2 c_2 -+ pull, rad/s^2.
  Wheels push() const {
    Wheels result = 2 * c_2;
    for (int i = 0; i < kWheels; ++i) result[i] += modes_.roller(i) <= 0 ? pull : -pull;
    return result;
  }

  State increments() const override { return {}; }

  // Sliding mode: only the edge between 0 and 1 is attractive, where the push of the lower roller is -push of the
  // upper.
  Sharing sharing(int i, const State& x, double t) const override {
    const double alpha = (1 + (2 * c_2[i] + 6 * c_3[i] * t + 12 * c_4[i] * t * t) / pull) / 2;
    return {alpha, pull > 0 && alpha >= 0 && alpha <= 1, x.dphi()[i] * x.dphi()[i], 0};  // as of rims of 1 rad/s
  }
  void enter_sliding(int i, std::int64_t k, State& x, double) override {
    modes_.share(i, k);
    x.phi()[i] = geometry.upper_edge(k);
    x.dphi()[i] = 0;
  }
  double max_step(const State&, double) const override { return std::numeric_limits<double>::infinity(); }

  // Reactions that have to be looked at, of wheels off the floor.
  bool reacts() const override { return reactions_matter; }
  FloorReactions reactions(const State&, double t) const override {
    EXPECT_GT(t, looked_at);
    looked_at = t;
    ++looks;
    return {};
  }
  bool reactions_matter = false;
  mutable double looked_at = 0;  // s
  mutable std::uint64_t looks = 0;

  State start() {
    State x;
    x.phi() = c_0;
    x.dphi() = c_1;
    modes_ = ContactModes(robot, c_0, max_located_dphi / geometry.pitch());
    return x;
  }

  Wheels c_0 = Wheels::Zero(), c_1 = Wheels::Zero(), c_2 = Wheels::Zero(), c_3 = Wheels::Zero(), c_4 = Wheels::Zero();
  double pull = 0, damping = 0;
  double max_located_dphi = std::numeric_limits<double>::infinity();  // rad/s
  int every_nth_step_fails = 0;                                       // none, if 0
  RobotParameters robot;                                              // n = 6
  RollerGeometry geometry{robot};

 private:
  void regularize_friction() override {}
};

/// A Controlled Stepper that steps a Wheelwork by its solution in closed form, to rounding. What it takes for its error
/// is what a cubic leaves out: steps have a length that depends on the tolerance, though their ends are exact. It
/// insists on odeint's protocol: a step that failed has no end.
class WheelworkStepper : public SmoothStepper {
 public:
  explicit WheelworkStepper(const Tolerance& tolerance) : error_scale_(tolerance.absolute + tolerance.relative) {}

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    const auto& wheels = static_cast<const Wheelwork&>(system);
    EXPECT_GT(dt, 0);
    EXPECT_TRUE(in.values.allFinite()) << "a step from the end of one that failed, at t = " << t;
    wheels.count_evaluations(1);
    State end = in;
    wheels.damping > 0 ? relax(wheels, end, dt) : fly(wheels, end, t, dt);
    for (int i = 0; i < kWheels; ++i) {
      if (!wheels.modes().shared(i)) continue;
      end.phi()[i] = in.phi()[i];
      end.dphi()[i] = 0;
    }
    const double error = this->error(wheels, in, dt);
    const int nth = wheels.every_nth_step_fails;
    const bool fails = !end.values.allFinite() || (nth > 0 && ++steps_ % nth == 0) || !(error <= 1);
    out = end;
    if (fails) {
      out.values.setConstant(std::numeric_limits<double>::quiet_NaN());
      dt *= 0.3;
      return boost::numeric::odeint::fail;
    }
    t += dt;
    dt *= std::min(0.9 / std::sqrt(std::sqrt(std::max(error, 1e-10))), 5.0);
    return boost::numeric::odeint::success;
  }

  void reset() override {}
  void restart() override { steps_ = 0; }

 private:
  double error(const Wheelwork& w, const State& x, double dt) const {
    // Fourth derivative at the step's start, over 4!
    Wheels fourth = w.damping > 0 ? Wheels(std::pow(w.damping, 3) / 24 * (w.damping * x.dphi() - w.push())) : w.c_4;
    for (int i = 0; i < kWheels; ++i) {
      if (w.modes().shared(i)) fourth[i] = 0;
    }
    return (fourth.abs() * std::pow(dt, 4)).maxCoeff() / error_scale_;
  }

  static void fly(const Wheelwork& w, State& x, double t, double dt) {
    const Wheels start = x.dphi();
    x.phi() += dt * (start + dt * (0.5 * w.push() + w.c_3 * (3 * t + dt) + w.c_4 * (6 * t * t + 4 * t * dt + dt * dt)));
    x.dphi() += dt * (w.push() + 3 * w.c_3 * (2 * t + dt) + 4 * w.c_4 * (3 * t * t + 3 * t * dt + dt * dt));
  }

  static void relax(const Wheelwork& w, State& x, double dt) {
    const Wheels rate = w.push() / w.damping;  // in the end
    const double decay = std::expm1(-w.damping * dt);
    x.phi() += dt * rate - decay / w.damping * (x.dphi() - rate);
    x.dphi() += decay * (x.dphi() - rate);
  }

  double error_scale_;
  int steps_ = 0;
};

/// The step of last resort for a Wheelwork: wheels go on as fast as they are.
inline void fly_on(State& x, double, double dt) { x.phi() += dt * x.dphi(); }

constexpr int kRollers = 6;

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
        switches.push_back(
            {static_cast<double>(low), i, wrapped(from, kRollers), wrapped(to, kRollers), edge, rises ? 1 : -1});
      }
    }
  }
  return switches;
}

}  // namespace youbot_base_sim
