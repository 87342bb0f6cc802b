#pragma once

#include "youbot_base_sim/drive/motor_settings.h"
#include "youbot_base_sim/scene/scene_section.h"

namespace youbot_base_sim {

/// Reads the section `motors`. Throws SceneError.
MotorSettings read_motors(SceneSection section);

}  // namespace youbot_base_sim
