#include "youbot_base_sim/integration/methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>

#include "youbot_base_sim/integration/no_slip_integration.h"
#include "youbot_base_sim/integration/odeint_steppers.h"
#include "youbot_base_sim/integration/radau.h"
#include "youbot_base_sim/integration/slip_integration.h"

namespace youbot_base_sim {

namespace {

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
// ms at 3 GHz. The other methods are for comparison and may take what they need; their bound only makes sure that a run
// ends.
constexpr WorkBound kRealTime{3000}, kComparison{10000000};

template <class Law, class Stepper, class MakeStepper>
std::unique_ptr<Integration> integrate(const Parts& parts, const WorkBound& bound, const MakeStepper& make_stepper) {
  SlipModel<Law> model(parts.robot, parts.floor);
  model.set_transition_speed(effective_transition_speed(model.transition_speed(), parts.tolerance));
  return std::make_unique<SlipIntegration<Law, Stepper>>(model, parts.torque, parts.start, parts.tolerance, bound,
                                                         make_stepper);
}

template <class Law>
std::unique_ptr<Integration> radau(const Parts& parts) {
  return integrate<Law, Radau<Law>>(
      parts, kRealTime,
      [](const Tolerance& tolerance, IntegrationStatistics& statistics) { return Radau<Law>(tolerance, statistics); });
}

template <class Law, class Coefficients>
std::unique_ptr<Integration> rosenbrock4(const Parts& parts) {
  return integrate<Law, Rosenbrock4<Coefficients>>(parts, kComparison,
                                                   [](const Tolerance& tolerance, IntegrationStatistics& statistics) {
                                                     return Rosenbrock4<Coefficients>(tolerance, statistics);
                                                   });
}

template <class Law, class ErrorStepper>
std::unique_ptr<Integration> runge_kutta(const Parts& parts) {
  return integrate<Law, ControlledRungeKutta<ErrorStepper>>(
      parts, kComparison,
      [](const Tolerance& tolerance, IntegrationStatistics&) { return ControlledRungeKutta<ErrorStepper>(tolerance); });
}

template <class Law>
std::unique_ptr<Integration> bulirsch_stoer(const Parts& parts) {
  return integrate<Law, BulirschStoer>(
      parts, kComparison, [](const Tolerance& tolerance, IntegrationStatistics&) { return BulirschStoer(tolerance); });
}

template <class Law, class Step>
std::unique_ptr<Integration> fixed_step(const Parts& parts) {
  return integrate<Law, FixedStep<Step>>(parts, kComparison, [&](const Tolerance&, IntegrationStatistics& statistics) {
    return FixedStep<Step>(parts.step, statistics);
  });
}

using Dopri5 = odeint::runge_kutta_dopri5<State>;
using CashKarp54 = odeint::runge_kutta_cash_karp54<State>;
using Fehlberg78 = odeint::runge_kutta_fehlberg78<State>;
using RungeKutta4Step = ExplicitStep<odeint::runge_kutta4<State>>;

/// A method, and what makes it for each friction law.
struct Entry {
  Method method;
  Maker viscous, coulomb;
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> kEntries = {
      {{"radau", "Radau IIA of order 5, implicit, made for this problem: the one to use", false, 0},
       radau<ViscousLaw>,
       radau<CoulombLaw>},
      {{"rosenbrock4", "odeint's, linearly implicit, of order 4, with d4 corrected: an independent check", false, 0},
       rosenbrock4<ViscousLaw, CorrectedRosenbrock4>,
       rosenbrock4<CoulombLaw, CorrectedRosenbrock4>},
      {{"rosenbrock4_as_shipped", "the same with the wrong sign of d4 that Boost 1.74 has: to see what it costs", false,
        0},
       rosenbrock4<ViscousLaw, ShippedRosenbrock4>,
       rosenbrock4<CoulombLaw, ShippedRosenbrock4>},
      {{"implicit_euler", "odeint's, linearly implicit, of order 1, fixed step", false, 1e-5},
       fixed_step<ViscousLaw, ImplicitEulerStep>,
       fixed_step<CoulombLaw, ImplicitEulerStep>},
      {{"dopri5", "odeint's Dormand-Prince, explicit, of order 5: where all wheels slip fast", true, 0},
       runge_kutta<ViscousLaw, Dopri5>,
       runge_kutta<CoulombLaw, Dopri5>},
      {{"cash_karp54", "odeint's, explicit, of order 5", true, 0},
       runge_kutta<ViscousLaw, CashKarp54>,
       runge_kutta<CoulombLaw, CashKarp54>},
      {{"fehlberg78", "odeint's, explicit, of order 8: where all wheels slip fast, at tight tolerances", true, 0},
       runge_kutta<ViscousLaw, Fehlberg78>,
       runge_kutta<CoulombLaw, Fehlberg78>},
      {{"bulirsch_stoer", "odeint's, explicit, of variable order", true, 0},
       bulirsch_stoer<ViscousLaw>,
       bulirsch_stoer<CoulombLaw>},
      {{"runge_kutta4", "odeint's, explicit, of order 4, fixed step", true, 2e-7},
       fixed_step<ViscousLaw, RungeKutta4Step>,
       fixed_step<CoulombLaw, RungeKutta4Step>},
  };
  return kEntries;
}

double step_of(const Method& method, const IntegrationSettings& settings) {
  return settings.step > 0 ? settings.step : method.default_step;
}

const Entry* find_entry(const std::string& name) {
  const auto found =
      std::find_if(entries().begin(), entries().end(), [&](const Entry& entry) { return entry.method.name == name; });
  return found == entries().end() ? nullptr : &*found;
}

}  // namespace

const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = [] {
    std::vector<Method> all;
    for (const Entry& entry : entries()) all.push_back(entry.method);
    return all;
  }();
  return kMethods;
}

const std::vector<std::string>& method_names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> all;
    for (const Method& method : methods()) all.push_back(method.name);
    return all;
  }();
  return kNames;
}

const Method* find_method(const std::string& name) {
  const Entry* entry = find_entry(name);
  return entry ? &entry->method : nullptr;
}

double effective_transition_speed(double nu, const Tolerance& tolerance) {
  constexpr double kShare = 0.3;  // of an error of the relative tolerance at 1 m/s
  constexpr double kMax = 1e-5;   // m/s: a larger one would show at any tolerance
  return std::max(nu, std::min(kMax, kShare * tolerance.relative));
}

std::string advice(const RobotParameters& robot, const FloorParameters& floor, Model model,
                   const IntegrationSettings& settings, double duration) {
  const Method& method = *find_method(settings.method);
  if (!method.is_explicit || model == Model::kNoSlip) return "";
  constexpr double kStability = 3, kTimePerStep = 0.6e-6;  // s, at 3 GHz
  const double nu = effective_transition_speed(floor.nu, settings.tolerance);
  const double damping =
      model == Model::kViscous ? floor.mu_0(robot) : floor.f * normal_reactions(robot, floor).maxCoeff() / nu;
  const ContactGeometry mean = RollerGeometry(robot).mean();
  const double rate = damping * (mean.r_X.square() + mean.r_Y.square()).maxCoeff() / robot.J_2;
  if (!(rate > 0)) return "";
  const double stable = kStability / rate;
  if (method.default_step > 0) {
    return fmt::format("{} has a fixed step of {:g} s; while wheels roll it must be below about {:.1g} s to be stable",
                       method.name, step_of(method, settings), stable);
  }
  return fmt::format(
      "{} is explicit: while wheels roll its steps are at most about {:.1g} s long, {:.1g} of them for {:g} s of "
      "motion, "
      "which take about {:.1g} s; radau is the method for this",
      method.name, stable, duration / stable, duration, duration / stable * kTimePerStep);
}

std::string refusal(const Method& method, const RobotParameters& robot, Model model) {
  if (model == Model::kNoSlip || method.name == "radau" || robot.J_2 > 0) return "";
  return "one that integrates rollers without inertia, which only radau does: robot.roller_inertia is 0";
}

std::unique_ptr<Integration> make_integration(Model model, const RobotParameters& robot, const FloorParameters& floor,
                                              const State& start, const TorqueProfile& torque,
                                              const IntegrationSettings& settings) {
  if (model == Model::kNoSlip) return std::make_unique<NoSlipIntegration>(robot, torque, settings.tolerance);
  const Entry& entry = *find_entry(settings.method);
  const Parts parts{
      robot, floor, start, torque, settings.tolerance, settings.step > 0 ? settings.step : entry.method.default_step};
  return (model == Model::kViscous ? entry.viscous : entry.coulomb)(parts);
}

}  // namespace youbot_base_sim
