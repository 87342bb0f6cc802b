#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/radau_tableau.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/step_size_controller.h"

namespace youbot_base_sim {

/// One step at a time of Radau IIA, for a SlipSystem between two switches. Its stages are found by Newton iterations in
/// the velocities alone: positions, heading and work are integrals of these. Each stage has its own friction in the
/// Jacobian: with one for all, as Hairer and Wanner have it for smooth problems, the iterations fail where a wheel goes
/// from gripping to slipping within a step.
///
/// A linearly implicit method would do without iterations, but it takes its steps by the derivatives at their
/// beginning. Friction at slip speeds near nu turns within a step, and near sticking the velocities follow it like the
/// solution of a differential-algebraic equation of index 2: there Radau's error is about a thousand times smaller.
///
/// Functions that do the work are marked `flatten`: all that they call is small, and is worth having in one place.
template <class Law>
class Radau {
 public:
  using System = SlipSystem<Law>;

  explicit Radau(const Tolerance& tolerance) : tolerance_(tolerance) {}

  /// Steps that follow start from x at time t (s). Keeps what is known of the motion before, to predict from.
  [[gnu::flatten]] void begin(const System& system, const State& x, double t) {
    system_ = &system;
    x_ = x;
    t_ = t;
    start_ = x.velocities();
    const Wheels M = system.torque().value(t);
    Contacts contacts = system.contacts(start_, x.phi(), M);
    if (kept_.any()) {
      // The friction that the last step ended with, not the one of its slip, which may be off by more than nu.
      const auto keep = kept_ && !system.shared();
      contacts.F_X = keep.select(end_friction_.F_X, contacts.F_X);
      contacts.F_Y = keep.select(end_friction_.F_Y, contacts.F_Y);
      const Wheels M_Z = contacts.M_Z;
      system.model().set_moment(contacts);
      contacts.M_Z = keep.select(contacts.M_Z, M_Z);  // on two rollers, a mean of moments is not a moment of means
    }
    start_forces_ = system.model().forces(start_, contacts, M);
    start_friction_ = {contacts.F_X, contacts.F_Y};
    const Tolerance& tol = tolerance_;
    // The platform's velocities are judged together, 1 rad/s as 1 m/s.
    allowed_ = {Wheels::Constant(tol.absolute + tol.relative * start_.v.matrix().norm()),
                tol.absolute + tol.relative * start_.dphi.abs(),
                kRollerWeight * (tol.absolute + tol.relative * start_.dgamma.abs())};
    // Where a step's error is allowed to be beyond the slip at which friction turns, its equations must still be solved
    // to less.
    const Velocities turning = system.model().turning_point();
    solved_to_ = {kConverged * allowed_.v.min(turning.v), kConverged * allowed_.dphi.min(turning.dphi),
                  kConverged * allowed_.dgamma.min(turning.dgamma)};
  }

  /// Computes a step of length dt (s) from where `begin` was called. Returns false if the iterations do not converge,
  /// or the platform would turn by more than a radian.
  bool step(double dt) {
    if (known_ == Known::kNothing || !solve_from(dt, true)) {
      if (!solve_from(dt, false)) {
        known_ = Known::kNothing;
        return false;
      }
    }
    dt_ = dt;
    known_ = Known::kThisStep;
    return dt * std::max({std::abs(stages_[0].v[2]), std::abs(stages_[1].v[2]), std::abs(stages_[2].v[2])}) < 1;
  }

  /// State at the end of the step; `beyond` (s) later, or earlier, to first order: as long as its square is nothing.
  [[gnu::flatten]] State end(double beyond = 0) const {
    using T = RadauTableau;
    State x = x_;
    x.set(stages_[2]);
    // Heading at the stages, from the step's start.
    const auto heading = [&](int j) {
      return dt_ * (T::A[j][0] * stages_[0].v[2] + T::A[j][1] * stages_[1].v[2] + T::A[j][2] * stages_[2].v[2]);
    };
    Wheels sine, cosine;
    RollerGeometry::sine_and_cosine({heading(0), heading(1), heading(2), 0}, sine, cosine);
    double along = 0, across = 0, work = 0;
    for (int j = 0; j < 3; ++j) {
      const Velocities& u = stages_[j];
      const double b = dt_ * T::A[2][j];
      along += b * (u.v[0] * cosine[j] - u.v[1] * sine[j]);
      across += b * (u.v[0] * sine[j] + u.v[1] * cosine[j]);
      work += b * power(u, forces_[j]);
      x.phi() += b * u.dphi;
      x.gamma() += b * u.dgamma;
    }
    const double cos_psi = std::cos(x_.psi()), sin_psi = std::sin(x_.psi());
    x.x() += along * cos_psi - across * sin_psi;
    x.y() += along * sin_psi + across * cos_psi;
    x.psi() += heading(2);
    x.work() += work;
    if (beyond != 0) go_on(x, beyond);
    return x;
  }

  /// Wheel angles at the end of the step, rad; cheaper than `end`.
  Wheels end_phi() const { return phi_at(2, dt_); }
  const Wheels& end_dphi() const { return stages_[2].dphi; }
  const Velocities& end_velocities() const { return stages_[2]; }
  Velocities end_acceleration() const {
    using T = RadauTableau;
    return (T::A_inverse[2][0] / dt_) * (stages_[0] - start_) + (T::A_inverse[2][1] / dt_) * (stages_[1] - start_) +
           (T::A_inverse[2][2] / dt_) * (stages_[2] - start_);
  }

  /// Estimate of the step's error in units of what is allowed: 1 where it is just allowed.
  [[gnu::flatten]] double error() {
    using T = RadauTableau;
    const Velocities change = (T::error[0] / dt_) * (stages_[0] - start_) +
                              (T::error[1] / dt_) * (stages_[1] - start_) + (T::error[2] / dt_) * (stages_[2] - start_);
    const Inertia& inertia = system_->model().inertia();
    filter_.factorize({{T::gamma / dt_}}, inertia, {{resistance_[2]}}, {{coriolis_[2]}});
    std::array<Velocities, 1> error;
    filter_.solve({start_forces_ + inertia * change}, error);
    Velocities& e = error[0];
    if (inertia.J_2 == 0) e.dgamma.setZero();  // follows from the other velocities
    return std::sqrt(
        ((e.v / allowed_.v).square() + (e.dphi / allowed_.dphi).square() + (e.dgamma / allowed_.dgamma).square())
            .sum() /
        11);
  }

  /// Whether a step may change the platform's velocity by `speed` (m/s) in error.
  bool negligible(double speed) const { return speed < allowed_.v[0]; }

  /// The step stands: the next ones are predicted from it.
  void keep() {
    known_ = Known::kStepBefore;
    before_ = start_;
    friction_before_ = start_friction_;
    end_friction_ = friction_[2];
    kept_.fill(true);
  }

  /// The motion goes on in another way: nothing is predicted.
  void forget() {
    known_ = Known::kNothing;
    kept_.fill(false);
  }

  /// The same on account of wheel i alone: the friction of the others goes on.
  void forget(int i) {
    known_ = Known::kNothing;
    kept_[i] = false;
  }

  /// Newton iterations so far.
  std::uint64_t iterations() const { return iterations_; }

 private:
  using StageVelocities = std::array<Velocities, RadauTableau::stages>;
  enum class Known { kNothing, kThisStep, kStepBefore };

  // An error of a roller's rate is forgotten within 1e-7 s; what stays is the impulse that went with it, which is small
  // as the roller's inertia is.
  static constexpr double kRollerWeight = 10;
  static constexpr int kMostIterations = 25;
  static constexpr double kShortest = 1.0 / 64;  // part of a correction
  static constexpr double kConverged = 0.03;     // of the tolerance
  // The Jacobian is renewed after a first correction of more than kFar tolerances, and where corrections shrink by less
  // than kSlow.
  static constexpr double kFar = 3000;
  static constexpr double kSlow = 0.1;
  // What the next step's first correction is at least expected to leave, in the light of this one
  static constexpr double kLeastRate = 0.03;

  // Moves the end of the step by dt.
  void go_on(State& x, double dt) const {
    const Velocities& u = stages_[2];
    x.set(u + dt * end_acceleration());
    const double cos_psi = std::cos(x.psi()), sin_psi = std::sin(x.psi());
    x.x() += dt * (u.v[0] * cos_psi - u.v[1] * sin_psi);
    x.y() += dt * (u.v[0] * sin_psi + u.v[1] * cos_psi);
    x.psi() += dt * u.v[2];
    x.work() += dt * power(u, forces_[2]);
    x.phi() += dt * u.dphi;
    x.gamma() += dt * u.dgamma;
  }

  Wheels phi_at(int j, double dt) const {
    using T = RadauTableau;
    return x_.phi() + dt * (T::A[j][0] * stages_[0].dphi + T::A[j][1] * stages_[1].dphi + T::A[j][2] * stages_[2].dphi);
  }

  // The collocation polynomial of the step that is known, at the stages of one of length dt.
  void predict(double dt) {
    using T = RadauTableau;
    const StageVelocities known = stages_;
    const std::array<ContactForce, 3> known_friction = friction_;
    const Velocities& start = known_ == Known::kStepBefore ? before_ : start_;
    const ContactForce& start_friction = known_ == Known::kStepBefore ? friction_before_ : start_friction_;
    for (int j = 0; j < 3; ++j) {
      const double s = (known_ == Known::kStepBefore ? 1 : 0) + T::c[j] * dt / dt_;
      // Lagrange's weights on the nodes 0, c_1, c_2, 1
      const double a = s - T::c[0], b = s - T::c[1], c = s - 1;
      constexpr double c_1 = T::c[0], c_2 = T::c[1];
      const double w_0 = a * b * c / (-c_1 * c_2), w_1 = s * b * c / (c_1 * (c_1 - c_2) * (c_1 - 1)),
                   w_2 = s * a * c / (c_2 * (c_2 - c_1) * (c_2 - 1)), w_3 = s * a * b / ((1 - c_1) * (1 - c_2));
      stages_[j] = w_0 * start + w_1 * known[0] + w_2 * known[1] + w_3 * known[2];
      friction_[j] = system_->model().bounded(w_0 * start_friction + w_1 * known_friction[0] + w_2 * known_friction[1] +
                                              w_3 * known_friction[2]);
    }
  }

  bool solve_from(double dt, bool predicted) {
    using T = RadauTableau;
    if (predicted) {
      predict(dt);
    } else {
      stages_.fill(start_);
      friction_.fill(start_friction_);
    }
    for (int j = 0; j < 3; ++j) torque_[j] = system_->torque().value(t_ + T::c[j] * dt);
    StageVelocities left, change;
    double length = 1, last = 0, rate = rate_;
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      ++iterations_;
      residual(dt, left);
      if (iteration == 0) factorize(dt);
      double size = solve(left, change);
      if (iteration > 0) {
        // Deuflhard's natural test: by the same Jacobian, what is left to correct must have shrunk.
        if (!(size <= (1 - length / 4) * last)) {
          length /= 2;
          if (length < kShortest) return false;
          move(length);
          continue;
        }
        rate = size / last;
        if (iteration == 1 ? last > kFar : rate > kSlow) {
          factorize(dt);
          size = solve(left, change);
        }
      }
      if (!(size <= std::numeric_limits<double>::max())) return false;
      from_.stages = stages_;
      from_.contacts = contacts_;
      from_.friction = friction_;
      from_.correction = change;
      length = 1;
      last = size;
      move(length);
      if (rate < 1 && size * rate / (1 - rate) < 1) {
        rate_ = std::min(std::max(rate, kLeastRate), 0.5);
        return true;
      }
    }
    return false;
  }

  // Goes a part of the last correction.
  [[gnu::flatten, gnu::noinline]] void move(double length) {
    for (int j = 0; j < 3; ++j) {
      const Velocities part = length * from_.correction[j];
      stages_[j] = from_.stages[j] + part;
      friction_[j] = system_->model().friction_after(from_.contacts[j], from_.friction[j], part);
    }
  }

  // Forces that are left over at each stage.
  [[gnu::flatten, gnu::noinline]] void residual(double dt, StageVelocities& r) {
    using T = RadauTableau;
    const auto& model = system_->model();
    const double per_dt = 1 / dt;
    const Velocities z[3] = {per_dt * (stages_[0] - start_), per_dt * (stages_[1] - start_),
                             per_dt * (stages_[2] - start_)};
#pragma GCC unroll 3
    for (int j = 0; j < 3; ++j) {
      system_->contacts(stages_[j], phi_at(j, dt), torque_[j], contacts_[j]);
      forces_[j] = model.forces(stages_[j], contacts_[j], torque_[j]);
      r[j] = forces_[j] -
             model.inertia() * (T::A_inverse[j][0] * z[0] + T::A_inverse[j][1] * z[1] + T::A_inverse[j][2] * z[2]);
    }
  }

  [[gnu::flatten, gnu::noinline]] void factorize(double dt) {
    using T = RadauTableau;
    const auto& model = system_->model();
    double D[3][3];
    for (int j = 0; j < 3; ++j) {
      for (int l = 0; l < 3; ++l) D[j][l] = T::A_inverse[j][l] / dt;
      system_->resistance(stages_[j], contacts_[j], friction_[j], torque_[j], resistance_[j]);
      coriolis_[j] = model.inertia().coriolis_by_velocity(stages_[j].v);
    }
    solver_.factorize(D, model.inertia(), resistance_, coriolis_);
  }

  // Newton's correction for what is left over; returns its size in units of what the equations are solved to.
  [[gnu::flatten, gnu::noinline]] double solve(const StageVelocities& left, StageVelocities& change) const {
    solver_.solve(left, change);
    double squares = 0;
    for (const Velocities& u : change) {
      squares += ((u.v / solved_to_.v).square() + (u.dphi / solved_to_.dphi).square() +
                  (u.dgamma / solved_to_.dgamma).square())
                     .sum();
    }
    return std::sqrt(squares / 11);
  }

  Tolerance tolerance_;
  const System* system_ = nullptr;
  State x_;
  double t_ = 0;
  Velocities start_, start_forces_, allowed_, solved_to_, before_;
  Known known_ = Known::kNothing;
  double dt_ = 0;  // of the step that is known
  double rate_ = 0.1;
  StageVelocities stages_, forces_;
  std::array<Contacts, RadauTableau::stages> contacts_;
  alignas(kAlignment) std::array<Wheels, RadauTableau::stages> torque_;
  std::array<Resistance, 3> resistance_;
  alignas(kAlignment) std::array<PlatformMatrix, 3> coriolis_;
  ContactForce start_friction_, end_friction_, friction_before_;
  Eigen::Array<bool, kWheels, 1> kept_ = Eigen::Array<bool, kWheels, 1>::Constant(false);
  std::array<ContactForce, 3> friction_;
  struct {
    StageVelocities stages;
    std::array<Contacts, RadauTableau::stages> contacts;
    std::array<ContactForce, RadauTableau::stages> friction;
    StageVelocities correction;
  } from_;  // where the last correction began, and it
  BorderedStages<3> solver_;
  BorderedStages<1> filter_;
  std::uint64_t iterations_ = 0;
};

}  // namespace youbot_base_sim
