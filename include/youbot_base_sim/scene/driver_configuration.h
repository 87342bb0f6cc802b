#pragma once

#include <string>

#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/scene/scene_setting.h"

namespace youbot_base_sim {

/// The part of the driver's configuration file that matters to the simulation.
struct DriverConfiguration {
  Motor motor;
  DriverKinematics kinematics;
};

/// Reads `name`.cfg in `folder`, the driver's youbot-base.cfg or one like it: the sections [YouBotKinematic] and
/// [Joint_1] to [Joint_4]. The four motors must be equal. Throws SceneError.
DriverConfiguration load_driver_configuration(const std::string& folder, const std::string& name);

}  // namespace youbot_base_sim
