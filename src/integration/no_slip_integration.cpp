#include "youbot_base_sim/integration/no_slip_integration.h"

#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>

#include "youbot_base_sim/integration/odeint_steppers.h"

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

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
  const auto system = [this](const State& state, State& derivative, double time) {
    ++statistics_.evaluations;
    model_.derivative(state, torque_.value(time), derivative);
  };
  const auto observer = [this](const State&, double) {
    if (stop_ && *stop_) throw Stopped();
  };
  statistics_.steps += odeint::integrate_adaptive(
      odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(tolerance_.absolute, tolerance_.relative), system, x,
      t, t_end, t_end - t, observer);
  model_.constrain(x);
}

Contacts NoSlipIntegration::contacts(const State&, double) const {
  const Wheels none = Wheels::Zero();
  return {none, none, none, none, none, none, none, none};
}

}  // namespace youbot_base_sim
