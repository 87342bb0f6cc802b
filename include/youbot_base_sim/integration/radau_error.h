#pragma once

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/radau_newton.h"
#include "youbot_base_sim/integration/radau_stages.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Estimate of a step's error, of order 3 (Hairer and Wanner II, (8.19)): with the weights e_j and the real eigenvalue
/// gamma of A^-1,
///
///   (gamma / dt M + G - C) err = Q(u_0) + M sum_j e_j z_j / dt,   z_j = u_j - u_0,
///
/// where G and C are those of the step's end. Its norm is the root mean square over the eleven velocities in units of
/// `scale`. Amendments:
///   - where friction reverses at the end, G is the weakest one within the step (`limit_transient_damping`);
///   - after switches and rejected steps, err is filtered twice, which is (8.20) for linear forces: (gamma / dt M + G -
///     C) err' = gamma / dt M err. That forgets transients that decay within the step, so it must have seen their
///     energy;
///   - the pose has an estimate of its own (`error_of_pose`).
template <class Model>
class RadauError {
 public:
  RadauError(const RadauOptions& options, const Tolerance& tolerance) : options_(options), tolerance_(tolerance) {}

  /// Steps that follow have the same start. After a switch, estimates that are too large are filtered twice.
  void begin(bool after_switch) { filters_twice_ = after_switch; }
  /// The step's error was too large: the next estimate from its start is filtered twice if it is too large.
  void reject() { filters_twice_ = true; }

  /// The errors that count as 1 for steps that start with the velocities u. A roller counts a third of what it does for
  /// other methods, since this one damps its errors too. The rim of a wheel that hardly moves may be off by a tenth of
  /// what the platform may be, unless it has dry friction.
  Velocities scale(const Model& model, const Velocities& u) const {
    Velocities scale = error_scale(tolerance_, u);
    if (!model.dry_bearings().any()) {
      const Wheels relative = scale.v - tolerance_.absolute;
      scale.dphi = scale.dphi.max(tolerance_.absolute + options_.rim_scale / model.robot().R * relative);
    }
    scale.dgamma *= options_.roller_scale;
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
    const ContactStiffnesses stiffness = {matrix.damping(0).contact_stiffness(), matrix.damping(1).contact_stiffness(),
                                          matrix.damping(2).contact_stiffness()};
    std::array<DampingMatrix, 1> damping = {matrix.damping(2)};
    if (options_.weakest_damping) limit_transient_damping(stiffness, matrix, damping[0]);
    filter_.factorize({{T::gamma / dt}}, inertia, damping, {{matrix.coriolis(2)}});
    std::array<Velocities, 1> error;
    filter_.solve({start.forces + inertia * change}, error);
    if (inertia.J_2 == 0) error[0].dgamma.setZero();  // follows from the other velocities
    double norm = error_norm(error[0], start.error_scale);
    if (norm > 1 && filters_twice_ && options_.second_filter && resolves_transient_energy(inertia, start, u)) {
      norm = norm_filtered_again(inertia, start, dt, error);
    }
    if (!options_.pose_estimate) return norm;
    return std::max(norm, error_of_pose(start, u) *
                              (options_.pose_in_full && reverses_at_inner_stage(stiffness) ? options_.pose_share : 1));
  }

 private:
  using ContactStiffnesses = std::array<Wheels, RadauTableau::stages>;

  // Of components that decay within the step, the filtered error counts although they have no effect on its end.
  [[gnu::noinline]] double norm_filtered_again(const Inertia& inertia, const RadauStart<Model>& start, double dt,
                                               std::array<Velocities, 1>& error) const {
    filter_.solve({(RadauTableau::gamma / dt) * (inertia * error[0])}, error);
    if (inertia.J_2 == 0) error[0].dgamma.setZero();
    return error_norm(error[0], start.error_scale);
  }

  // Whether stages have seen all but a negligible share of the energy. The balance of energy misses that of the jump
  // from the start to the polynomial through the stages: of a transient that is over before the first one.
  bool resolves_transient_energy(const Inertia& inertia, const RadauStart<Model>& start,
                                 const StageVelocities& u) const {
    const Velocities jump = start.u - weighted(lagrange_weights(0, 3), start.u, u);
    return dot(jump, inertia * jump) <= options_.unseen_energy * tolerance_.relative * dot(start.u, inertia * start.u);
  }

  // The same of the platform's pose. Where contacts hold the velocities, these are right at the step's end, however
  // long the step, and their integral alone shows what it misses.
  double error_of_pose(const RadauStart<Model>& start, const StageVelocities& u) const {
    using T = RadauTableau;
    const Wheels mean_error = (1 / T::gamma) * (start.u.v + T::error_of_integral(0) * u[0].v +
                                                T::error_of_integral(1) * u[1].v + T::error_of_integral(2) * u[2].v);
    return std::sqrt(sum(mean_error.square())) / (options_.pose_share * start.error_scale.v[0]);
  }

  // Friction that reverses within a step is stiff for an instant only. Where the step happens to end in it, the damping
  // there would hide the error of the whole step: the wheel's weakest damping is taken instead.
  void limit_transient_damping(const ContactStiffnesses& stiffness, const RadauMatrix<Model>& matrix,
                               DampingMatrix& at_end) const {
    if ((stiffness[2] <= options_.transient_stiffness_ratio * stiffness[0].min(stiffness[1])).all()) return;
    for (int i = 0; i < kWheels; ++i) {
      const int weakest = stiffness[0][i] < stiffness[1][i] ? 0 : 1;
      if (stiffness[2][i] > options_.transient_stiffness_ratio * stiffness[weakest][i]) {
        at_end.set_wheel(i, matrix.damping(weakest));
      }
    }
  }

  // Whether a wheel's friction reverses at one of the inner stages alone. Depending on where in the reversal that stage
  // lies, the error's estimate changes its sign, and a step may be as long as makes it vanish: the pose's must be small
  // as well.
  bool reverses_at_inner_stage(const ContactStiffnesses& stiffness) const {
    const auto &a = stiffness[0], &b = stiffness[1], &c = stiffness[2];
    return (a.max(b) - options_.transient_stiffness_ratio * a.min(b).max(c)).maxCoeff() > 0;
  }

  const RadauOptions& options_;
  Tolerance tolerance_;
  bool filters_twice_ = false;
  BorderedStages<1> filter_;
};

}  // namespace youbot_base_sim
