#pragma once

#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// A Controlled Stepper of odeint whose time counts control periods, around one whose time is in seconds. odeint
/// computes the ends of periods as start + k dt; counted in periods these are whole numbers and exact, so that a run
/// has the same bits however many periods are integrated by one call.
template <class Stepper>
class PeriodStepper {
 public:
  using state_type = State;
  using deriv_type = State;
  using value_type = double;
  using time_type = double;
  using order_type = unsigned short;
  using stepper_category = boost::numeric::odeint::controlled_stepper_tag;

  /// `period` in s; `stepper` must outlive this.
  PeriodStepper(Stepper& stepper, double period) : stepper_(&stepper), period_(period) {}

  /// Tries a step of at most dt periods from x at time t, in periods.
  template <class System>
  boost::numeric::odeint::controlled_step_result try_step(System system, State& x, double& t, double& dt) {
    const double start = t * period_, bound = dt * period_;
    double time = start, next = bound;
    const auto result = stepper_->try_step(system, x, time, next);
    if (result == boost::numeric::odeint::fail) return result;
    t = time == start + bound ? t + dt : t + (time - start) / period_;
    dt = next / period_;
    return result;
  }

 private:
  Stepper* stepper_;
  double period_;
};

}  // namespace youbot_base_sim
