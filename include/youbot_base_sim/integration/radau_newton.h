#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/radau_friction.h"
#include "youbot_base_sim/integration/radau_options.h"
#include "youbot_base_sim/integration/radau_stages.h"
#include "youbot_base_sim/integration/reacting_stages.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Newton's matrix for the stages of a step of length dt from the velocities u_0 (docs/method.md, (1) and (3)), with
/// D = A^-1 / dt.
template <class Model>
class RadauMatrix {
 public:
  using Evaluation = typename SlipSystem<Model>::StageEvaluation;

  /// Takes a step of length dt, s.
  void set_step(double dt) {
    dt_ = dt;
    const double per_dt = 1 / dt;
    for (int j = 0; j < 3; ++j) {
      for (int l = 0; l < 3; ++l) D_[j][l] = per_dt * RadauTableau::A_inverse[j][l];
    }
  }
  double dt() const { return dt_; }

  /// M sum_l D_jl z_l: forces that accelerate the base as stage j says, for z_l = u_l - u_0, N and N m.
  Velocities forces_by_motion(const Inertia& inertia, int j, const StageVelocities& z) const {
    return inertia * (D_[j][0] * z[0] + D_[j][1] * z[1] + D_[j][2] * z[2]);
  }

  [[gnu::flatten, gnu::noinline]] void factorize(const SlipSystem<Model>& system, const StageVelocities& u,
                                                 const std::array<Wheels, 3>& torque, const Evaluation& evaluated) {
    const auto& model = system.model();
    const auto& [contacts, stiffness] = evaluated;
    for (int j = 0; j < 3; ++j) {
      system.damping(u[j], contacts[j], stiffness[j], torque[j], damping_[j]);
      coriolis_[j] = model.inertia().coriolis_derivative(u[j].v);
    }
    solver_.factorize(D_, model.inertia(), damping_, coriolis_);
    if constexpr (Model::kReactionsFollow) {
      if (system.reacts()) {
        for (int j = 0; j < 3; ++j) system.couple(u[j], contacts[j], torque[j], damping_[j], couplings_[j]);
      }
    }
  }

  /// Sets du, and dN to the change of dynamic reactions, N.
  void solve(const SlipSystem<Model>& system, const StageVelocities& r, StageVelocities& du,
             std::array<Wheels, 3>& dN) const {
    solver_.solve(r, du);
    if constexpr (Model::kReactionsFollow) {
      if (system.reacts()) ReactingStages<3>::correct(solver_, couplings_, du, dN);
    }
  }

  const DampingMatrix& damping(int j) const { return damping_[j]; }
  const PlatformMatrix& coriolis(int j) const { return coriolis_[j]; }

 private:
  double dt_ = 0;
  double D_[3][3];  // 1/s
  std::array<DampingMatrix, 3> damping_;
  alignas(kAlignment) std::array<PlatformMatrix, 3> coriolis_;
  BorderedStages<3> solver_;
  std::array<ReactionCoupling, 3> couplings_;
};

/// Decides when Newton's corrections are small enough: by their rate theta, or the factor omega of quadratic
/// convergence (docs/method.md, "Convergence").
class RadauConvergence {
 public:
  /// At most a fraction of the regularization speed, however large the tolerance. Prescribed wheels do work against
  /// friction: its error must be within the tolerance of the energy balance.
  template <class Model>
  void set_tolerance(const SlipSystem<Model>& system, const Velocities& error_scale, double relative_tolerance) {
    Velocities regularization = regularization_velocities(system.model());
    if (system.model().wheels_prescribed()) {
      const double rounding =
          (system.reacts() ? kReactingRounding : kRounding) / (radau_options.convergence * regularization.v[0]);
      regularization = std::min(1.0, std::max(1e3 * relative_tolerance, rounding)) * regularization;
    }
    per_tolerance_ = {1 / (radau_options.convergence * error_scale.v.min(regularization.v)),
                      1 / (radau_options.convergence * error_scale.dphi.min(regularization.dphi)),
                      1 / (radau_options.convergence * error_scale.dgamma.min(regularization.dgamma))};
  }

  double size(const StageVelocities& correction) const {
    Wheels squares = Wheels::Zero();
    for (const Velocities& u : correction) {
      squares += (u.v * per_tolerance_.v).square() + (u.dphi * per_tolerance_.dphi).square() +
                 (u.dgamma * per_tolerance_.dgamma).square();
    }
    return std::sqrt(sum(squares) / 11);
  }

  /// Takes the rate after a correction of size `last` whose matrix was fresh. Iterations that overflow show nothing.
  void see_fresh(double rate, double last) {
    const double seen = rate / last;
    if (std::isfinite(seen)) curvature_ = std::max(seen, radau_options.curvature_memory * curvature_);
  }

  /// True if all corrections after one of this size, at this rate, sum up to less than the tolerance.
  static bool leaves_little(double size, double rate) { return rate < 1 && size * rate < 1 - rate; }
  /// True if the next correction, with a fresh matrix about the curvature times the square of this one, is small.
  bool leaves_little_afresh(double size) const { return radau_options.curvature_margin * curvature_ * size * size < 1; }

  /// Forgets how fast corrections shrank.
  void restart() { curvature_ = 1; }

 private:
  // The error of the slip that rounding lets iterations reach, m/s; with dynamic reactions
  static constexpr double kRounding = 3e-16, kReactingRounding = 1e-12;

  Velocities per_tolerance_;  // the inverse of the convergence tolerance
  double curvature_ = 1;
};

/// Newton's iterations for the stages of a step, primal and dual: the unknowns are the velocities u_j and the friction
/// F_j (docs/method.md, (2)).
template <class Model>
class RadauNewton {
 public:
  using System = SlipSystem<Model>;
  using Start = RadauStart<Model>;
  using Stages = RadauStages<Model>;
  using Evaluation = typename System::StageEvaluation;

  /// Counts iterations and factorizations in `statistics`, which must outlive it.
  RadauNewton(const Tolerance& tolerance, IntegrationStatistics& statistics)
      : relative_tolerance_(tolerance.relative), statistics_(&statistics) {}
  RadauNewton(const RadauNewton&) = delete;
  RadauNewton& operator=(const RadauNewton&) = delete;

  /// Steps that follow begin at `start`.
  void begin(const System& system, const Start& start) {
    convergence_.set_tolerance(system, start.error_scale, relative_tolerance_);
  }

  /// Forgets how fast corrections shrank.
  void restart() { convergence_.restart(); }

  /// Solves for the `stages` of a step of length dt from what they hold. Ends early, as if converged, where `give_up`
  /// says so, which is asked after two iterations. False: no convergence.
  template <class GiveUp>
  [[gnu::flatten, gnu::noinline]] bool iterate(const System& system, const Start& start, double dt, Stages& stages,
                                               const GiveUp& give_up) {
    using T = RadauTableau;
    matrix_.set_step(dt);
    torque_ = system.torque().values({start.t + T::c[0] * dt, start.t + T::c[1] * dt, start.t + T::c[2] * dt});
    StageVelocities left;
    double last = 0, rate = radau_options.first_rate;
    bool fresh = true;  // whether the matrix is that of where the last correction began
    for (int iteration = 0; iteration < radau_options.max_iterations; ++iteration) {
      ++statistics_->newton_iterations;
      residual(system, start, stages, left);
      if (iteration == 0) factorize(system, stages);
      double size = correction(system, left);
      if (iteration > 0) {
        rate = size / last;
        if (fresh) convergence_.see_fresh(rate, last);
        // With a matrix that is no longer fresh, corrections shrink about twice as slowly as the first one did.
        fresh = !radau_options.reuses_matrix || !RadauConvergence::leaves_little(size, fresh ? 2 * rate : rate) ||
                !is_derivative_ || !friction_agrees(system, stages, radau_options.friction_mismatch);
        if (fresh) {
          factorize(system, stages);
          size = correction(system, left);
        }
      }
      if (!(size <= std::numeric_limits<double>::max())) return false;
      last = size;
      move(system, stages);
      if (fresh && is_derivative_ && !system.reacts() && convergence_.leaves_little_afresh(size)) {
        for (int j = 0; j < 3; ++j) forces_[j] = forces_by_motion(system, j, start.u, stages.u);
        return true;
      }
      if (RadauConvergence::leaves_little(size, rate)) return true;
      if (iteration == 1 && give_up()) return true;
    }
    return false;
  }

  // Results of the last iterations.

  double dt() const { return matrix_.dt(); }                  ///< length of the step, s
  const StageVelocities& forces() const { return forces_; }   ///< at the stages, N and N m
  const Wheels& torque_at_end() const { return torque_[2]; }  ///< N m
  const RadauMatrix<Model>& matrix() const { return matrix_; }
  const std::array<typename Model::Contacts, 3>& contacts() const { return evaluated_.contacts; }
  /// Forces by the equation of stage j of a step that starts with the velocities u_0, N and N m.
  Velocities forces_by_motion(const System& system, int j, const Velocities& u_0, const StageVelocities& u) const {
    return matrix_.forces_by_motion(system.model().inertia(), j, {u[0] - u_0, u[1] - u_0, u[2] - u_0});
  }

 private:
  // True if the friction of the slips is the F of the last correction, but for this share of f N. Where not, a matrix
  // is no derivative, and a small correction of the slip may stand for a large one of the force: its size shows
  // nothing.
  bool friction_agrees(const System& system, const Stages& stages, double share) const {
    const auto gap = [&](int j) { return friction_gap(system.model(), stages.F[j], evaluated_.contacts[j], share); };
    return !(gap(0).max(gap(1)).max(gap(2)).maxCoeff() > 0);
  }

  // Moves the stages by the last correction.
  [[gnu::flatten, gnu::noinline]] void move(const System& system, Stages& stages) const {
    const auto& [contacts, stiffness] = evaluated_;
    for (int j = 0; j < 3; ++j) {
      const Velocities& du = correction_[j];
      stages.u[j] = stages.u[j] + du;
      if constexpr (Model::kReactionsFollow) {
        if (system.reacts()) {
          stages.F[j] = corrected_friction(system.model(), contacts[j], stiffness[j], du, dN_[j]);
          continue;
        }
      }
      stages.F[j] = corrected_friction(system.model(), contacts[j], stiffness[j], du);
    }
  }

  // Forces r that are left over at each stage.
  [[gnu::flatten, gnu::noinline]] void residual(const System& system, const Start& start, const Stages& stages,
                                                StageVelocities& r) {
    const auto& model = system.model();
    const StageVelocities &u = stages.u, z = {u[0] - start.u, u[1] - start.u, u[2] - start.u};
    const double dt = matrix_.dt();
    system.contacts(u, {start.phi_at(0, dt, u), start.phi_at(1, dt, u), start.phi_at(2, dt, u)},
                    poses(system, start, u), torque_, stages.F, evaluated_);
    if (!radau_options.primal_dual) {
      for (int j = 0; j < 3; ++j) {
        evaluated_.stiffness[j] = model.stiffness(evaluated_.contacts[j], model.friction(evaluated_.contacts[j]));
      }
    }
    model.forces(u, evaluated_.contacts, torque_, forces_);
    for (int j = 0; j < 3; ++j) r[j] = forces_[j] - matrix_.forces_by_motion(model.inertia(), j, z);
  }

  // Poses at the stages, where they matter. An iterate may rotate further than the range of small_sine_and_cosine:
  // either it does not converge, or Radau rejects it.
  std::array<Pose, 3> poses(const System& system, const Start& start, const StageVelocities& u) const {
    std::array<Pose, 3> pose;
    if (!system.model().features().by_pose()) return pose;
    using T = RadauTableau;
    const double dt = matrix_.dt();
    const auto integral = [&](int j, double a, double b, double c) {
      return dt * (T::A[j][0] * a + T::A[j][1] * b + T::A[j][2] * c);
    };
    const auto turn = [&](int j) { return integral(j, u[0].v[2], u[1].v[2], u[2].v[2]); };
    const auto [sine, cosine] = small_sine_and_cosine(Wheels{turn(0), turn(1), turn(2), 0});
    double dx[3], dy[3];
    for (int j = 0; j < 3; ++j) {
      pose[j].cosine = start.pose.cosine * cosine[j] - start.pose.sine * sine[j];
      pose[j].sine = start.pose.sine * cosine[j] + start.pose.cosine * sine[j];
      dx[j] = u[j].v[0] * pose[j].cosine - u[j].v[1] * pose[j].sine;
      dy[j] = u[j].v[0] * pose[j].sine + u[j].v[1] * pose[j].cosine;
    }
    for (int j = 0; j < 3; ++j) {
      pose[j].x = start.x.x() + integral(j, dx[0], dx[1], dx[2]);
      pose[j].y = start.x.y() + integral(j, dy[0], dy[1], dy[2]);
    }
    return pose;
  }

  void factorize(const System& system, const Stages& stages) {
    matrix_.factorize(system, stages.u, torque_, evaluated_);
    is_derivative_ = friction_agrees(system, stages, radau_options.matrix_mismatch);
    ++statistics_->factorizations;
  }

  // Newton's correction for the forces r; returns its size.
  [[gnu::flatten, gnu::noinline]] double correction(const System& system, const StageVelocities& r) {
    matrix_.solve(system, r, correction_, dN_);
    return convergence_.size(correction_);
  }

  double relative_tolerance_;
  IntegrationStatistics* statistics_;
  RadauConvergence convergence_;
  RadauMatrix<Model> matrix_;
  bool is_derivative_ = false;  // whether friction agreed where the matrix was made
  StageVelocities forces_;
  alignas(kAlignment) std::array<Wheels, RadauTableau::stages> torque_;
  Evaluation evaluated_;  // at the start of the last correction
  StageVelocities correction_;
  std::array<Wheels, 3> dN_;  // what the last correction adds to dynamic reactions
};

}  // namespace youbot_base_sim
