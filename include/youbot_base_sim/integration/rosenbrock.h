#pragma once

#include <algorithm>
#include <array>
#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <cmath>
#include <limits>

namespace youbot_base_sim {

// The steppers below ask this of a System, besides odeint's `system(x, dxdt, t)`:
//
//   System::State          with a fixed-size Eigen array `values`
//   System::Linearization  default-constructible
//   system.linearize(x, t, linearization, dfdt)  analytic Jacobian and df/dt
//   Linearization::factorize(alpha)              prepares (alpha I - J) u = b
//   Linearization::solve(b, u)
//   system.error_norm(x_old, x_new, error, relative, absolute)   1 where the error is just allowed

/// One step of a Rosenbrock method: linearly implicit, one factorisation a step, nothing allocated. Models odeint's
/// error stepper.
template <class Tableau, class System>
class Rosenbrock {
 public:
  using state_type = typename System::State;
  using deriv_type = state_type;
  using value_type = double;
  using time_type = double;
  using order_type = unsigned short;
  using stepper_category = boost::numeric::odeint::error_stepper_tag;

  static order_type order() { return Tableau::order; }
  static order_type stepper_order() { return Tableau::order; }
  static order_type error_order() { return Tableau::error_order; }

  /// Advances x by dt (s).
  template <class SystemOrReference>
  void do_step(SystemOrReference system, state_type& x, double t, double dt) {
    state_type error;
    do_step(system, x, t, dt, error);
  }

  /// The same, and the estimate of the step's error.
  template <class SystemOrReference>
  void do_step(SystemOrReference system, state_type& x, double t, double dt, state_type& error) {
    const System& unwrapped = system;
    state_type x_new;
    linearize(unwrapped, x, t);
    step(unwrapped, dt, x_new, error);
    x = x_new;
  }

  /// Evaluates all that steps from (x, t) share, whatever their length.
  void linearize(const System& system, const state_type& x, double t) {
    x_ = x;
    t_ = t;
    system(x, dxdt_, t);
    system.linearize(x, t, linearization_, dfdt_);
  }

  /// State after a step of length dt (s) from where `linearize` was called, and the estimate of its error.
  void step(const System& system, double dt, state_type& x_new, state_type& error) {
    constexpr int s = Tableau::stages;
    linearization_.factorize(1 / (dt * Tableau::gamma));
    state_type stage, b;
    for (int i = 0; i < s; ++i) {
      if (i == 0) {
        b.values = dxdt_.values + (Tableau::d[0] * dt) * dfdt_.values;
      } else {
        stage.values = x_.values + Tableau::a[i][0] * U_[0].values;
        for (int j = 1; j < i; ++j) stage.values += Tableau::a[i][j] * U_[j].values;
        system(stage, b, t_ + Tableau::alpha[i] * dt);
        for (int j = 0; j < i; ++j) b.values += (Tableau::c[i][j] / dt) * U_[j].values;
        if (Tableau::d[i] != 0) b.values += (Tableau::d[i] * dt) * dfdt_.values;
      }
      linearization_.solve(b, U_[i]);
    }
    x_new.values = stage.values + U_[s - 1].values;
    error = U_[s - 1];
  }

 private:
  double t_ = 0;
  state_type x_, dxdt_, dfdt_;
  typename System::Linearization linearization_;
  std::array<state_type, Tableau::stages> U_;
};

/// Errors that a step may make: relative to a velocity, and absolute (a value in SI units for every component).
struct Tolerance {
  double relative;
  double absolute;
};

/// Step size by the error of the last two steps (Gustafsson's predictive controller; Hairer and Wanner, section IV.8).
class StepSizeController {
 public:
  explicit StepSizeController(int error_order) : exponent_(1.0 / (error_order + 1)) {}

  /// Next length after a step of length dt with the given norm of its error; the step stands if the norm is <= 1.
  double next(double dt, double norm) {
    if (!(norm <= std::numeric_limits<double>::max())) {  // also not a number
      rejected_ = true;
      return dt * kShrinkMost;
    }
    double factor = kSafety * std::pow(std::max(norm, kLeastNorm), -exponent_);
    if (norm > 1) {
      rejected_ = true;
      return dt * std::max(factor, kShrinkMost);
    }
    if (last_dt_ > 0) {
      const double trend = kSafety * (dt / last_dt_) * std::pow(last_norm_ / (norm * norm + kLeastNorm), exponent_);
      factor = std::min(factor, trend);
    }
    factor = std::min(std::max(factor, kShrinkMost), rejected_ ? 1.0 : kGrowMost);
    last_dt_ = dt;
    last_norm_ = std::max(norm, 0.01);
    rejected_ = false;
    return dt * factor;
  }

  /// Forgets the last step: the motion goes on in another way.
  void restart() { last_dt_ = 0; }

 private:
  static constexpr double kSafety = 0.9;
  static constexpr double kShrinkMost = 0.2;
  static constexpr double kGrowMost = 6;
  static constexpr double kLeastNorm = 1e-10;

  double exponent_;
  double last_dt_ = 0;
  double last_norm_ = 1;
  bool rejected_ = false;
};

/// Rosenbrock method with step size control: models odeint's controlled stepper.
template <class Tableau, class System>
class ControlledRosenbrock {
 public:
  using stepper_type = Rosenbrock<Tableau, System>;
  using state_type = typename System::State;
  using deriv_type = state_type;
  using value_type = double;
  using time_type = double;
  using stepper_category = boost::numeric::odeint::controlled_stepper_tag;

  explicit ControlledRosenbrock(const Tolerance& tolerance) : tolerance_(tolerance), control_(Tableau::error_order) {}

  /// Tries a step of length dt (s) from (x, t). On success moves both on; in any case sets dt to the length to try
  /// next.
  template <class SystemOrReference>
  boost::numeric::odeint::controlled_step_result try_step(SystemOrReference system, state_type& x, double& t,
                                                          double& dt) {
    const System& unwrapped = system;
    state_type x_new, error;
    stepper_.linearize(unwrapped, x, t);
    stepper_.step(unwrapped, dt, x_new, error);
    const double norm = unwrapped.error_norm(x, x_new, error, tolerance_.relative, tolerance_.absolute);
    const double tried = dt;
    dt = control_.next(dt, norm);
    if (!(norm <= 1)) return boost::numeric::odeint::fail;
    x = x_new;
    t += tried;
    return boost::numeric::odeint::success;
  }

 private:
  Tolerance tolerance_;
  stepper_type stepper_;
  StepSizeController control_;
};

}  // namespace youbot_base_sim
