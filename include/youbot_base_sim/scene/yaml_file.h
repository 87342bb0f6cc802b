#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

#include "youbot_base_sim/scene/scene_setting.h"

namespace youbot_base_sim {

/// The text of a file or pipe that is one YAML document, a `kind` in messages. Throws SceneError if it cannot be read,
/// is not YAML, has more than one document, or is too long or too deep for a scene.
std::string read_yaml_text(const std::string& path, const char* kind = "scene");

/// Checks a text likewise, which messages name `path`.
std::string checked_yaml_text(const std::string& path, std::string text, const char* kind = "scene");

/// The document with these settings in place of its own values; missing sections and lists are added. Throws
/// SceneError, which begins with `file`, for a key that is none or that leads through a plain value.
YAML::Node with_settings(const std::string& file, const YAML::Node& root, const SceneSettings& settings);

}  // namespace youbot_base_sim
