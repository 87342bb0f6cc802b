#pragma once

#include <optional>
#include <vector>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// The part of an integration's motion that is not in the state.
struct MotionSoFar {
  std::optional<ContactModes> contacts;  ///< none in model 1
  IntegrationStatistics statistics;
  std::vector<RollerSwitch> switches;  ///< that were not taken
};

}  // namespace youbot_base_sim
