#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// -d(forces)/d(velocities) at fixed positions, without the Coriolis forces, for each wheel; SI units.
/// `platform_dphi[i]` is the force on platform velocity i by dphi, `dphi_platform[k]` on dphi by platform velocity k.
struct alignas(kAlignment) DampingMatrix {
  std::array<std::array<Wheels, 3>, 3> platform_platform;
  std::array<Wheels, 3> platform_dphi, platform_dgamma;
  std::array<Wheels, 3> dphi_platform, dgamma_platform;
  Wheels dphi_dphi, dphi_dgamma, dgamma_dphi, dgamma_dgamma;
};

}  // namespace youbot_base_sim
