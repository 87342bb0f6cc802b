#pragma once

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/radau_newton.h"
#include "youbot_base_sim/integration/radau_options.h"
#include "youbot_base_sim/integration/radau_stages.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Estimate of a step's error, of order 3 (docs/method.md, "The error"), in units of `scale`. After switches and
/// rejected steps an estimate above 1 is filtered twice. The pose has an estimate of its own; the larger one counts.
template <class Model>
class RadauError {
 public:
  explicit RadauError(const Tolerance& tolerance) : tolerance_(tolerance) {}

  /// Steps that follow have the same start, where contacts switched or not.
  void begin(bool after_switch) { filters_twice_ = after_switch; }
  /// The step's error was too large: later estimates from its start are treated as those after a switch.
  void reject() { filters_twice_ = true; }

  /// The errors that count as 1 for steps that start with the velocities u. Those of a roller may be three times as
  /// large as `error_scale` has them, since this method damps them too.
  Velocities scale(const Velocities& u) const {
    Velocities scale = error_scale(tolerance_, u);
    scale.dgamma *= radau_options.roller_scale;
    return scale;
  }

  /// The error of the step whose stages have the velocities u, in units of what is allowed: 1 where it is just allowed.
  [[gnu::flatten, gnu::noinline]] double estimate(const SlipSystem<Model>& system, const RadauStart<Model>& start,
                                                  const StageVelocities& u, const RadauMatrix<Model>& matrix) {
    using T = RadauTableau;
    const double dt = matrix.dt();
    const Velocities change = (T::error[0] / dt) * (u[0] - start.u) + (T::error[1] / dt) * (u[1] - start.u) +
                              (T::error[2] / dt) * (u[2] - start.u);
    const Inertia& inertia = system.model().inertia();
    const auto unseen_jump = [&] { return start.u - weighted(lagrange_weights(0, 3), start.u, u); };
    // A contact of a prescribed wheel that slides through standstill may be stiff at one stage alone. Where its error
    // is filtered out there, or by chance adds up to nothing, the filters of the stages disagree.
    double norm = 0, least = kInfinity;
    for (int stage = system.model().wheels_prescribed() ? 0 : 2; stage < 3; ++stage) {
      filter_.factorize({{T::gamma / dt}}, inertia, {matrix.damping(stage)}, {{matrix.coriolis(stage)}});
      std::array<Velocities, 1> error;
      double size = filtered_norm(start, inertia, start.forces + inertia * change, error);
      if (size > 1 && filters_twice_ && is_negligible(inertia, unseen_jump(), start.u)) {
        size = filtered_norm(start, inertia, (T::gamma / dt) * (inertia * error[0]), error);
      }
      norm = std::max(size, norm);  // in this order, a size that is not a number stays
      least = std::min(size, least);
    }
    if (least < norm) norm = std::max((1 - least / norm) * error_norm(unseen_jump(), start.error_scale), norm);
    return std::max(norm, error_of_pose(start, u, dt));
  }

 private:
  // Filters these forces into an `error`, without components that decay within the step; returns its norm.
  double filtered_norm(const RadauStart<Model>& start, const Inertia& inertia, const Velocities& forces,
                       std::array<Velocities, 1>& error) const {
    filter_.solve({forces}, error);
    if (inertia.J_2 == 0) error[0].dgamma.setZero();  // follows from the other velocities
    return error_norm(error[0], start.error_scale);
  }

  // True if the jump from the velocities u_0 to the parabola through the stages, a transient that is over before the
  // first one, has a negligible share of the energy, whose balance misses it.
  bool is_negligible(const Inertia& inertia, const Velocities& jump, const Velocities& u_0) const {
    return dot(jump, inertia * jump) <= radau_options.unseen_energy * tolerance_.relative * dot(u_0, inertia * u_0);
  }

  // The estimate for the platform's pose, in units of what the allowed error of its velocities adds up to in 4 ms. If
  // contacts hold the velocities, these are right at the step's end, however long the step, and their integral alone
  // shows what it misses.
  double error_of_pose(const RadauStart<Model>& start, const StageVelocities& u, double dt) const {
    using T = RadauTableau;
    const Wheels error = (dt / T::gamma) * (start.u.v + T::error_of_integral(0) * u[0].v +
                                            T::error_of_integral(1) * u[1].v + T::error_of_integral(2) * u[2].v);
    return std::sqrt(sum(error.square())) / (radau_options.pose_time * start.error_scale.v[0]);
  }

  Tolerance tolerance_;
  bool filters_twice_ = false;
  BorderedStages<1> filter_;
};

/// Step size control by the errors of the last two steps (Gustafsson's predictive controller; Hairer and Wanner,
/// section IV.8), for an error estimate of order 3.
class StepSizeController {
 public:
  /// Next length after a step of length dt with the given norm of its error; the step stands if the norm is <= 1.
  double next(double dt, double norm) {
    if (!(norm <= std::numeric_limits<double>::max())) {  // NaN too
      rejected_ = true;
      return dt * radau_options.max_shrinkage;
    }
    double factor = radau_options.safety / fourth_root(std::max(norm, kMinError));
    if (norm > 1) {
      rejected_ = true;
      return dt * std::max(factor, radau_options.max_shrinkage);
    }
    if (last_dt_ > 0 && radau_options.trend) {
      const double trend = radau_options.safety * (dt / last_dt_) * fourth_root(last_norm_ / (norm * norm + kMinError));
      factor = std::min(factor, trend);
    }
    factor = std::min(std::max(factor, radau_options.max_shrinkage), rejected_ ? 1.0 : radau_options.max_growth);
    last_dt_ = dt;
    last_norm_ = std::max(norm, 0.01);
    rejected_ = false;
    return dt * factor;
  }

  /// Forgets the last step: the right-hand side jumps here.
  void restart() { last_dt_ = 0; }

 private:
  static double fourth_root(double a) { return std::sqrt(std::sqrt(a)); }
  static constexpr double kMinError = 1e-10;
  double last_dt_ = 0;
  double last_norm_ = 1;
  bool rejected_ = false;
};

}  // namespace youbot_base_sim
