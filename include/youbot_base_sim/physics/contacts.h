#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Slip, friction and offset at the four contacts, in the platform's frame.
struct alignas(kAlignment) Contacts {
  Wheels V_PX, V_PY;  ///< slip velocity, m/s
  Wheels F_X, F_Y;    ///< friction, N
  Wheels Delta_Y;     ///< offset of the contact point along the wheel's axle, m
  Wheels r_X, r_Y;    ///< what a unit dgamma takes from V_PX and adds to V_PY, m
  Wheels M_Z;         ///< moment of the friction about O, N m
};

/// Contact quantities for output.
struct ContactDetails : Contacts {
  Wheels N = Wheels::Zero();      ///< normal reaction, N; in model 1 that at rest
  Wheels f = Wheels::Zero();      ///< coefficient of friction
  Wheels omega = Wheels::Zero();  ///< rate at which the roller rotates on the spot, rad/s; zero without spin friction
  Wheels M_S = Wheels::Zero();    ///< torque of the spin friction, N m; part of M_Z
  Wheels F_Z = Wheels::Zero();    ///< M_S / a_m, which shares the limit of friction with F_X and F_Y, N
  Wheels T_S = Wheels::Zero();    ///< its torque on the roller, N m
  /// Gravity along the floor and wrenches, on (V_X, V_Y, Omega, 0), N and N m.
  Wheels external = Wheels::Zero();
};

}  // namespace youbot_base_sim
