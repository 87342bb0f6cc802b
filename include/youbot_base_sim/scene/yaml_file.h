#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The text of a file or pipe that is one YAML document. Throws SceneError for what is not YAML, has more than one
/// document, or is too long or too deep for a scene, and for what cannot be read. `kind` is what it should be.
std::string read_yaml_text(const std::string& path, const char* kind = "scene");

/// The document with the settings in place of its own values, one after the other. Sections and lists that a key leads
/// through are made where they are missing. Throws SceneError, which begins with the name of `file`, for what is no key
/// and for one that leads through what is neither.
YAML::Node with_settings(const std::string& file, const YAML::Node& root, const std::vector<SceneSetting>& settings);

}  // namespace youbot_base_sim
