#pragma once

// What the tests of the physics and of its integration share: random parameters and states, and finite differences.

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

constexpr double kPi = 3.14159265358979323846;

/// Random numbers, the same in every run and with every standard library.
class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return low + (high - low) * (engine_() / 4294967296.0); }
  Wheels wheels(double low, double high) {
    Wheels result;
    for (int i = 0; i < kWheels; ++i) result[i] = uniform(low, high);
    return result;
  }

 private:
  std::mt19937 engine_;
};

/// A robot with nothing symmetric about it, so that no wrong index or sign cancels; within a factor of 2 of (5.1).
inline RobotParameters random_robot(Random& random) {
  const auto near = [&](double value) { return value * random.uniform(0.6, 1.4); };
  RobotParameters robot;
  robot.m = near(robot.m);
  robot.m_1 = near(robot.m_1);
  robot.I_s = near(robot.I_s);
  robot.J_1 = near(robot.J_1);
  robot.J_2 = near(robot.J_2);
  robot.a_X = near(robot.a_X);
  robot.a_Y = near(robot.a_Y);
  robot.h = near(robot.h);
  robot.l = near(robot.l);
  robot.R_d = robot.R * random.uniform(0.6, 0.75);
  robot.mu_1 *= random.wheels(0.6, 1.4);
  robot.mu_2 *= random.wheels(0.6, 1.4);
  return robot;
}

/// Its rollers at another angle on each wheel, on some the other way round.
inline RobotParameters random_wheels(Random& random) {
  RobotParameters robot = random_robot(random);
  robot.roller_angle = random.wheels(20, 70) * Wheels{1, -1, 1, 1};
  return robot;
}

/// delta_i, rad (paper, section 2).
inline Wheels delta(const RobotParameters& robot) { return Wheels{-1, 1, 1, -1} * robot.roller_angle * (kPi / 180); }

/// A state in motion at ordinary speeds, each contact point slipping by `slip` (m/s) in some direction. The wheels
/// stand on rollers around `phi_center` (rad), at most 0.95 of the way to their edges.
inline State random_state(Random& random, const RobotParameters& robot, const Wheels& phi_center, double slip) {
  State state;
  state.values.col(0) = random.wheels(-2, 2);
  state.V_X() = random.uniform(-0.5, 0.5);
  state.V_Y() = random.uniform(-0.5, 0.5);
  state.Omega() = random.uniform(-1, 1);
  state.gamma() = random.wheels(-2, 2);
  const Wheels phi_tilde = random.wheels(-0.95, 0.95) * kPi / robot.rollers;
  state.phi() = phi_center + phi_tilde;
  // (3.3) as in model.md, solved for the rates; it only has to bring about the slip that was asked for.
  const Wheels direction = random.wheels(-kPi, kPi);
  const Wheels r = robot.R - robot.R_d / phi_tilde.cos(), delta = youbot_base_sim::delta(robot);
  const Wheels Delta_Y = robot.R_d * phi_tilde.tan() * delta.tan();
  state.dgamma() =
      (slip * direction.sin() - state.V_Y() - robot.rho_X() * state.Omega()) / (r * phi_tilde.cos() * delta.cos());
  state.dphi() = (state.V_X() - (robot.rho_Y() + Delta_Y) * state.Omega() - r * delta.sin() * state.dgamma() -
                  slip * direction.cos()) /
                 robot.R;
  return state;
}

/// Derivative at 0 of a function of one number, by five points h apart: error h^4 f'''''/30, and rounding over h.
template <class Function>
auto difference(Function&& f, double h) {
  return ((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)).eval();
}

/// Contacts of rollers at the wheel angles phi_tilde (rad), under the normal reactions of the base at rest.
template <class Model>
typename Model::Contacts contacts_of(const Model& model, const Velocities& u, const Wheels& phi_tilde) {
  typename Model::Contacts c;
  model.evaluate_kinematics(u, model.geometry().at(phi_tilde), {}, c);
  model.apply_static_normal_force(c);
  return c;
}

}  // namespace youbot_base_sim
