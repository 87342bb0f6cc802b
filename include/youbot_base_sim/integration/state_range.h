#pragma once

#include <boost/numeric/odeint/util/is_resizeable.hpp>

#include "youbot_base_sim/physics/state.h"

namespace boost::numeric::odeint {

/// A State is a range of 24 numbers that never changes its size: odeint's range_algebra works on it in place.
template <>
struct is_resizeable<youbot_base_sim::State> : boost::false_type {
  using type = boost::false_type;
  static const bool value = false;
};

}  // namespace boost::numeric::odeint
