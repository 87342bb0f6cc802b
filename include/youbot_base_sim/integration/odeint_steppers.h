#pragma once

#include <algorithm>
#include <boost/numeric/odeint/stepper/bulirsch_stoer.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/implicit_euler.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_controller.hpp>
#include <cmath>
#include <functional>
#include <optional>
#include <type_traits>
#include <utility>

#include "youbot_base_sim/integration/difference_jacobian.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

// odeint's own steppers as SmoothSteppers, made from a tolerance, a fixed step (s) and the statistics to count in.

/// odeint's Error Checker for a State: judges the velocities as Radau does, so that a tolerance means the same.
class VelocityErrorChecker {
 public:
  explicit VelocityErrorChecker(const Tolerance& tolerance = {1e-6, 1e-6}) : tolerance_(tolerance) {}

  template <class Algebra, class Derivative>
  double error(Algebra&, const State& x_old, const Derivative&, const State& error, double) const {
    return error_norm(error.velocities(), error_scale(tolerance_, x_old.velocities()));
  }

 private:
  Tolerance tolerance_;
};

/// odeint's own Step Adjuster, with our roots in place of powers.
class StepAdjuster : public boost::numeric::odeint::default_step_adjuster<double, double> {
 public:
  double decrease_step(double dt, double error, int error_order) const {
    return dt * std::max(0.9 / root(error, error_order - 1), 0.2);
  }
  double increase_step(double dt, double error, int stepper_order) const {
    return error < 0.5 ? dt * (0.9 * std::min(1 / root(error, stepper_order), 5.0)) : dt;
  }
};

/// An explicit Runge-Kutta method of odeint with its step size control, at the tolerance over `divisor`.
template <class ErrorStepper, int divisor = 1>
class ControlledRungeKutta final : public GeneralMethod {
 public:
  ControlledRungeKutta(const Tolerance& tolerance, double, IntegrationStatistics&)
      : controlled_(VelocityErrorChecker(share_of(tolerance, 1.0 / divisor))) {}

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    if (!known_ || t != t_ || (in.values != x_.values).any()) {
      system(in, dxdt_, t);
      known_ = true;
      t_ = t;
      x_ = in;
    }
    if constexpr (std::is_same_v<typename ErrorStepper::stepper_category,
                                 boost::numeric::odeint::explicit_error_stepper_fsal_tag>) {
      const auto result = controlled_.try_step(std::ref(system), in, dxdt_, t, out, end_dxdt_, dt);
      if (result == boost::numeric::odeint::success) {  // the last stage is the next step's first
        x_ = out;
        t_ = t;
        dxdt_ = end_dxdt_;
      }
      return result;
    } else {
      return controlled_.try_step(std::ref(system), in, dxdt_, t, out, dt);
    }
  }

  void reset() override { known_ = false; }

 private:
  boost::numeric::odeint::controlled_runge_kutta<ErrorStepper, VelocityErrorChecker, StepAdjuster> controlled_;
  bool known_ = false;  // the derivative at x_, t_
  double t_ = 0;
  State x_, dxdt_, end_dxdt_;
};

/// odeint's Bulirsch-Stoer method.
class BulirschStoer final : public GeneralMethod {
 public:
  BulirschStoer(const Tolerance& tolerance, double, IntegrationStatistics&)
      : stepper_(tolerance.absolute, tolerance.relative) {}

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    return stepper_.try_step(std::ref(system), in, t, out, dt);
  }
  void reset() override { stepper_.reset(); }

 private:
  boost::numeric::odeint::bulirsch_stoer<State> stepper_;
};

/// odeint's coefficients of Rosenbrock's method of order 4, with the sign of d4 that Hairer and Wanner's table and the
/// order conditions have. As shipped it is +0.0362, which leaves order 1 where the torque is a function of time.
struct CorrectedRosenbrock4 : boost::numeric::odeint::default_rosenbrock_coefficients<double> {
  const double d4 = -0.3620000000000023e-01;  // hides the base's
};
using ShippedRosenbrock4 = boost::numeric::odeint::default_rosenbrock_coefficients<double>;

/// A System as functions on uBLAS vectors, for odeint's implicit steppers. Wheel angles count from the middle of the
/// roller, so that a relative tolerance does not loosen as the wheels turn.
class UblasSystem {
 public:
  using Vector = boost::numeric::ublas::vector<double>;
  using Matrix = boost::numeric::ublas::matrix<double>;

  UblasSystem(const SmoothSystem& system, const State& x, IntegrationStatistics& statistics)
      : system_(&system), statistics_(&statistics) {
    const Wheels middle = system.middle();
    for (int i = 0; i < kWheels; ++i) origin_[i] = std::isfinite(middle[i]) ? middle[i] : x.phi()[i];
  }

  void to_vector(const State& x, Vector& y) const {
    State relative = x;
    relative.phi() -= origin_;
    std::copy(relative.begin(), relative.end(), y.begin());
  }
  State state(const Vector& y) const {
    State x;
    std::copy(y.begin(), y.end(), x.begin());
    x.phi() += origin_;
    return x;
  }

  /// Sets dydt to dy/dt, as a function of y and t.
  auto derivative() const {
    return [this](const Vector& y, Vector& dydt, double t) {
      State dxdt;
      (*system_)(state(y), dxdt, t);
      std::copy(dxdt.begin(), dxdt.end(), dydt.begin());
    };
  }
  /// Sets J and dfdt to the derivatives of dy/dt by y and t.
  auto jacobian() const {
    return [this](const Vector& y, Matrix& J, double t, Vector& dfdt) {
      State rate;
      difference_jacobian(*system_, state(y), t, J, rate);
      std::copy(rate.begin(), rate.end(), dfdt.begin());
      ++statistics_->factorizations;
    };
  }

 private:
  const SmoothSystem* system_;
  IntegrationStatistics* statistics_;
  Wheels origin_;
};

/// odeint's rosenbrock4 under its rosenbrock4_controller.
template <class Coefficients>
class Rosenbrock4 final : public GeneralMethod {
 public:
  Rosenbrock4(const Tolerance& tolerance, double, IntegrationStatistics& statistics)
      : tolerance_(tolerance), statistics_(&statistics), y_(State().values.size()), y_end_(y_.size()) {
    reset();
  }

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    const UblasSystem ublas(system, in, *statistics_);
    ublas.to_vector(in, y_);
    const auto result = controller_->try_step(std::pair(ublas.derivative(), ublas.jacobian()), y_, t, y_end_, dt);
    if (result == boost::numeric::odeint::success) out = ublas.state(y_end_);
    return result;
  }
  // odeint's has no reset().
  void reset() override { controller_.emplace(tolerance_.absolute, tolerance_.relative); }

 private:
  using Stepper = boost::numeric::odeint::rosenbrock4<double, Coefficients>;

  Tolerance tolerance_;
  IntegrationStatistics* statistics_;
  std::optional<boost::numeric::odeint::rosenbrock4_controller<Stepper>> controller_;
  boost::numeric::ublas::vector<double> y_, y_end_;
};

/// A method of odeint without step size control, with steps of one length at most. Method: step(system, in, t, out,
/// dt).
template <class Method>
class FixedStep final : public GeneralMethod {
 public:
  FixedStep(const Tolerance&, double step, IntegrationStatistics& statistics) : step_(step), method_(statistics) {}

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    const double length = dt;
    dt = step_;
    if (length > kSliver * step_) return boost::numeric::odeint::fail;
    method_.step(system, in, t, out, length);
    t += length;
    return boost::numeric::odeint::success;
  }
  void reset() override {}

 private:
  static constexpr double kSliver = 1.02;  // a step may be this much longer, to end where it must

  double step_;
  Method method_;
};

/// A Stepper of odeint that works on a State, such as runge_kutta4.
template <class Stepper>
class ExplicitStep {
 public:
  explicit ExplicitStep(IntegrationStatistics&) {}
  void step(const SmoothSystem& system, const State& in, double t, State& out, double dt) {
    stepper_.do_step(std::ref(system), in, t, out, dt);
  }

 private:
  Stepper stepper_;
};

/// odeint's implicit_euler, with one Newton iteration (its comments call that the linearly implicit scheme): beyond the
/// first, the version of Boost 1.74 factorizes the factors of its Jacobian again.
class ImplicitEulerStep {
 public:
  explicit ImplicitEulerStep(IntegrationStatistics& statistics)
      : statistics_(&statistics), y_(State().values.size()), dfdt_(y_.size()) {}
  void step(const SmoothSystem& system, const State& in, double t, State& out, double dt) {
    const UblasSystem ublas(system, in, *statistics_);
    ublas.to_vector(in, y_);
    const auto jacobian = [&](const auto& y, auto& J, double time) { ublas.jacobian()(y, J, time, dfdt_); };
    stepper_.do_step(std::pair(ublas.derivative(), jacobian), y_, t, dt);
    out = ublas.state(y_);
  }

 private:
  IntegrationStatistics* statistics_;
  boost::numeric::odeint::implicit_euler<double> stepper_{kInfinity};
  boost::numeric::ublas::vector<double> y_, dfdt_;
};

}  // namespace youbot_base_sim
