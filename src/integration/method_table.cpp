// The methods that can be selected, and odeint's steppers as SmoothSteppers.

#include <algorithm>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4.hpp>
#include <boost/numeric/odeint/stepper/rosenbrock4_controller.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <functional>
#include <optional>
#include <utility>

#include "youbot_base_sim/integration/difference_jacobian.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;
namespace ublas = boost::numeric::ublas;

namespace {

/// odeint's Error Checker for a State: judges the velocities as Radau does, so that a tolerance means the same. Rollers
/// count in full: an explicit method at its limit of stability makes the allowed error in each step, and where the slip
/// of rollers quivers, their wheels creep as fast.
class VelocityErrorChecker {
 public:
  explicit VelocityErrorChecker(const Tolerance& tolerance = {1e-6, 1e-6}) : tolerance_(tolerance) {}

  template <class Algebra>
  double error(Algebra&, const State& x_old, const State&, const State& error, double) const {
    // Stands for an error that is no number, too, which no step adjuster knows how to shorten.
    constexpr double kLargest = 1e30;
    const double norm = error_norm(error.velocities(), error_scale(tolerance_, x_old.velocities(), 1));
    return norm < kLargest ? norm : kLargest;
  }

 private:
  Tolerance tolerance_;
};

/// odeint's own Step Adjuster, with our roots in place of powers.
class StepAdjuster : public odeint::default_step_adjuster<double, double> {
 public:
  double decrease_step(double dt, double error, int error_order) const {
    return dt * std::max(0.9 / root(error, error_order - 1), 0.2);
  }
  double increase_step(double dt, double error, int stepper_order) const {
    return error < 0.5 ? dt * (0.9 * std::min(1 / root(error, stepper_order), 5.0)) : dt;
  }
};

/// odeint's method of Dormand and Prince with its step size control.
class Dopri5 final : public SmoothStepper {
 public:
  Dopri5(const Tolerance& tolerance, IntegrationStatistics&) : controlled_(VelocityErrorChecker(tolerance)) {}

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    if (!known_ || t != t_ || (in.values != x_.values).any()) {
      system(in, dxdt_, t);
      known_ = true;
      t_ = t;
      x_ = in;
    }
    const Result result = controlled_.try_step(std::ref(system), in, dxdt_, t, out, end_dxdt_, dt);
    if (result == odeint::success) {  // the last stage is the next step's first
      x_ = out;
      t_ = t;
      dxdt_ = end_dxdt_;
    }
    return result;
  }
  void reset() override { known_ = false; }

 private:
  odeint::controlled_runge_kutta<odeint::runge_kutta_dopri5<State>, VelocityErrorChecker, StepAdjuster> controlled_;
  bool known_ = false;  // the derivative at x_, t_
  double t_ = 0;
  State x_, dxdt_, end_dxdt_;
};

/// odeint's coefficients of Rosenbrock's method of order 4, with the sign of d4 that Hairer and Wanner's table and the
/// order conditions have. Boost 1.74 has +0.0362, which leaves order 1 where the torque is a function of time.
struct CorrectedRosenbrock4 : odeint::default_rosenbrock_coefficients<double> {
  const double d4 = -0.3620000000000023e-01;  // hides the base's
};

/// odeint's rosenbrock4 under its rosenbrock4_controller. Wheel angles count from the middle of the roller, so that a
/// relative tolerance does not loosen as the wheels rotate.
class Rosenbrock4 final : public SmoothStepper {
 public:
  Rosenbrock4(const Tolerance& tolerance, IntegrationStatistics& statistics)
      : tolerance_(tolerance), statistics_(&statistics) {
    reset();
  }

  Result try_step(const SmoothSystem& system, const State& in, double& t, State& out, double& dt) override {
    const Wheels middle = system.middle(), origin = middle.isFinite().select(middle, in.phi());
    const auto state = [&](const Vector& y) {
      State x;
      std::copy(y.begin(), y.end(), x.begin());
      x.phi() += origin;
      return x;
    };
    const auto derivative = [&](const Vector& y, Vector& dydt, double time) {
      State dxdt;
      system(state(y), dxdt, time);
      std::copy(dxdt.begin(), dxdt.end(), dydt.begin());
    };
    const auto jacobian = [&](const Vector& y, ublas::matrix<double>& J, double time, Vector& dfdt) {
      const DifferenceJacobian difference = difference_jacobian(system, state(y), time);
      for (int row = 0; row < State::kSize; ++row) {
        for (int column = 0; column < State::kSize; ++column) J(row, column) = difference.by_state(row, column);
      }
      std::copy(difference.by_time.begin(), difference.by_time.end(), dfdt.begin());
      ++statistics_->factorizations;
    };
    State relative = in;
    relative.phi() -= origin;
    std::copy(relative.begin(), relative.end(), y_.begin());
    const Result result = controller_->try_step(std::pair(derivative, jacobian), y_, t, y_end_, dt);
    if (result == odeint::success) out = state(y_end_);
    return result;
  }
  // odeint's has no reset().
  void reset() override { controller_.emplace(tolerance_.absolute, tolerance_.relative); }

 private:
  using Vector = ublas::vector<double>;

  Tolerance tolerance_;
  IntegrationStatistics* statistics_;
  std::optional<odeint::rosenbrock4_controller<odeint::rosenbrock4<double, CorrectedRosenbrock4>>> controller_;
  Vector y_ = Vector(State::kSize), y_end_ = Vector(State::kSize);
};

template <class Made>
std::unique_ptr<SmoothStepper> make(const Tolerance& tolerance, IntegrationStatistics& statistics) {
  return std::make_unique<Made>(tolerance, statistics);
}

}  // namespace

const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = {
      {"radau", "Radau IIA of order 5, implicit, made for this problem: the one to use", false, nullptr},
      {"rosenbrock4", "odeint's, linearly implicit, of order 4, with d4 corrected: an independent check", false,
       make<Rosenbrock4>},
      {"dopri5", "odeint's Dormand-Prince, explicit, of order 5: where all wheels slip fast", true, make<Dopri5>},
  };
  return kMethods;
}

const Method* find_method(const std::string& name) {
  const std::vector<Method>& all = methods();
  const auto found = std::find_if(all.begin(), all.end(), [&](const Method& method) { return method.name == name; });
  return found == all.end() ? nullptr : &*found;
}

}  // namespace youbot_base_sim
