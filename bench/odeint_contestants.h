#pragma once

#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/implicit_euler.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_controller.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

#include "located_run.h"

// Boost's odeint, for LocatedRun.

namespace youbot_base_sim {
namespace bench {

namespace odeint = boost::numeric::odeint;
namespace ublas = boost::numeric::ublas;

/// odeint ships RODAS with d4 = +0.0362; Hairer and Wanner, section IV.7, have -0.0362, which its order needs where the
/// right-hand side depends on time. The same in all else.
struct CorrectedRodas : odeint::default_rosenbrock_coefficients<double> {
  const double d4 = -0.3620000000000023e-01;  // hides the base's
};

/// A SlipProblem as the pair of functions that odeint's implicit steppers ask for.
template <class Problem>
class UblasSystem {
 public:
  using Vector = ublas::vector<double>;
  using Matrix = ublas::matrix<double>;

  struct Derivative {
    Problem* problem;
    void operator()(const Vector& y, Vector& dydt, double t) const { problem->derivative(t, &y[0], &dydt[0]); }
  };
  struct Jacobian {
    Problem* problem;
    void operator()(const Vector& y, Matrix& J, double t) const {
      std::fill(J.data().begin(), J.data().end(), 0.0);
      double* data = &J.data()[0];
      problem->jacobian(t, &y[0], data, kSize, 1);
      ++problem->counts.factorizations;
    }
    void operator()(const Vector& y, Matrix& J, double t, Vector& dfdt) const {
      (*this)(y, J, t);
      problem->time_derivative(t, &dfdt[0]);
    }
  };

  static std::pair<Derivative, Jacobian> of(Problem& problem) { return {{&problem}, {&problem}}; }
};

/// rosenbrock4 under rosenbrock4_controller, with its dense output.
template <class Problem, class Coefficients>
class OdeintRosenbrock {
 public:
  using Vector = ublas::vector<double>;
  static constexpr bool kDense = true;
  static Vector zero() { return ublas::zero_vector<double>(kSize); }

  explicit OdeintRosenbrock(double tolerance) : tolerance_(tolerance), controller_(make()) {}

  bool attempt(Problem& problem, double t, const Vector& y, double& dt, Vector& y_new) {
    prepared_ = false;
    return controller_.try_step(UblasSystem<Problem>::of(problem), y, t, y_new, dt) == odeint::success;
  }
  void repeat(Problem& problem, double t, const Vector& y, double dt, Vector& y_new) {
    prepared_ = false;
    controller_.stepper().do_step(UblasSystem<Problem>::of(problem), y, t, y_new, dt);
  }
  void restart() { controller_ = Slot(make()); }
  bool interpolate(double t_0, const Vector& y_0, double t_1, const Vector& y_1, double t, Vector& y) {
    if (!prepared_) controller_.stepper().prepare_dense_output();
    prepared_ = true;
    controller_.stepper().calc_state(t, y, y_0, t_0, y_1, t_1);
    return true;
  }

 private:
  using Stepper = odeint::rosenbrock4<double, Coefficients>;
  using Controller = odeint::rosenbrock4_controller<Stepper>;

  // The controller cannot be assigned or told to forget; a new one in its place can.
  class Slot {
   public:
    explicit Slot(std::unique_ptr<Controller> controller) : controller_(std::move(controller)) {}
    template <class... Arguments>
    auto try_step(Arguments&&... arguments) {
      return controller_->try_step(std::forward<Arguments>(arguments)...);
    }
    Stepper& stepper() { return controller_->stepper(); }

   private:
    std::unique_ptr<Controller> controller_;
  };
  std::unique_ptr<Controller> make() const {
    return std::make_unique<Controller>(kAbsolute * tolerance_, tolerance_, Stepper());
  }

  static constexpr double kAbsolute = 0.1;  // of the relative tolerance
  double tolerance_;
  Slot controller_;
  bool prepared_ = false;
};

/// One of odeint's steppers with a fixed step. Method: Vector, zero(), step(problem, t, y, dt, y_new).
template <class Problem, class Method>
class OdeintFixedStep {
 public:
  using Vector = typename Method::Vector;
  static constexpr bool kDense = false;
  static Vector zero() { return Method::zero(); }

  explicit OdeintFixedStep(double dt) : dt_(dt) {}

  bool attempt(Problem& problem, double t, const Vector& y, double& dt, Vector& y_new) {
    repeat(problem, t, y, dt, y_new);
    dt = dt_;
    return true;
  }
  void repeat(Problem& problem, double t, const Vector& y, double dt, Vector& y_new) {
    method_.step(problem, t, y, dt, y_new);
  }
  void restart() {}
  bool interpolate(double, const Vector&, double, const Vector&, double, Vector&) { return false; }

 private:
  double dt_;
  Method method_;
};

/// implicit_euler. With one Newton step (its own comments call that the linearly implicit scheme): beyond the first,
/// the version that Boost 1.74 ships factorises the factors of its Jacobian again.
class ImplicitEulerMethod {
 public:
  using Vector = ublas::vector<double>;
  static Vector zero() { return ublas::zero_vector<double>(kSize); }

  template <class Problem>
  void step(Problem& problem, double t, const Vector& y, double dt, Vector& y_new) {
    y_new = y;
    stepper_.do_step(UblasSystem<Problem>::of(problem), y_new, t, dt);
  }

 private:
  odeint::implicit_euler<double> stepper_{std::numeric_limits<double>::infinity()};
};

template <class Problem>
using OdeintImplicitEuler = OdeintFixedStep<Problem, ImplicitEulerMethod>;

/// A SlipProblem for odeint's explicit steppers.
template <class Problem>
struct ArraySystem {
  Problem* problem;
  void operator()(const Numbers& y, Numbers& dydt, double t) const { problem->derivative(t, y.data(), dydt.data()); }
};

/// runge_kutta_dopri5 under odeint's step size control.
template <class Problem>
class OdeintDopri5 {
 public:
  using Vector = Numbers;
  static constexpr bool kDense = false;
  static Vector zero() { return Numbers{}; }

  explicit OdeintDopri5(double tolerance)
      : controlled_(odeint::make_controlled(0.1 * tolerance, tolerance, odeint::runge_kutta_dopri5<Numbers>())) {}

  bool attempt(Problem& problem, double t, const Vector& y, double& dt, Vector& y_new) {
    if (!known_) problem.derivative(t, y.data(), dydt_.data());
    known_ = true;
    const auto result = controlled_.try_step(ArraySystem<Problem>{&problem}, y, dydt_, t, y_new, dydt_new_, dt);
    if (result == odeint::success) dydt_ = dydt_new_;  // the last stage is the next step's first
    return result == odeint::success;
  }
  void repeat(Problem& problem, double t, const Vector& y, double dt, Vector& y_new) {
    problem.derivative(t, y.data(), dydt_.data());
    odeint::runge_kutta_dopri5<Numbers>().do_step(ArraySystem<Problem>{&problem}, y, dydt_, t, y_new, dydt_new_, dt);
  }
  void restart() { known_ = false; }
  bool interpolate(double, const Vector&, double, const Vector&, double, Vector&) { return false; }

 private:
  odeint::controlled_runge_kutta<odeint::runge_kutta_dopri5<Numbers>> controlled_;
  bool known_ = false;
  Numbers dydt_, dydt_new_;
};

/// runge_kutta4.
class RungeKutta4Method {
 public:
  using Vector = Numbers;
  static Vector zero() { return Numbers{}; }

  template <class Problem>
  void step(Problem& problem, double t, const Vector& y, double dt, Vector& y_new) {
    stepper_.do_step(ArraySystem<Problem>{&problem}, y, t, y_new, dt);
  }

 private:
  odeint::runge_kutta4<Numbers> stepper_;
};

template <class Problem>
using OdeintRungeKutta4 = OdeintFixedStep<Problem, RungeKutta4Method>;

}  // namespace bench
}  // namespace youbot_base_sim
