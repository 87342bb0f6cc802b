// Runs one solver on one scene, repeats quick runs, and prints rows, counts and run time as JSON; without an argument
// what it was built with. Its argument is JSON too: scene (a file), model, solver, tolerance, span (s), rate (rows a
// second), and if they differ from the usual max_evaluations. scripts/study work_precision drives it.

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <fmt/format.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_config.h>
#include <sundials/sundials_context.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <boost/version.hpp>
#include <cmath>
#include <ctime>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <sundials/sundials_linearsolver.hpp>
#include <sundials/sundials_matrix.hpp>
#include <sundials/sundials_nvector.hpp>

#include "youbot_base_sim/integration/difference_jacobian.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/simulation.h"

namespace {

using namespace youbot_base_sim;
using namespace sundials::experimental;

/// What a solver is asked for: method and tolerance are the scene's.
struct Task {
  Scene scene;
  std::vector<double> times;       ///< of the rows, s, increasing from 0
  double max_evaluations = 1.2e7;  ///< of the right-hand side, after which to give up
  std::uint64_t max_switches = 50000;

  bool is_spent(const IntegrationStatistics& statistics) const {
    return static_cast<double>(statistics.evaluations) > max_evaluations || statistics.switches > max_switches;
  }
};

struct Run {
  std::vector<State> rows;  ///< at the times asked for
  IntegrationStatistics statistics;
  std::uint64_t jacobians = 0;  ///< evaluated; 0: not counted
};

/// Ends a run that cannot go on, as Simulation's std::domain_error does; says why.
struct RunFailure : std::domain_error {
  using std::domain_error::domain_error;
};

/// The functions that CVODE and ARKODE of SUNDIALS 6 have in common. Both use the Jacobian by central differences, the
/// dense linear solver and their own root finding. Other settings are the most accurate in the time, by trial.
struct Package {
  using Counter = int (*)(void*, long*);
  void* (*create)(SUNContext, CVRhsFn, N_Vector);
  void (*destroy)(void**);
  int (*set_user_data)(void*, void*);
  int (*set_tolerances)(void*, realtype, N_Vector);
  int (*set_linear_solver)(void*, SUNLinearSolver, SUNMatrix);
  int (*set_jacobian)(void*, CVLsJacFn);
  int (*set_convergence)(void*, realtype);
  int (*set_max_steps)(void*, long);
  int (*set_roots)(void*, int, CVRootFn);
  int (*set_root_directions)(void*, int*);
  int (*set_stop_time)(void*, realtype);
  int (*advance)(void*, realtype, N_Vector, realtype*, int);
  int (*roots)(void*, int*);
  int (*restart)(void*, realtype, N_Vector);
  Counter steps, inaccurate_steps, unsolved_steps, factorizations;
};

void* create_cvode(SUNContext context, CVRhsFn derivative, N_Vector y) {
  void* memory = CVodeCreate(CV_BDF, context);
  CVodeInit(memory, derivative, 0, y);
  return memory;
}

template <ARKODE_DIRKTableID table>
void* create_arkode(SUNContext context, CVRhsFn derivative, N_Vector y) {
  void* memory = ARKStepCreate(nullptr, derivative, 0, y, context);
  ARKStepSetTableNum(memory, table, ARKODE_ERK_NONE);
  ARKStepSetInterpolantType(memory, ARK_INTERP_LAGRANGE);  // the other, Hermite, is not for stiff problems
  // Otherwise what Newton's iteration leaves, times the rollers' 1e7/s, counts as an error: far more steps.
  ARKStepSetDeduceImplicitRhs(memory, SUNTRUE);
  ARKStepSetPredictorMethod(memory, 1);
  ARKStepSetMaxNonlinIters(memory, 6);
  ARKStepSetLSetupFrequency(memory, 1);  // a Jacobian for each step saves more iterations than it costs
  return memory;
}

int set_arkode_linear_solver(void* memory, SUNLinearSolver solver, SUNMatrix A) {
  ARKStepSetLinearSolver(memory, solver, A);
  return ARKStepSetJacEvalFrequency(memory, 1);
}

int restart_arkode(void* memory, realtype t, N_Vector y) {
  ARKStepReset(memory, t, y);
  return ARKStepSetInitStep(memory, 0);  // found anew
}

// clang-format off
const Package kCvode = {
    create_cvode, CVodeFree, CVodeSetUserData, CVodeSVtolerances, CVodeSetLinearSolver,
    CVodeSetJacFn, CVodeSetNonlinConvCoef, CVodeSetMaxNumSteps, CVodeRootInit, CVodeSetRootDirection,
    CVodeSetStopTime, CVode, CVodeGetRootInfo, CVodeReInit,
    CVodeGetNumSteps, CVodeGetNumErrTestFails, CVodeGetNumStepSolveFails, CVodeGetNumLinSolvSetups};

template <ARKODE_DIRKTableID table>
const Package kArkode = {
    create_arkode<table>, ARKStepFree, ARKStepSetUserData, ARKStepSVtolerances,
    set_arkode_linear_solver, ARKStepSetJacFn, ARKStepSetNonlinConvCoef, ARKStepSetMaxNumSteps, ARKStepRootInit,
    ARKStepSetRootDirection, ARKStepSetStopTime, ARKStepEvolve, ARKStepGetRootInfo, restart_arkode,
    ARKStepGetNumSteps, ARKStepGetNumErrTestFails, ARKStepGetNumStepSolveFails, ARKStepGetNumLinSolvSetups};
// clang-format on

static_assert(SUNDIALS_VERSION_MAJOR == 6, "other versions have other functions");
static_assert(CV_ROOT_RETURN == ARK_ROOT_RETURN && CV_NORMAL == ARK_NORMAL, "Integrator takes the one for the other");

/// A SlipSystem as SUNDIALS integrates it: a vector without the work and roller angles of a State, on which nothing
/// depends. It counts phi from the middle of the roller, so that a relative tolerance does not loosen as wheels turn.
template <class Model>
class Integrator {
 public:
  Integrator(const Task& task, const Package& package)
      : task_(task), package_(package), torque_(make_torque_profile(task.scene)) {
    if (!torque_) throw RunFailure("the scene's drive is not a torque");
    const Scene& scene = task.scene;
    const TorqueProfile& torque = scene.solver.control_period > 0 ? held_ : *torque_;
    Model model(scene.robot, scene.floor);
    if (std::isfinite(scene.load_schedule.next_change(0)))
      throw RunFailure("loads and wrenches that change are not known here");
    if constexpr (Model::kReactionsFollow) model.set_loads(scene.load_schedule.at(0));
    system_ = std::make_unique<SlipSystem<Model>>(model, torque, scene.initial);
    State start = scene.initial;
    start.phi() -= middle();
    for (int k = 0; k < kSize; ++k) {
      y()[k] = start.begin()[kIndices[k]];
      // Below it a component's error counts absolutely: m, rad, m/s, rad/s.
      const double smallest_size = k < kDphi ? 0.1 : k < kDgamma ? 1 : 10;
      N_VGetArrayPointer(absolute_)[k] = scene.solver.relative_tolerance * smallest_size;
    }
    memory_ = package_.create(context_, derivative, y_);
    package_.set_tolerances(memory_, scene.solver.relative_tolerance, absolute_);
    package_.set_user_data(memory_, this);
    package_.set_linear_solver(memory_, solver_, A_);
    package_.set_jacobian(memory_, jacobian);
    package_.set_roots(memory_, 2 * kWheels, edges);
    std::array<int, 2 * kWheels> outwards;
    outwards.fill(+1);
    package_.set_root_directions(memory_, outwards.data());
    // With the default, 0.1, both are ten times less accurate in the same time: rollers amplify small errors.
    package_.set_convergence(memory_, 0.01);
    package_.set_max_steps(memory_, 2000000);  // for each row
  }
  ~Integrator() { package_.destroy(&memory_); }

  /// Starts anew at each switch and segment of torque, as the manuals ask; rows come from the dense output.
  Run run() {
    double t = 0, segment_end = begin_segment(0);
    package_.set_stop_time(memory_, segment_end);
    while (run_.rows.size() < task_.times.size()) {
      const double row = task_.times[run_.rows.size()];
      if (row <= t) {
        run_.rows.push_back(state(y_));
        continue;
      }
      const int flag = package_.advance(memory_, std::min(row, segment_end), y_, &t, CV_NORMAL);
      if (task_.is_spent(run_.statistics)) throw RunFailure(fmt::format("too much work by t = {:f} s", t));
      if (flag < 0) throw RunFailure(fmt::format("gave up ({}) at t = {:f} s", flag, t));
      if (flag != CV_ROOT_RETURN && t < segment_end) continue;
      if (flag == CV_ROOT_RETURN) {
        hand_over();
      } else {
        segment_end = begin_segment(t);
      }
      // CVODE sets its counters back, ARKODE does not.
      count(+1);
      package_.restart(memory_, t, y_);
      count(-1);
      package_.set_stop_time(memory_, segment_end);
    }
    count(+1);
    return run_;
  }

 private:
  static constexpr std::array<int, 18> kIndices = {0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19};
  static constexpr int kSize = kIndices.size(), kPhi = 6, kDphi = 10, kDgamma = 14;

  static Integrator& of(void* self) { return *static_cast<Integrator*>(self); }
  static int derivative(realtype t, N_Vector y, N_Vector dydt, void* self) {
    Integrator& integrator = of(self);
    ++integrator.run_.statistics.evaluations;
    State dxdt;
    (*integrator.system_)(integrator.state(y), dxdt, t);
    for (int k = 0; k < kSize; ++k) NV_DATA_S(dydt)[k] = dxdt.begin()[kIndices[k]];
    return integrator.task_.is_spent(integrator.run_.statistics) ? -1 : 0;
  }
  static int jacobian(realtype t, N_Vector y, N_Vector, SUNMatrix J, void* self, N_Vector, N_Vector, N_Vector) {
    Integrator& integrator = of(self);
    ++integrator.run_.jacobians;
    const DifferenceJacobian all = difference_jacobian(*integrator.system_, integrator.state(y), t);
    Eigen::Map<Eigen::Matrix<double, kSize, kSize>>(SM_DATA_D(J)) = all.by_state(kIndices, kIndices);
    return 0;
  }
  // Below zero on the roller, for its upper edges, then its lower ones.
  static int edges(realtype, N_Vector y, realtype* progress, void* self) {
    const double edge = of(self).half_pitch();
    for (int i = 0; i < kWheels; ++i) {
      progress[i] = NV_DATA_S(y)[kPhi + i] - edge;
      progress[kWheels + i] = -NV_DATA_S(y)[kPhi + i] - edge;
    }
    return 0;
  }

  /// Begins the segment of the torque that holds at time t, s; returns where it ends, or the run does, s.
  double begin_segment(double t) {
    const double period = task_.scene.solver.control_period, end = task_.times.back();
    if (!(period > 0)) return std::min(end, torque_->begin_segment(t));
    // k * period rather than a sum, as Simulation does; a drive sampled at t must not miss a segment by rounding.
    const auto k = static_cast<std::int64_t>(t / period + 1e-6);
    torque_->begin_segment(t + 1e-6 * period);
    held_.set(torque_->value(t));
    return std::min(end, static_cast<double>(k + 1) * period);
  }

  void hand_over() {
    std::array<int, 2 * kWheels> found;
    package_.roots(memory_, found.data());
    for (int k = 0; k < 2 * kWheels; ++k) {
      if (found[k] <= 0) continue;
      const int i = k % kWheels, direction = k < kWheels ? +1 : -1;
      ++run_.statistics.switches;
      State x = state(y_);
      system_->modes().switch_roller(i, system_->modes().roller(i) + direction, x);
      // The other wheels stay as they are to the bit, for a rounding error may carry them past an edge unseen.
      y()[kPhi + i] = -direction * half_pitch();
      y()[kDgamma + i] = x.dgamma()[i];
    }
  }

  void count(int sign) {
    const auto add = [&](Package::Counter counter, std::uint64_t& sum) {
      long n = 0;
      counter(memory_, &n);
      sum += static_cast<std::uint64_t>(sign * n);
    };
    add(package_.steps, run_.statistics.steps);
    add(package_.inaccurate_steps, run_.statistics.rejected_steps);
    add(package_.unsolved_steps, run_.statistics.rejected_steps);
    add(package_.factorizations, run_.statistics.factorizations);
  }

  double half_pitch() const { return 0.5 * system_->model().geometry().pitch(); }  // |phi| at the edges of a roller
  Wheels middle() const { return 0.5 * (system_->modes().lower_edge() + system_->modes().upper_edge()); }

  double* y() { return N_VGetArrayPointer(y_); }
  State state(N_Vector y) const {
    State x;
    for (int k = 0; k < kSize; ++k) x.begin()[kIndices[k]] = NV_DATA_S(y)[k];
    x.phi() += middle();
    return x;
  }

  const Task& task_;
  const Package& package_;
  std::unique_ptr<TorqueProfile> torque_;
  HeldTorque held_;
  std::unique_ptr<SlipSystem<Model>> system_;
  Run run_;
  sundials::Context context_;
  NVectorView y_ = N_VNew_Serial(kSize, context_), absolute_ = N_VNew_Serial(kSize, context_);
  SUNMatrixView A_ = SUNDenseMatrix(kSize, kSize, context_);
  SUNLinearSolverView solver_ = SUNLinSol_Dense(y_, A_, context_);
  void* memory_ = nullptr;
};

Run run_sundials(const Task& task, const Package& package) {
  const bool coulomb = task.scene.model == Model::kCoulomb, beyond = beyond_the_paper(task.scene);
  if (coulomb && beyond) return Integrator<ExtendedModel<CoulombLaw>>(task, package).run();
  if (coulomb) return Integrator<PaperModel<CoulombLaw>>(task, package).run();
  if (task.scene.model == Model::kViscous && !beyond) return Integrator<PaperModel<ViscousLaw>>(task, package).run();
  throw RunFailure("only models 2a and 2b are known here, and beyond the paper only 2b");
}

/// Any method of Simulation.
Run run_simulation(const Task& task) {
  Simulation simulation(task.scene);
  Run run;
  for (const double t : task.times) {
    simulation.advance_to(t);
    if (!simulation.state().values.allFinite()) throw RunFailure(fmt::format("not finite at t = {} s", t));
    if (task.is_spent(simulation.statistics())) throw RunFailure(fmt::format("too much work by t = {} s", t));
    run.rows.push_back(simulation.state());
  }
  run.statistics = simulation.statistics();
  return run;
}

/// Of SUNDIALS cvode (backward differentiation formulas of orders 1 to 5), arkode_4 and arkode_5 (diagonally implicit
/// Runge-Kutta methods: the best of its order and the default); else the method of that name of Simulation.
Run solve(const Task& task) {
  const std::string& solver = task.scene.solver.method;
  if (solver == "cvode") return run_sundials(task, kCvode);
  if (solver == "arkode_4") return run_sundials(task, kArkode<ARKODE_ESDIRK436L2SA_6_3_4>);
  if (solver == "arkode_5") return run_sundials(task, kArkode<ARKODE_ARK548L2SA_DIRK_8_4_5>);
  return run_simulation(task);
}

/// What the solvers were built with and for; SUNDIALS itself comes from the system.
nlohmann::json about() {
  return {{"compiler", "g++ " __VERSION__},
          {"flags", YOUBOT_BASE_SIM_BENCH_FLAGS},
          {"libraries", fmt::format("Boost {}.{}, SUNDIALS {}", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000,
                                    SUNDIALS_VERSION)}};
}

/// Run time is the least of the repeats.
nlohmann::json measure(const Task& task) {
  constexpr double kLong = 1, kEnough = 1;  // s: of a run that is not repeated, and of all runs
  constexpr int kMinRepeats = 3, kMaxRepeats = 10;
  double least = std::numeric_limits<double>::infinity(), total = 0;
  std::clock_t start = 0;
  const auto taken = [&] { return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; };
  int repeats = 0;
  Run run;
  try {
    do {
      start = std::clock();
      run = solve(task);
      const double run_time = taken();
      total += run_time;
      least = std::min(least, run_time);
      ++repeats;
    } while (least < kLong && (repeats < kMinRepeats || (total < kEnough && repeats < kMaxRepeats)));
  } catch (const std::domain_error& failure) {
    return {{"failure", failure.what()}, {"run_time", taken()}};
  }
  nlohmann::json counts;
  for (const StatisticsField& field : kStatisticsFields) counts[field.name] = run.statistics.*field.value;
  counts["jacobians"] = run.jacobians;
  return {{"rows", run.rows}, {"run_time", least}, {"repeats", repeats}, {"counts", counts}};
}

Task read_task(const nlohmann::json& argument) {
  const SceneSettings settings{{"model", argument.at("model").get<std::string>()},
                               {"solver.relative_tolerance", argument.at("tolerance").get<double>()}};
  Task task;
  task.scene = load_scene(argument.at("scene"), settings);
  task.scene.solver.method = argument.at("solver");
  task.max_evaluations = argument.value("max_evaluations", task.max_evaluations);
  const double rate = argument.at("rate"), end = std::min(argument.at("span").get<double>(), task.scene.duration);
  for (int k = 0; k <= end * rate * (1 + 1e-12); ++k) task.times.push_back(k / rate);
  return task;
}

}  // namespace

int main(int argc, char** argv) try {
  std::cout << (argc == 1 ? about() : measure(read_task(nlohmann::json::parse(argv[1])))) << '\n';
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "solve: {}\n", error.what());
  return 2;
}
