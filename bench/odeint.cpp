#include "odeint.h"

#include "odeint_contestants.h"

namespace youbot_base_sim {
namespace bench {

namespace {

// An edge is located to a hundredth of the tolerance in phi; with a fixed step to 1e-10 rad.
template <template <class> class Stepper>
Run run_odeint(const Task& task, double first_step, double location_tolerance) {
  return with_problem(task.scene, [&](auto& problem) {
    using Problem = std::decay_t<decltype(problem)>;
    Stepper<Problem> stepper(task.setting);
    Run run;
    run.rows = LocatedRun<Problem, Stepper<Problem>>(problem, stepper, first_step, location_tolerance,
                                                     task.limits)(task.times);
    run.counts = problem.counts;
    return run;
  });
}

template <template <class> class Stepper>
Run run_controlled(const Task& task) {
  return run_odeint<Stepper>(task, 1e-6, 0.01 * task.setting);
}

template <template <class> class Stepper>
Run run_fixed_step(const Task& task) {
  return run_odeint<Stepper>(task, task.setting, 1e-10);
}

template <class Problem>
using RosenbrockAsShipped = OdeintRosenbrock<Problem, odeint::default_rosenbrock_coefficients<double>>;
template <class Problem>
using RosenbrockCorrected = OdeintRosenbrock<Problem, CorrectedRodas>;

}  // namespace

Run run_rosenbrock4(const Task& task) { return run_controlled<RosenbrockCorrected>(task); }
Run run_rosenbrock4_as_shipped(const Task& task) { return run_controlled<RosenbrockAsShipped>(task); }
Run run_implicit_euler(const Task& task) { return run_fixed_step<OdeintImplicitEuler>(task); }
Run run_dopri5(const Task& task) { return run_controlled<OdeintDopri5>(task); }
Run run_runge_kutta4(const Task& task) { return run_fixed_step<OdeintRungeKutta4>(task); }

}  // namespace bench
}  // namespace youbot_base_sim
