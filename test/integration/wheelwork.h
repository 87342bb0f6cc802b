#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <boost/numeric/odeint/util/unwrap_reference.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// A System with edges: four wheels that turn independently, ddphi = 2 c_2 + 6 c_3 t + 12 c_4 t^2 -+ pull - damping
/// dphi, the pull being towards the edge between rollers 0 and 1. Without pull and damping phi is a polynomial of
/// degree four in time, which a cubic between two of its points does not hit. With damping, c_3 and c_4 have to be
/// zero.
class Wheelwork {
 public:
  using State = youbot_base_sim::State;
  using Flags = Eigen::Array<bool, kWheels, 1>;

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

  // Edges.
  const Wheels& lower_edge() const { return lower_edge_; }
  const Wheels& upper_edge() const { return upper_edge_; }
  std::int64_t roller(int i) const { return roller_[i]; }
  int rollers() const { return 6; }
  void put(int i, std::int64_t k) {
    roller_[i] = k;
    shared_[i] = averaged_[i] = false;
    lower_edge_[i] = geometry.upper_edge(k - 1);
    upper_edge_[i] = geometry.upper_edge(k);
  }
  void hand_over(int i, std::int64_t k, State& x) {
    put(i, k);
    if (stops_rollers) x.dgamma()[i] = 0;
  }

  // Sliding mode: only the edge between 0 and 1 is attractive, where the push of the lower roller is -push of the
  // upper.
  bool attractive(int i, const State&, double t) const {
    const double share = alpha(i, {}, t);
    return pull > 0 && share >= 0 && share <= 1;
  }
  double alpha(int i, const State&, double t) const {
    return (1 + (2 * c_2[i] + 6 * c_3[i] * t + 12 * c_4[i] * t * t) / pull) / 2;
  }
  void enter_sliding(int i, std::int64_t k, State& x) {
    shared_[i] = true;
    lower_roller_[i] = k;
    remove_edges(i);
    x.phi()[i] = geometry.upper_edge(k);
    x.dphi()[i] = 0;
  }
  bool shared(int i) const { return shared_[i]; }
  bool shares() const { return shared_.any(); }
  std::int64_t lower_roller(int i) const { return lower_roller_[i]; }
  double momentum(int i, const State& x) const { return std::abs(x.dphi()[i]); }

  // Averaging, which changes nothing about how wheels turn.
  static double max_step(const State&) { return std::numeric_limits<double>::infinity(); }
  bool watches() const { return is_watched; }
  static bool ends_tipping() { return false; }
  static bool tips(const State&, double) { return false; }
  void watch(const State&, double t, double dt) {
    EXPECT_NEAR(t - dt, watched_until, 1e-12);
    watched_until = t;
  }
  bool is_watched = false;
  double watched_until = 0;  // s, without a gap

  bool averages() const { return averaged_.any(); }
  bool averaged(int i) const { return averaged_[i]; }
  bool too_fast(int i, const State& x) const { return std::abs(x.dphi()[i]) > max_located_dphi; }
  bool slow_again(int i, const State& x) const {
    return averaged_[i] && std::abs(x.dphi()[i]) < 0.8 * max_located_dphi;
  }
  void average(int i) {
    averaged_[i] = true;
    shared_[i] = false;
    remove_edges(i);
  }
  void follow(int i, const State& x) { roller_[i] = geometry.roller_at(x.phi()[i]); }

  // What a GuardedStepper asks for.
  struct Model {
    const RollerGeometry& geometry() const { return *rollers; }
    const RollerGeometry* rollers;
  };
  Model model() const { return {&geometry}; }
  double transition_speed() const { return 0; }
  void set_transition_speed(double) {}
  std::uint64_t evaluations() const { return evaluations_; }
  void count_evaluations(std::uint64_t more) const { evaluations_ += more; }

  State start() {
    State x;
    x.phi() = c_0;
    x.dphi() = c_1;
    for (int i = 0; i < kWheels; ++i) put(i, geometry.roller_at(c_0[i]));
    return x;
  }

  Wheels c_0 = Wheels::Zero(), c_1 = Wheels::Zero(), c_2 = Wheels::Zero(), c_3 = Wheels::Zero(), c_4 = Wheels::Zero();
  double pull = 0, damping = 0;
  double max_located_dphi = std::numeric_limits<double>::infinity();  // rad/s
  int every_nth_step_fails = 0;                                       // none, if 0
  bool stops_rollers = false;                                         // at a switch
  RollerGeometry geometry{RobotParameters{}};                         // n = 6

 private:
  void remove_edges(int i) {
    lower_edge_[i] = -std::numeric_limits<double>::infinity();
    upper_edge_[i] = std::numeric_limits<double>::infinity();
  }

  std::array<std::int64_t, kWheels> roller_{}, lower_roller_{};
  Flags shared_ = Flags::Constant(false), averaged_ = Flags::Constant(false);
  Wheels lower_edge_ = Wheels::Zero(), upper_edge_ = Wheels::Zero();
  mutable std::uint64_t evaluations_ = 0;
};

/// A Controlled Stepper that steps a Wheelwork by its solution in closed form, to rounding. What it takes for its error
/// is what a cubic leaves out: steps have a length that depends on the tolerance, though their ends are exact. It
/// insists on odeint's protocol: a step that failed has no end.
class WheelworkStepper {
 public:
  using Result = boost::numeric::odeint::controlled_step_result;

  explicit WheelworkStepper(const Tolerance& tolerance) : error_scale_(tolerance.absolute + tolerance.relative) {}

  template <class System>
  Result try_step(System system, const State& in, double& t, State& out, double& dt) {
    const Wheelwork& wheels = system;
    EXPECT_GT(dt, 0);
    EXPECT_TRUE(in.values.allFinite()) << "a step from the end of one that failed, at t = " << t;
    wheels.count_evaluations(1);
    State end = in;
    wheels.damping > 0 ? relax(wheels, end, dt) : fly(wheels, end, t, dt);
    for (int i = 0; i < kWheels; ++i) {
      if (!wheels.shared(i)) continue;
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

  void reset() {}

 private:
  double error(const Wheelwork& w, const State& x, double dt) const {
    // Fourth derivative at the step's start, over 4!
    Wheels fourth = w.damping > 0 ? Wheels(std::pow(w.damping, 3) / 24 * (w.damping * x.dphi() - w.push())) : w.c_4;
    for (int i = 0; i < kWheels; ++i) {
      if (w.shared(i)) fourth[i] = 0;
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

/// The step of last resort for a Wheelwork, a Stepper of odeint that never fails: wheels go on as fast as they are.
class WheelworkFallback {
 public:
  using stepper_category = boost::numeric::odeint::stepper_tag;

  template <class System>
  void do_step(System, State& x, double, double dt) {
    x.phi() += dt * x.dphi();
  }
};

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
