#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// What happens at the four contacts, in the platform's frame.
struct alignas(kAlignment) Contacts {
  Wheels V_PX, V_PY;  ///< slip velocity, m/s
  Wheels F_X, F_Y;    ///< friction, N
  Wheels Delta_Y;     ///< offset of the contact point along the wheel's axle, m
  Wheels r_X, r_Y;    ///< what a unit dgamma takes from V_PX and adds to V_PY, m
  Wheels M_Z;         ///< moment of the friction about O, N m
};

}  // namespace youbot_base_sim
