#pragma once

#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/integration/bordered_stages.h"
#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {

/// The step of last resort: backward Euler with the geometry of the contacts, Coriolis forces and normal reactions of
/// its start. Its velocities minimise a convex potential (docs/method.md), so Newton's method with a line search ends
/// for any step length. The step is of first order; wheels stay on their rollers, even beyond the edges.
template <class Model>
class FallbackStepper {
 public:
  /// Advances x by dt (s) under the torques at t + dt; no contact may be shared.
  void do_step(const SlipSystem<Model>& system, State& x, double t, double dt) {
    const Model& model = system.model();
    const Inertia& inertia = model.inertia();
    const Velocities start = x.velocities();
    const Wheels M = system.torque().value(t + dt);
    const Velocities held = {inertia.coriolis(start.v), Wheels::Zero(), Wheels::Zero()};
    auto contacts = system.contacts(x, t + dt);
    const auto at_start = contacts;
    // The slope of the potential at u: forces that are left over.
    const auto residual = [&](const Velocities& u) {
      system.contacts_near(x, at_start, u, contacts);
      system.count_evaluations(1);
      const Velocities moving = {inertia.coriolis(u.v), Wheels::Zero(), Wheels::Zero()};
      return inertia * ((1 / dt) * (u - start)) - (model.forces(u, contacts, M) - moving + held);
    };
    Velocities u = start;
    Velocities r = residual(u);
    for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
      std::array<DampingMatrix, 1> G;
      model.damping(u, contacts, G[0]);
      solver_.factorize({{1 / dt}}, inertia, G, {{PlatformMatrix{Wheels::Zero(), Wheels::Zero(), Wheels::Zero()}}});
      std::array<Velocities, 1> solved;
      solver_.solve({r}, solved);
      const Velocities& change = solved[0];
      const double decrement = dot(r, change);
      if (!std::isfinite(decrement)) throw std::domain_error("fallback step: the equations have no finite solution");
      if (!(dt * decrement > kConverged * (0.5 * dot(u, inertia * u) + kEnergyFloor))) break;
      double length = 1;
      Velocities trial;
      for (int halving = 0; halving < kMaxHalvings; ++halving, length *= 0.5) {
        trial = u - length * change;
        r = residual(trial);
        // Along the line a convex function's slope only grows: past the minimum is fine, far past it is not.
        if (dot(r, change) > -0.5 * decrement) break;
      }
      u = trial;
    }
    advance_positions(x, u, dot(u, model.forces(u, contacts, M)), dt);
  }

 private:
  static constexpr int kMaxIterations = 60;
  static constexpr int kMaxHalvings = 40;
  static constexpr double kConverged = 1e-22;    // of the kinetic energy: velocities to about 1e-11
  static constexpr double kEnergyFloor = 1e-12;  // J

  static void advance_positions(State& x, const Velocities& u, double power, double dt) {
    const double psi = x.psi() + 0.5 * dt * u.v[2];  // midway
    const auto [sine, cosine] = sine_and_cosine(psi);
    x.x() += dt * (u.v[0] * cosine - u.v[1] * sine);
    x.y() += dt * (u.v[0] * sine + u.v[1] * cosine);
    x.psi() += dt * u.v[2];
    x.work() += dt * power;
    x.phi() += dt * u.dphi;
    x.gamma() += dt * u.dgamma;
    x.set(u);
  }

  BorderedStages<1> solver_;
};

}  // namespace youbot_base_sim
