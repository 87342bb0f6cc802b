#include "contestants.h"

#include <fmt/format.h>

#include <boost/version.hpp>

#include "odeint_contestants.h"
#include "youbot_base_sim/simulation.h"
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
#include <sundials/sundials_version.h>

#include "sundials_contestants.h"
#endif

namespace youbot_base_sim {
namespace bench {

namespace {

using Rows = std::vector<double>;

/// Runs `integrate(problem)`, which returns rows, on the scene's contact law.
template <class Law, class Integrate>
Run run_problem(const Scene& scene, Integrate&& integrate) {
  SlipProblem<Law> problem(scene);
  Run run;
  run.rows = integrate(problem);
  run.counts = problem.counts;
  return run;
}

template <class Integrate>
Run run_scene(const Scene& scene, Integrate&& integrate) {
  if (scene.model == Model::kViscous) return run_problem<ViscousLaw>(scene, integrate);
  if (scene.model == Model::kCoulomb) return run_problem<CoulombLaw>(scene, integrate);
  throw RunFailure("the benchmark runs models 2a and 2b only");
}

template <template <class> class Stepper>
Run run_odeint(const Scene& scene, const Rows& rows, double setting, double first_step, double location_tolerance,
               const Limits& limits) {
  return run_scene(scene, [&](auto& problem) {
    using Problem = std::decay_t<decltype(problem)>;
    Stepper<Problem> stepper(setting);
    return LocatedRun<Problem, Stepper<Problem>>(problem, stepper, first_step, location_tolerance, limits)(rows);
  });
}

template <class Problem>
using RosenbrockAsShipped = OdeintRosenbrock<Problem, odeint::default_rosenbrock_coefficients<double>>;
template <class Problem>
using RosenbrockCorrected = OdeintRosenbrock<Problem, CorrectedRodas>;

constexpr double kFirstStep = 1e-6;  // s, where a contestant cannot find its own

// An edge is located to a hundredth of the tolerance in phi; with a fixed step to 1e-10 rad.
constexpr double kLocation = 0.01;
constexpr double kLocationAtFixedStep = 1e-10;

template <template <class> class Stepper>
auto controlled_odeint() {
  return [](const Scene& scene, double tolerance, const Rows& rows) {
    return run_odeint<Stepper>(scene, rows, tolerance, kFirstStep, kLocation * tolerance, Limits());
  };
}

template <template <class> class Stepper>
auto fixed_step_odeint() {
  return [](const Scene& scene, double step, const Rows& rows) {
    return run_odeint<Stepper>(scene, rows, step, step, kLocationAtFixedStep, Limits());
  };
}

Numbers numbers_of(const State& x) {
  Numbers y;
  for (int k = 0; k < 3; ++k) {
    y[static_cast<std::size_t>(kPose + k)] = x.values(k, 0);
    y[static_cast<std::size_t>(kVelocity + k)] = x.values(k, 1);
  }
  for (int i = 0; i < kWheels; ++i) {
    y[static_cast<std::size_t>(kPhi + i)] = x.phi()[i];
    y[static_cast<std::size_t>(kDphi + i)] = x.dphi()[i];
    y[static_cast<std::size_t>(kDgamma + i)] = x.dgamma()[i];
  }
  return y;
}

Run run_simulation(const Scene& scene, double tolerance, const Rows& rows) {
  Scene set = scene;
  set.solver.relative_tolerance = tolerance;
  set.solver.absolute_tolerance = 1e-3 * tolerance;
  Simulation simulation(set);
  Run run;
  for (const double t : rows) {
    simulation.advance_to(t);
    run.rows.push_back(numbers_of(simulation.state()));
  }
  const IntegrationStatistics& statistics = simulation.statistics();
  run.counts.steps = static_cast<std::int64_t>(statistics.steps + statistics.fallback_steps);
  run.counts.rejected = static_cast<std::int64_t>(statistics.rejected_steps);
  run.counts.location_steps = static_cast<std::int64_t>(statistics.location_steps);
  run.counts.switches = static_cast<std::int64_t>(statistics.switches);
  run.counts.evaluations = run.counts.jacobians = run.counts.factorizations = -1;
  return run;
}

void add_odeint(std::vector<Contestant>& list) {
  const std::vector<double> tolerances = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
  list.push_back(
      {"odeint_rosenbrock4_corrected", "odeint rosenbrock4, d4 corrected",
       "RODAS of order 4 with rosenbrock4_controller; rows by its dense output; `Coefficients` with the sign of "
       "d4 of Hairer and Wanner, section IV.7.",
       false, false, tolerances, controlled_odeint<RosenbrockCorrected>()});
  list.push_back(
      {"odeint_rosenbrock4", "odeint rosenbrock4 as shipped",
       "The same with odeint's default coefficients, where d4 = +0.0362 (in the book -0.0362): of lower order "
       "where the torque depends on time, the same otherwise.",
       false, false, tolerances, controlled_odeint<RosenbrockAsShipped>()});
  list.push_back(
      {"odeint_implicit_euler",
       "odeint implicit_euler",
       "Fixed step, one Newton step each, the linearly implicit scheme that its comments speak of (further ones "
       "factorise the factors of its Jacobian again, in Boost 1.74); steps end on rows.",
       true,
       false,
       {1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6},
       fixed_step_odeint<OdeintImplicitEuler>()});
  list.push_back({"odeint_dopri5",
                  "odeint runge_kutta_dopri5",
                  "Explicit, of order 5, with odeint's step size control; steps end on rows.",
                  false,
                  true,
                  {1e-3, 1e-6},
                  controlled_odeint<OdeintDopri5>()});
  list.push_back(
      {"odeint_runge_kutta4",
       "odeint runge_kutta4",
       "Explicit, of order 4, with fixed steps from where they are no longer stable down; steps end on rows.",
       true,
       true,
       {1.6e-6, 1.2e-6, 8e-7, 4e-7, 2e-7},
       fixed_step_odeint<OdeintRungeKutta4>()});
}

#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
Run run_cvode(const Scene& scene, double tolerance, const Rows& rows, const Limits& limits) {
  return run_scene(
      scene, [&](auto& problem) { return Cvode<std::decay_t<decltype(problem)>>(problem, tolerance, limits)(rows); });
}

Run run_arkode(const Scene& scene, double tolerance, const Rows& rows, int order, const Limits& limits) {
  return run_scene(scene, [&](auto& problem) {
    return Arkode<std::decay_t<decltype(problem)>>(problem, tolerance, order, limits)(rows);
  });
}

void add_sundials(std::vector<Contestant>& list) {
  const std::vector<double> tolerances = {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
  list.push_back(
      {"cvode", "SUNDIALS CVODE (BDF)",
       "Orders 1 to 5, analytic Jacobian, dense LU, CVodeRootInit, CVodeReInit after each switch and jump of "
       "torque; rows by its dense output.",
       false, false, tolerances, [](const Scene& scene, double tolerance, const Rows& rows) {
         return run_cvode(scene, tolerance, rows, Limits());
       }});
  for (const int order : {4, 5}) {
    list.push_back({"arkode_" + std::to_string(order), "SUNDIALS ARKODE (DIRK " + std::to_string(order) + ")",
                    order == 4
                        ? "ESDIRK436L2SA; analytic Jacobian, dense LU, its root finding, ARKStepReset after each "
                          "switch and jump of torque; rows by its dense output."
                        : "ARK548L2SA, its default of that order; the same in all else.",
                    false, false, tolerances, [order](const Scene& scene, double tolerance, const Rows& rows) {
                      return run_arkode(scene, tolerance, rows, order, Limits());
                    }});
  }
}
#endif

}  // namespace

std::vector<Contestant> contestants() {
  std::vector<Contestant> list;
  list.push_back(
      {"youbot_base_sim",
       "youbot_base_sim",
       "This package, through Simulation; it also integrates the work and the rollers' angles; steps end on rows.",
       false,
       false,
       {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10},
       run_simulation});
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
  add_sundials(list);
#endif
  add_odeint(list);
  return list;
}

std::vector<Yardstick> yardsticks(Effort effort) {
  std::vector<Yardstick> list;
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
  const bool record = effort == Effort::kRecord;
  const Limits limits{200000000, 50000};
  list.push_back({record ? "CVODE, 3e-14" : "CVODE, 1e-11", [=](const Scene& scene, const Rows& rows) {
                    return run_cvode(scene, record ? 3e-14 : 1e-11, rows, limits);
                  }});
  if (effort == Effort::kComparison) return list;
  list.push_back({record ? "ARKODE order 5, 1e-10" : "ARKODE order 5, 1e-8", [=](const Scene& scene, const Rows& rows) {
                    return run_arkode(scene, record ? 1e-10 : 1e-8, rows, 5, limits);
                  }});
#else
  const double tolerance = effort == Effort::kRecord ? 1e-9 : 1e-8;
  list.push_back({fmt::format("odeint rosenbrock4, corrected, {:g}", tolerance),
                  [tolerance](const Scene& scene, const Rows& rows) {
                    return controlled_odeint<RosenbrockCorrected>()(scene, tolerance, rows);
                  }});
#endif
  return list;
}

std::string libraries() {
  std::string text =
      "Boost " + std::to_string(BOOST_VERSION / 100000) + "." + std::to_string(BOOST_VERSION / 100 % 1000);
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
  char version[32] = "";
  SUNDIALSGetVersion(version, sizeof version);
  text += std::string(", SUNDIALS ") + version + " as the system has it";
#else
  text += "; no SUNDIALS found, so without CVODE and ARKODE";
#endif
  return text;
}

}  // namespace bench
}  // namespace youbot_base_sim
