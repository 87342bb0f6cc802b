#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "slip_problem.h"

// What CVODE and ARKODE leave to the user was chosen by trial, for the highest accuracy in the time.

namespace youbot_base_sim {
namespace bench {

namespace {

constexpr int kSize = SlipProblem::kSize;
constexpr long kMaxStepsPerRow = 2000000;

// Of the tolerance, when Newton's iteration ends. With the default, 0.1, both are ten times less accurate in the same
// time: an error that is small in velocities is large in the rollers' accelerations.
constexpr double kConvergence = 0.01;

void say_nothing(int, const char*, const char*, char*, void*) {}

/// What CVODE and ARKODE share: vectors, matrix, callbacks, and the way from switch to switch.
class Integrator {
 public:
  Integrator(SlipProblem& problem, const Task& task)
      : tolerance_(task.scene.solver.relative_tolerance), problem_(problem), task_(task) {
    if (SUNContext_Create(nullptr, &context_) != 0) throw RunFailure("no SUNContext");
    y_ = N_VNew_Serial(kSize, context_);
    absolute_ = N_VNew_Serial(kSize, context_);
    A_ = SUNDenseMatrix(kSize, kSize, context_);
    solver_ = SUNLinSol_Dense(y_, A_, context_);
    problem.put_initial(task.scene.initial, y());
    for (int k = 0; k < kSize; ++k) NV_DATA_S(absolute_)[k] = tolerance_ * smallest_size(k);
    std::fill(std::begin(upwards_), std::end(upwards_), +1);
  }
  virtual ~Integrator() {
    SUNLinSolFree(solver_);
    SUNMatDestroy(A_);
    N_VDestroy(absolute_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;

  /// Goes from switch to switch and from one segment of torque to the next, started anew at each as the manuals ask;
  /// rows come from the dense output.
  Run run() {
    Run run;
    const double end = task_.times.back();
    double t = 0, segment_end = std::min(end, problem_.begin_segment(0));
    stop_at(segment_end);
    while (run.rows.size() < task_.times.size()) {
      const double row = task_.times[run.rows.size()];
      if (row <= t) {
        run.rows.push_back(problem_.state(y()));
        continue;
      }
      if (t >= end) break;
      const int flag = advance(t, std::min(row, segment_end));
      if (task_.is_spent(problem_.statistics)) throw RunFailure("too much work by t = " + std::to_string(t) + " s");
      if (flag < 0) throw RunFailure("gave up (" + std::to_string(flag) + ") at t = " + std::to_string(t) + " s");
      const bool root = flag == CV_ROOT_RETURN;
      if (root) hand_over();
      if (!root && t < segment_end) continue;
      if (!root && row <= t) run.rows.push_back(problem_.state(y()));
      if (!root && t < end) segment_end = std::min(end, problem_.begin_segment(t));
      restart(t);
      stop_at(segment_end);
    }
    count();
    run.statistics = problem_.statistics;
    run.jacobians = problem_.jacobians;
    return run;
  }

 protected:
  virtual int advance(double& t, double t_row) = 0;
  virtual void stop_at(double t) = 0;
  virtual void roots(int* found) = 0;
  virtual void restart(double t) = 0;
  virtual void count() = 0;

  static constexpr int kRoots = 2 * kWheels;

  static int derivative(realtype t, N_Vector y, N_Vector dydt, void* self) {
    const Integrator& integrator = of(self);
    integrator.problem_.derivative(t, NV_DATA_S(y), NV_DATA_S(dydt));
    return integrator.task_.is_spent(integrator.problem_.statistics) ? -1 : 0;
  }
  static int jacobian(realtype t, N_Vector y, N_Vector, SUNMatrix J, void* self, N_Vector, N_Vector, N_Vector) {
    of(self).problem_.jacobian(t, NV_DATA_S(y), SM_DATA_D(J));
    return 0;
  }
  // Below zero on the roller, for its upper edges, then its lower ones.
  static int edges(realtype, N_Vector y, realtype* progress, void* self) {
    const double edge = of(self).problem_.half_pitch();
    for (int i = 0; i < kWheels; ++i) {
      progress[i] = NV_DATA_S(y)[SlipProblem::kPhi + i] - edge;
      progress[kWheels + i] = -NV_DATA_S(y)[SlipProblem::kPhi + i] - edge;
    }
    return 0;
  }

  double* y() { return NV_DATA_S(y_); }

  double tolerance_;
  SlipProblem& problem_;
  const Task& task_;
  SUNContext context_ = nullptr;
  N_Vector y_, absolute_;
  SUNMatrix A_;
  SUNLinearSolver solver_;
  int upwards_[kRoots];  // roots count where the edge is passed outwards

 private:
  // Below it, a component's error counts absolutely: m, rad, m/s, rad/s.
  static double smallest_size(int k) { return k < SlipProblem::kDphi ? 0.1 : k < SlipProblem::kDgamma ? 1 : 10; }

  static Integrator& of(void* self) { return *static_cast<Integrator*>(self); }

  void hand_over() {
    int found[kRoots];
    roots(found);
    for (int i = 0; i < kWheels; ++i) {
      if (found[i] > 0) problem_.hand_over(i, +1, y());
      if (found[kWheels + i] > 0) problem_.hand_over(i, -1, y());
    }
  }
};

class Cvode : public Integrator {
 public:
  Cvode(SlipProblem& problem, const Task& task) : Integrator(problem, task), memory_(CVodeCreate(CV_BDF, context_)) {
    CVodeSetErrHandlerFn(memory_, say_nothing, nullptr);
    CVodeInit(memory_, derivative, 0, y_);
    CVodeSVtolerances(memory_, tolerance_, absolute_);
    CVodeSetUserData(memory_, static_cast<Integrator*>(this));
    CVodeSetLinearSolver(memory_, solver_, A_);
    CVodeSetJacFn(memory_, jacobian);
    CVodeRootInit(memory_, kRoots, edges);
    CVodeSetRootDirection(memory_, upwards_);
    CVodeSetNoInactiveRootWarn(memory_);
    CVodeSetNonlinConvCoef(memory_, kConvergence);
    CVodeSetMaxNumSteps(memory_, kMaxStepsPerRow);
  }
  ~Cvode() override { CVodeFree(&memory_); }

 private:
  int advance(double& t, double t_row) override { return CVode(memory_, t_row, y_, &t, CV_NORMAL); }
  void stop_at(double t) override { CVodeSetStopTime(memory_, t); }
  void roots(int* found) override { CVodeGetRootInfo(memory_, found); }
  void restart(double t) override {
    count();                      // CVodeReInit sets the counters back
    CVodeReInit(memory_, t, y_);  // order 1 again; it finds its first step itself
  }
  void count() override {
    long steps = 0, error_failures = 0, convergence_failures = 0, setups = 0;
    CVodeGetNumSteps(memory_, &steps);
    CVodeGetNumErrTestFails(memory_, &error_failures);
    CVodeGetNumNonlinSolvConvFails(memory_, &convergence_failures);
    CVodeGetNumLinSolvSetups(memory_, &setups);
    problem_.statistics.steps += static_cast<std::uint64_t>(steps);
    problem_.statistics.rejected_steps += static_cast<std::uint64_t>(error_failures + convergence_failures);
    problem_.statistics.factorizations += static_cast<std::uint64_t>(setups);
  }

  void* memory_;
};

class Arkode : public Integrator {
 public:
  Arkode(SlipProblem& problem, const Task& task, ARKODE_DIRKTableID table)
      : Integrator(problem, task), memory_(ARKStepCreate(nullptr, derivative, 0, y_, context_)) {
    ARKStepSetErrHandlerFn(memory_, say_nothing, nullptr);
    ARKStepSetTableNum(memory_, table, ARKODE_ERK_NONE);
    ARKStepSetInterpolantType(memory_, ARK_INTERP_LAGRANGE);  // the other, Hermite, is not for stiff problems
    ARKStepSVtolerances(memory_, tolerance_, absolute_);
    ARKStepSetUserData(memory_, static_cast<Integrator*>(this));
    ARKStepSetLinearSolver(memory_, solver_, A_);
    ARKStepSetJacFn(memory_, jacobian);
    ARKStepRootInit(memory_, kRoots, edges);
    ARKStepSetRootDirection(memory_, upwards_);
    ARKStepSetNoInactiveRootWarn(memory_);
    // Otherwise what Newton's iteration leaves, times the rollers' 1e7/s, counts as an error: hundreds of times the
    // steps.
    ARKStepSetDeduceImplicitRhs(memory_, SUNTRUE);
    ARKStepSetPredictorMethod(memory_, 1);
    ARKStepSetNonlinConvCoef(memory_, kConvergence);
    ARKStepSetMaxNonlinIters(memory_, 6);
    ARKStepSetLSetupFrequency(memory_, 1);  // a Jacobian for each step saves more iterations than it costs
    ARKStepSetJacEvalFrequency(memory_, 1);
    ARKStepSetMaxNumSteps(memory_, kMaxStepsPerRow);
  }
  ~Arkode() override { ARKStepFree(&memory_); }

 private:
  int advance(double& t, double t_row) override { return ARKStepEvolve(memory_, t_row, y_, &t, ARK_NORMAL); }
  void stop_at(double t) override { ARKStepSetStopTime(memory_, t); }
  void roots(int* found) override { ARKStepGetRootInfo(memory_, found); }
  void restart(double t) override {
    ARKStepReset(memory_, t, y_);
    ARKStepSetInitStep(memory_, 0);  // found anew
  }
  void count() override {
    long attempts = 0, steps = 0, setups = 0;
    ARKStepGetNumStepAttempts(memory_, &attempts);
    ARKStepGetNumSteps(memory_, &steps);
    ARKStepGetNumLinSolvSetups(memory_, &setups);
    problem_.statistics.steps = static_cast<std::uint64_t>(steps);
    problem_.statistics.rejected_steps = static_cast<std::uint64_t>(attempts - steps);
    problem_.statistics.factorizations = static_cast<std::uint64_t>(setups);
  }

  void* memory_;
};

static_assert(CV_ROOT_RETURN == ARK_ROOT_RETURN, "run() takes the one for the other");

std::unique_ptr<SlipProblem> make_problem(const Scene& scene) {
  if (scene.model == Model::kCoulomb) return std::make_unique<SlipProblemOf<CoulombLaw>>(scene);
  if (scene.model == Model::kViscous) return std::make_unique<SlipProblemOf<ViscousLaw>>(scene);
  throw RunFailure("only models 2a and 2b are known here");
}

Run run_arkode(const Task& task, ARKODE_DIRKTableID table) {
  return Arkode(*make_problem(task.scene), task, table).run();
}

}  // namespace

std::map<std::string, Solver> sundials_solvers() {
  return {
      {"cvode", [](const Task& task) { return Cvode(*make_problem(task.scene), task).run(); }},
      {"arkode_4", [](const Task& task) { return run_arkode(task, ARKODE_ESDIRK436L2SA_6_3_4); }},
      {"arkode_5", [](const Task& task) { return run_arkode(task, ARKODE_ARK548L2SA_DIRK_8_4_5); }},
  };
}

std::string sundials_version() {
  char version[32] = "";
  SUNDIALSGetVersion(version, sizeof version);
  return version;
}

}  // namespace bench
}  // namespace youbot_base_sim
