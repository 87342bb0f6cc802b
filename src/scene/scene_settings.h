#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The document with the settings in place of its own values, one after the other. Sections and lists that a key leads
/// through are made where they are missing. Throws SceneError, which begins with the name of `file`, for what is no key
/// and for one that leads through what is neither.
YAML::Node with_settings(const std::string& file, const YAML::Node& root, const std::vector<SceneSetting>& settings);

}  // namespace youbot_base_sim
