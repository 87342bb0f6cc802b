#pragma once

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/scene/scene_section.h"

namespace youbot_base_sim {

/// Reads the lists `loads` and `wrenches`; either may be left out. Throws SceneError.
LoadSchedule read_load_schedule(const SceneValue& loads, const SceneValue& wrenches);

}  // namespace youbot_base_sim
