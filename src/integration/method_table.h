#pragma once

#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/odeint_steppers.h"
#include "youbot_base_sim/integration/radau.h"
#include "youbot_base_sim/integration/slip_integration.h"

// The table of methods, for any friction law. Compiling it takes long: each law has a file of its own.
namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

/// What an integration is made of; `step` is that of a method without step size control, s.
struct Parts {
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const Tolerance& tolerance;
  double step;
};
using Maker = std::unique_ptr<Integration> (*)(const Parts&);

// Radau must keep up with real time: this many evaluations, and the 80 % more of an eased millisecond, take about 0.8
// ms at 3 GHz; beyond the paper each takes longer. The other methods are for comparison and may take what they need;
// their bound only makes sure that a run ends.
template <class Model>
inline constexpr WorkBound kRealTime{Model::kReactionsFollow ? 2000 : 3000};
inline constexpr WorkBound kComparison{10000000};

template <class Model, class Stepper, class MakeStepper>
std::unique_ptr<Integration> integrate(const Parts& parts, const WorkBound& bound, const MakeStepper& make_stepper) {
  Model model(parts.robot, parts.floor);
  model.set_transition_speed(effective_transition_speed(model.transition_speed(), parts.tolerance));
  return std::make_unique<SlipIntegration<Model, Stepper>>(model, parts.torque, parts.start, parts.tolerance, bound,
                                                           make_stepper);
}

template <class Model>
std::unique_ptr<Integration> radau(const Parts& parts) {
  return integrate<Model, Radau<Model>>(parts, kRealTime<Model>,
                                        [](const Tolerance& tolerance, IntegrationStatistics& statistics) {
                                          return Radau<Model>(tolerance, statistics);
                                        });
}

template <class Model, class Coefficients>
std::unique_ptr<Integration> rosenbrock4(const Parts& parts) {
  return integrate<Model, Rosenbrock4<Coefficients>>(parts, kComparison,
                                                     [](const Tolerance& tolerance, IntegrationStatistics& statistics) {
                                                       return Rosenbrock4<Coefficients>(tolerance, statistics);
                                                     });
}

template <class Model, class ErrorStepper>
std::unique_ptr<Integration> runge_kutta(const Parts& parts) {
  return integrate<Model, ControlledRungeKutta<ErrorStepper>>(
      parts, kComparison,
      [](const Tolerance& tolerance, IntegrationStatistics&) { return ControlledRungeKutta<ErrorStepper>(tolerance); });
}

template <class Model>
std::unique_ptr<Integration> bulirsch_stoer(const Parts& parts) {
  return integrate<Model, BulirschStoer>(
      parts, kComparison, [](const Tolerance& tolerance, IntegrationStatistics&) { return BulirschStoer(tolerance); });
}

template <class Model, class Step>
std::unique_ptr<Integration> fixed_step(const Parts& parts) {
  return integrate<Model, FixedStep<Step>>(
      parts, kComparison,
      [&](const Tolerance&, IntegrationStatistics& statistics) { return FixedStep<Step>(parts.step, statistics); });
}

using Dopri5 = odeint::runge_kutta_dopri5<State>;
using CashKarp54 = odeint::runge_kutta_cash_karp54<State>;
using Fehlberg78 = odeint::runge_kutta_fehlberg78<State>;
using RungeKutta4Step = ExplicitStep<odeint::runge_kutta4<State>>;

/// A method, and what makes it for one friction law.
struct Entry {
  Method method;
  Maker make;
};

/// All methods, the default one first.
template <class Model>
const std::vector<Entry>& entries() {
  static const std::vector<Entry> kEntries = {
      {{"radau", "Radau IIA of order 5, implicit, made for this problem: the one to use", false, 0}, radau<Model>},
      {{"rosenbrock4", "odeint's, linearly implicit, of order 4, with d4 corrected: an independent check", false, 0},
       rosenbrock4<Model, CorrectedRosenbrock4>},
      {{"rosenbrock4_as_shipped", "the same with the wrong sign of d4 that Boost 1.74 has: to see what it costs", false,
        0},
       rosenbrock4<Model, ShippedRosenbrock4>},
      {{"implicit_euler", "odeint's, linearly implicit, of order 1, fixed step", false, 1e-5},
       fixed_step<Model, ImplicitEulerStep>},
      {{"dopri5", "odeint's Dormand-Prince, explicit, of order 5: where all wheels slip fast", true, 0},
       runge_kutta<Model, Dopri5>},
      {{"cash_karp54", "odeint's, explicit, of order 5", true, 0}, runge_kutta<Model, CashKarp54>},
      {{"fehlberg78", "odeint's, explicit, of order 8: where all wheels slip fast, at tight tolerances", true, 0},
       runge_kutta<Model, Fehlberg78>},
      {{"bulirsch_stoer", "odeint's, explicit, of variable order", true, 0}, bulirsch_stoer<Model>},
      {{"runge_kutta4", "odeint's, explicit, of order 4, fixed step", true, 2e-7}, fixed_step<Model, RungeKutta4Step>},
  };
  return kEntries;
}

extern template const std::vector<Entry>& entries<PaperModel<ViscousLaw>>();
extern template const std::vector<Entry>& entries<PaperModel<CoulombLaw>>();
extern template const std::vector<Entry>& entries<ExtendedModel<ViscousLaw>>();
extern template const std::vector<Entry>& entries<ExtendedModel<CoulombLaw>>();

}  // namespace youbot_base_sim
