#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace youbot_base_sim {

/// The text of a file or pipe that is one YAML document. Throws SceneError for what is not YAML, has more than one
/// document, or is too long or too deep for a scene, and for what cannot be read. `kind` is what it should be.
std::string read_yaml_text(const std::string& path, const char* kind = "scene");

/// The document in a file or pipe. Throws as read_yaml_text does.
YAML::Node read_yaml_file(const std::string& path);

}  // namespace youbot_base_sim
