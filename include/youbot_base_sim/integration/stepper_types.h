#pragma once

#include <boost/numeric/odeint/stepper/controlled_step_result.hpp>
#include <boost/numeric/odeint/stepper/stepper_categories.hpp>
#include <boost/numeric/odeint/util/is_resizeable.hpp>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The types that odeint asks of a Controlled Stepper that works on a State.
struct ControlledStepperTypes {
  using state_type = State;
  using deriv_type = State;
  using value_type = double;
  using time_type = double;
  using stepper_category = boost::numeric::odeint::controlled_stepper_tag;
  using Result = boost::numeric::odeint::controlled_step_result;
};

}  // namespace youbot_base_sim

/// A State never changes its size: odeint's range_algebra works on it in place.
template <>
struct boost::numeric::odeint::is_resizeable<youbot_base_sim::State> : boost::false_type {
  using type = boost::false_type;
  static const bool value = false;
};
