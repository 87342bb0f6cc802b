#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace youbot_base_sim {

/// Reads the one YAML document in a file or pipe. Throws SceneError for what is not YAML, has more than one document,
/// or is too long or too deep for a scene, and for what cannot be read.
YAML::Node read_yaml_file(const std::string& path);

}  // namespace youbot_base_sim
