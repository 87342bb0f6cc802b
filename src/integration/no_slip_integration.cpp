#include "youbot_base_sim/integration/no_slip_integration.h"

#include <algorithm>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <functional>

#include "youbot_base_sim/integration/odeint_steppers.h"

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

namespace {

/// Model 1 as a System with a Jacobian, for Rosenbrock4.
struct NoSlipSystem {
  const NoSlipModel& model;
  const TorqueProfile& torque;
  IntegrationStatistics& statistics;

  void operator()(const State& x, State& dxdt, double t) const {
    ++statistics.evaluations;
    model.derivative(x, torque.value(t), dxdt);
  }
  template <class Matrix>
  void jacobian(const State& x, Matrix& J, double t, State& dfdt) const {
    model.jacobian(x, torque.value(t), torque.derivative(t), J, dfdt);
  }
  Wheels lower_edge() const { return Wheels::Constant(-std::numeric_limits<double>::infinity()); }
  Wheels upper_edge() const { return Wheels::Constant(std::numeric_limits<double>::infinity()); }
};

/// Rosenbrock4 as a Controlled Stepper of odeint.
class StiffStepper : public ControlledStepperTypes {
 public:
  StiffStepper(const Tolerance& tolerance, IntegrationStatistics& statistics) : rosenbrock4_(tolerance, statistics) {}
  template <class System>
  Result try_step(System system, State& x, double& t, double& dt) {
    return rosenbrock4_.try_step(system, x, t, x, dt);
  }

 private:
  Rosenbrock4<CorrectedRosenbrock4> rosenbrock4_;
};

}  // namespace

void NoSlipIntegration::advance_periods(State& x, std::int64_t first, double period, std::size_t n,
                                        const PeriodObserver& observer) {
  for (std::size_t k = 0; k < n; ++k) {
    observer(k);
    const auto now = static_cast<double>(first) + static_cast<double>(k);
    advance(x, now * period, (now + 1) * period);
  }
  observer(n);
}

void NoSlipIntegration::advance(State& x, double t, double t_end) {
  if (!(t < t_end)) return;
  const NoSlipSystem system{model_, torque_, statistics_};
  const double dt = std::min(t_end - t, max_first_step_);
  const auto observer = [this](const State&, double) {
    if (stop_ && *stop_) throw Stopped();
  };
  if (stiff_) {
    StiffStepper stepper(tolerance_, statistics_);
    statistics_.steps += odeint::integrate_adaptive(std::ref(stepper), std::ref(system), x, t, t_end, dt, observer);
  } else {
    statistics_.steps += odeint::integrate_adaptive(
        odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(tolerance_.absolute, tolerance_.relative),
        std::ref(system), x, t, t_end, dt, observer);
  }
  model_.constrain(x);
}

void NoSlipIntegration::set_burden(State& x, const Burden& burden, bool keep_momentum) {
  const double energy = kinetic_energy(x);
  const Eigen::Vector3d momentum = model_.inertia() * x.velocity();
  model_ = NoSlipModel(robot_, floor_, burden);
  if (keep_momentum) {
    x.values.col(1).head<3>() = model_.inertia().llt().solve(momentum).array();
    model_.constrain(x);
  }
  x.work() += kinetic_energy(x) - energy;
}

ContactDetails NoSlipIntegration::contacts(const State& x, double) const {
  const Wheels none = Wheels::Zero();
  ContactDetails details{{none, none, none, none, none, none, none, none}};
  details.N = normal_reactions(model_.robot(), floor_);
  details.external.head<3>() = model_.external_force(x.psi()).array();
  return details;
}

}  // namespace youbot_base_sim
