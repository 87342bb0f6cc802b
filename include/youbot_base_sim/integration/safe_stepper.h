#pragma once

#include "youbot_base_sim/integration/bordered_solver.h"

namespace youbot_base_sim {

/// The step of last resort: backward Euler with the geometry of the contacts and the Coriolis forces held as they are
/// at the step's start. With constant normal reactions the friction force is then the slope of a convex potential, so
/// that Newton's method with a line search always ends, whatever the step size and the regularisation. First order; it
/// locates no switches: each step takes the rollers on which its start stands, by (2.1).
template <class Law>
class SafeStepper {
 public:
  /// Advances x by dt (s) under the wheel torques M (N m).
  void step(const SlipModel<Law>& model, State& x, const Wheels& M, double dt) {
    Wheels roller_angle;
    for (int i = 0; i < kWheels; ++i) {
      roller_angle[i] = model.geometry().roller_at(x.phi()[i]) * model.geometry().pitch();
    }
    State v = x, trial, change, residual, forces;
    forces = forces_at(model, x, v, roller_angle, M, dt, residual);
    for (int iteration = 0; iteration < kMostIterations; ++iteration) {
      model.linearize(v, roller_angle, M, jacobian_);
      hold_geometry(model, v);
      solver_.factorize(jacobian_, model.inertia(), 1 / dt);
      solver_.solve(residual, change);
      const double decrement = slope(model, residual, change);  // the slope at v along the way back to the minimum
      const double energy = kinetic_energy(model.robot(), v) + kEnergyFloor;
      if (!(dt * decrement > kConverged * energy)) break;
      double length = 1;
      for (int halving = 0; halving < kMostHalvings; ++halving, length *= 0.5) {
        trial.values = v.values;
        trial.values.col(1) -= length * change.values.col(1);
        trial.dphi() -= length * change.dphi();
        trial.dgamma() -= length * change.dgamma();
        forces = forces_at(model, x, trial, roller_angle, M, dt, residual);
        // Convex: along the line the slope only falls. Past the minimum is fine, far past it is not.
        if (slope(model, residual, change) > -0.5 * decrement) break;
      }
      v = trial;
    }
    advance_positions(x, v, forces, dt);
  }

 private:
  static constexpr int kMostIterations = 60;
  static constexpr int kMostHalvings = 40;
  static constexpr double kConverged = 1e-22;    // of the kinetic energy: velocities to about 1e-11
  static constexpr double kEnergyFloor = 1e-12;  // J

  // Time derivative at the velocities `v` with all else as in `x`; `residual` is (v - x) / dt - that, in velocities.
  static State forces_at(const SlipModel<Law>& model, const State& x, const State& v, const Wheels& roller_angle,
                         const Wheels& M, double dt, State& residual) {
    State derivative;
    model.derivative(v, roller_angle, M, derivative);
    const Inertia& inertia = model.inertia();
    derivative.values.col(1).head<3>() +=
        (inertia.M_v_inverse * (inertia.coriolis(x.velocity()) - inertia.coriolis(v.velocity()))).array();
    residual.values = (v.values - x.values) / dt - derivative.values;
    residual.values.col(0).setZero();
    residual.phi().setZero();
    residual.gamma().setZero();
    return derivative;
  }

  // Leaves in the Jacobian only what velocities do by friction and damping: symmetric, negative semidefinite.
  void hold_geometry(const SlipModel<Law>& model, const State& v) {
    jacobian_.Q_v -= model.inertia().coriolis_by_velocity(v.velocity());
    for (Wheels& column : jacobian_.Q_phi) column.setZero();
    jacobian_.dphi_phi.setZero();
    jacobian_.dgamma_phi.setZero();
  }

  // Power of the residual forces along `change`.
  static double slope(const SlipModel<Law>& model, const State& residual, const State& change) {
    const Inertia& inertia = model.inertia();
    return residual.velocity().dot(inertia.M_v * change.velocity()) +
           (inertia.J_1 * residual.dphi() * change.dphi() + inertia.J_2 * residual.dgamma() * change.dgamma()).sum();
  }

  static void advance_positions(State& x, const State& v, const State& derivative, double dt) {
    const double psi = x.psi() + 0.5 * dt * v.Omega();  // midway
    x.x() += dt * (v.V_X() * std::cos(psi) - v.V_Y() * std::sin(psi));
    x.y() += dt * (v.V_X() * std::sin(psi) + v.V_Y() * std::cos(psi));
    x.psi() += dt * v.Omega();
    x.work() += dt * derivative.work();
    x.phi() += dt * v.dphi();
    x.gamma() += dt * v.dgamma();
    x.values.col(1) = v.values.col(1);
    x.dphi() = v.dphi();
    x.dgamma() = v.dgamma();
  }

  BorderedJacobian jacobian_;
  BorderedSolver solver_;
};

}  // namespace youbot_base_sim
