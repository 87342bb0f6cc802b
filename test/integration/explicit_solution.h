#pragma once

#include <Eigen/Dense>
#include <boost/numeric/odeint.hpp>
#include <vector>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// State at t_end (s) of `system`, which is at x at time t, by an explicit method of order 8 that shares only the
/// right-hand side. Steps are as short as the fastest rate wants: below 1e-6 s for contacts that grip, with the paper's
/// parameters, so that a tenth of a second takes a second.
template <class System>
State explicit_solution(const System& system, const State& x, double t, double t_end, double tolerance = 1e-14) {
  namespace odeint = boost::numeric::odeint;
  using Numbers = std::vector<double>;
  Numbers numbers(State::Values::SizeAtCompileTime);
  Eigen::Map<State::Values>(numbers.data()) = x.values;
  const auto right_hand_side = [&](const Numbers& y, Numbers& dydt, double time) {
    State state, derivative;
    state.values = Eigen::Map<const State::Values>(y.data());
    system(state, derivative, time);
    Eigen::Map<State::Values>(dydt.data()) = derivative.values;
  };
  odeint::integrate_adaptive(odeint::make_controlled<odeint::runge_kutta_fehlberg78<Numbers>>(tolerance, tolerance),
                             right_hand_side, numbers, t, t_end, 1e-6);
  State result;
  result.values = Eigen::Map<State::Values>(numbers.data());
  return result;
}

}  // namespace youbot_base_sim
