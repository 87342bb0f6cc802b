#pragma once

#include "youbot_base_sim/integration/stepper_types.h"
#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// A Controlled Stepper of odeint whose time counts control periods, around one in seconds. The ends of periods that
/// odeint computes are then whole numbers, so that a run has the same bits however it is grouped into calls.
template <class Stepper>
class PeriodStepper : public ControlledStepperTypes {
 public:
  /// `period` in s; `stepper` must outlive this.
  PeriodStepper(Stepper& stepper, double period) : stepper_(&stepper), period_(period) {}

  /// Tries a step of at most dt periods from x at time t, in periods.
  template <class System>
  Result try_step(System system, State& x, double& t, double& dt) {
    const double start = t * period_, bound = dt * period_;
    double time = start, next = bound;
    const auto result = stepper_->try_step(system, x, time, next);
    if (time != start) t = time == start + bound ? t + dt : t + (time - start) / period_;
    dt = next / period_;
    return result;
  }

 private:
  Stepper* stepper_;
  double period_;
};

}  // namespace youbot_base_sim
