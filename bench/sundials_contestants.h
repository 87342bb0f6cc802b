#pragma once

#include <arkode/arkode_arkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include "slip_problem.h"

// CVODE and ARKODE of SUNDIALS 6, each with the analytic Jacobian, its dense linear solver and its own root finding.
// What they leave to the user was chosen by trial, for most accuracy in the time.

namespace youbot_base_sim {
namespace bench {

/// What CVODE and ARKODE share: vectors, matrix, callbacks.
template <class Problem>
class SundialsProblem {
 public:
  SundialsProblem(Problem& problem, double tolerance, const Limits& limits) : problem_(problem), limits_(limits) {
    if (SUNContext_Create(nullptr, &context_) != 0) throw RunFailure("no SUNContext");
    y_ = N_VNew_Serial(kSize, context_);
    absolute_ = N_VNew_Serial(kSize, context_);
    A_ = SUNDenseMatrix(kSize, kSize, context_);
    solver_ = SUNLinSol_Dense(y_, A_, context_);
    std::copy(problem.initial().begin(), problem.initial().end(), y());
    for (int k = 0; k < kSize; ++k) NV_DATA_S(absolute_)[k] = tolerance * smallest_size(k);
  }
  ~SundialsProblem() {
    SUNLinSolFree(solver_);
    SUNMatDestroy(A_);
    N_VDestroy(absolute_);
    N_VDestroy(y_);
    SUNContext_Free(&context_);
  }
  SundialsProblem(const SundialsProblem&) = delete;
  SundialsProblem& operator=(const SundialsProblem&) = delete;

  static constexpr int kRoots = 2 * kWheels;

  static int derivative(realtype t, N_Vector y, N_Vector dydt, void* self) {
    const SundialsProblem& shared = *static_cast<SundialsProblem*>(self);
    shared.problem_.derivative(t, NV_DATA_S(y), NV_DATA_S(dydt));
    return shared.limits_.spent(shared.problem_.counts) ? -1 : 0;
  }
  static int jacobian(realtype t, N_Vector y, N_Vector, SUNMatrix J, void* self, N_Vector, N_Vector, N_Vector) {
    double* data = SM_DATA_D(J);  // comes zeroed; columns one after the other
    of(self).jacobian(t, NV_DATA_S(y), [data](int row, int column) -> double& { return data[column * kSize + row]; });
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

  void hand_over(const int* found) {
    for (int i = 0; i < kWheels; ++i) {
      if (found[i] > 0) problem_.hand_over(i, +1, y());
      if (found[kWheels + i] > 0) problem_.hand_over(i, -1, y());
    }
  }

  double* y() { return NV_DATA_S(y_); }

  Problem& problem_;
  Limits limits_;
  SUNContext context_ = nullptr;
  N_Vector y_, absolute_;
  SUNMatrix A_;
  SUNLinearSolver solver_;

 private:
  // Below it, a component's error counts absolutely: m, rad, m/s, rad/s.
  static double smallest_size(int k) { return k < kDphi ? 0.1 : k < kDgamma ? 1 : 10; }

  static Problem& of(void* self) { return static_cast<SundialsProblem*>(self)->problem_; }
};

inline void require(int flag, const char* what, double t, const Counts& counts, const Limits& limits) {
  if (flag >= 0) return;
  limits.check(counts, t);
  throw RunFailure(std::string(what) + " gave up (" + std::to_string(flag) + ") at t = " + std::to_string(t) + " s");
}

constexpr long kMostStepsPerRow = 2000000;

// Of the tolerance, when Newton's iteration ends. With the default, 0.1, both are ten times less accurate in the same
// time: an error that is small in velocities is large in the rollers' accelerations.
constexpr double kConvergence = 0.01;

inline void say_nothing(int, const char*, const char*, char*, void*) {}

enum class Event { kRow, kStop, kRoot };

/// Takes a SUNDIALS integrator from switch to switch and from one segment of torque to the next, started anew at each
/// as its manual asks; rows come from its own dense output.

template <class Problem, class Integrator>
std::vector<Numbers> sundials_run(Problem& problem, SundialsProblem<Problem>& shared, Integrator& integrator,
                                  const std::vector<double>& rows) {
  std::vector<Numbers> out;
  const double end = rows.back();
  double t = 0;
  double segment_end = std::min(end, problem.begin_segment(0));
  integrator.stop_at(segment_end);
  while (out.size() < rows.size()) {
    const double row = rows[out.size()];
    if (row <= t) {
      out.push_back(problem.row(shared.y()));
      continue;
    }
    const Event event = integrator.advance(t, std::min(row, segment_end));
    shared.limits_.check(problem.counts, t);
    if (event == Event::kRoot) {
      int found[SundialsProblem<Problem>::kRoots];
      integrator.roots(found);
      shared.hand_over(found);
      integrator.restart(t);
      integrator.stop_at(segment_end);
    } else if (t >= segment_end) {
      if (row <= t) out.push_back(problem.row(shared.y()));
      if (t >= end) break;
      segment_end = std::min(end, problem.begin_segment(t));
      integrator.restart(t);
      integrator.stop_at(segment_end);
    }
  }
  return out;
}

/// CVODE, backward differentiation formulas of orders 1 to 5.
template <class Problem>
class Cvode {
 public:
  Cvode(Problem& problem, double tolerance, const Limits& limits)
      : problem_(problem), shared_(problem, tolerance, limits), memory_(CVodeCreate(CV_BDF, shared_.context_)) {
    using Shared = SundialsProblem<Problem>;
    CVodeSetErrHandlerFn(memory_, say_nothing, nullptr);
    CVodeInit(memory_, Shared::derivative, 0, shared_.y_);
    CVodeSVtolerances(memory_, tolerance, shared_.absolute_);
    CVodeSetUserData(memory_, &shared_);
    CVodeSetLinearSolver(memory_, shared_.solver_, shared_.A_);
    CVodeSetJacFn(memory_, Shared::jacobian);
    CVodeRootInit(memory_, Shared::kRoots, Shared::edges);
    int upwards[Shared::kRoots];
    std::fill(std::begin(upwards), std::end(upwards), +1);
    CVodeSetRootDirection(memory_, upwards);
    CVodeSetNoInactiveRootWarn(memory_);
    CVodeSetNonlinConvCoef(memory_, kConvergence);
    CVodeSetMaxNumSteps(memory_, kMostStepsPerRow);
  }
  ~Cvode() { CVodeFree(&memory_); }
  Cvode(const Cvode&) = delete;
  Cvode& operator=(const Cvode&) = delete;

  std::vector<Numbers> operator()(const std::vector<double>& rows) {
    auto out = sundials_run(problem_, shared_, *this, rows);
    count();
    return out;
  }

  void stop_at(double t) { CVodeSetStopTime(memory_, t); }

  Event advance(double& t, double t_row) {
    const int flag = CVode(memory_, t_row, shared_.y_, &t, CV_NORMAL);
    require(flag, "CVODE", t, problem_.counts, shared_.limits_);
    return flag == CV_ROOT_RETURN ? Event::kRoot : flag == CV_TSTOP_RETURN ? Event::kStop : Event::kRow;
  }

  void roots(int* found) { CVodeGetRootInfo(memory_, found); }

  void restart(double t) {
    count();
    CVodeReInit(memory_, t, shared_.y_);  // order 1 again; it finds its first step itself
  }

 private:
  // CVodeReInit sets the counters back.
  void count() {
    long steps = 0, error_failures = 0, convergence_failures = 0, setups = 0;
    CVodeGetNumSteps(memory_, &steps);
    CVodeGetNumErrTestFails(memory_, &error_failures);
    CVodeGetNumNonlinSolvConvFails(memory_, &convergence_failures);
    CVodeGetNumLinSolvSetups(memory_, &setups);
    problem_.counts.steps += steps;
    problem_.counts.rejected += error_failures + convergence_failures;
    problem_.counts.factorizations += setups;
  }

  Problem& problem_;
  SundialsProblem<Problem> shared_;
  void* memory_;
};

/// ARKODE's diagonally implicit Runge-Kutta methods: of order 4 the best of those it has, of order 5 its default.
template <class Problem>
class Arkode {
 public:
  Arkode(Problem& problem, double tolerance, int order, const Limits& limits)
      : problem_(problem),
        shared_(problem, tolerance, limits),
        memory_(ARKStepCreate(nullptr, SundialsProblem<Problem>::derivative, 0, shared_.y_, shared_.context_)) {
    using Shared = SundialsProblem<Problem>;
    ARKStepSetErrHandlerFn(memory_, say_nothing, nullptr);
    if (order == 4) ARKStepSetTableNum(memory_, ARKODE_ESDIRK436L2SA_6_3_4, ARKODE_ERK_NONE);
    if (order == 5) ARKStepSetTableNum(memory_, ARKODE_ARK548L2SA_DIRK_8_4_5, ARKODE_ERK_NONE);
    ARKStepSetInterpolantType(memory_, ARK_INTERP_LAGRANGE);  // the other, Hermite, is not for stiff problems
    ARKStepSVtolerances(memory_, tolerance, shared_.absolute_);
    ARKStepSetUserData(memory_, &shared_);
    ARKStepSetLinearSolver(memory_, shared_.solver_, shared_.A_);
    ARKStepSetJacFn(memory_, Shared::jacobian);
    ARKStepRootInit(memory_, Shared::kRoots, Shared::edges);
    int upwards[Shared::kRoots];
    std::fill(std::begin(upwards), std::end(upwards), +1);
    ARKStepSetRootDirection(memory_, upwards);
    ARKStepSetNoInactiveRootWarn(memory_);
    // Otherwise what Newton's iteration leaves, times the rollers' 1e7/s, counts as an error: hundreds of times the
    // steps.
    ARKStepSetDeduceImplicitRhs(memory_, SUNTRUE);
    ARKStepSetPredictorMethod(memory_, 1);
    ARKStepSetNonlinConvCoef(memory_, kConvergence);
    ARKStepSetMaxNonlinIters(memory_, 6);
    ARKStepSetLSetupFrequency(memory_, 1);  // a Jacobian for each step saves more iterations than it costs
    ARKStepSetJacEvalFrequency(memory_, 1);
    ARKStepSetMaxNumSteps(memory_, kMostStepsPerRow);
  }
  ~Arkode() { ARKStepFree(&memory_); }
  Arkode(const Arkode&) = delete;
  Arkode& operator=(const Arkode&) = delete;

  std::vector<Numbers> operator()(const std::vector<double>& rows) {
    auto out = sundials_run(problem_, shared_, *this, rows);
    long attempts = 0, steps = 0, setups = 0;
    ARKStepGetNumStepAttempts(memory_, &attempts);
    ARKStepGetNumSteps(memory_, &steps);
    ARKStepGetNumLinSolvSetups(memory_, &setups);
    problem_.counts.steps = steps;
    problem_.counts.rejected = attempts - steps;
    problem_.counts.factorizations = setups;
    return out;
  }

  void stop_at(double t) { ARKStepSetStopTime(memory_, t); }

  Event advance(double& t, double t_row) {
    const int flag = ARKStepEvolve(memory_, t_row, shared_.y_, &t, ARK_NORMAL);
    require(flag, "ARKODE", t, problem_.counts, shared_.limits_);
    return flag == ARK_ROOT_RETURN ? Event::kRoot : flag == ARK_TSTOP_RETURN ? Event::kStop : Event::kRow;
  }

  void roots(int* found) { ARKStepGetRootInfo(memory_, found); }

  void restart(double t) {
    ARKStepReset(memory_, t, shared_.y_);
    ARKStepSetInitStep(memory_, 0);  // found anew
  }

 private:
  Problem& problem_;
  SundialsProblem<Problem> shared_;
  void* memory_;
};

}  // namespace bench
}  // namespace youbot_base_sim
