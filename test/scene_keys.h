#pragma once

#include <yaml-cpp/yaml.h>

#include <set>
#include <string>

namespace youbot_base_sim {

/// Adds the paths of the keys in this section or list of sections, "robot.com" or "drive.torque[0].start".
inline void collect_paths(const YAML::Node& node, const std::string& path, std::set<std::string>& paths) {
  if (node.IsSequence()) {
    for (const YAML::Node& entry : node) collect_paths(entry, path + "[0]", paths);
  } else if (node.IsMap()) {
    for (const auto& entry : node) {
      const std::string key = (path.empty() ? "" : path + ".") + entry.first.Scalar();
      paths.insert(key);
      collect_paths(entry.second, key, paths);
    }
  }
}

/// The keys of a scene: those of libFuzzer's seeds, which refused_scenes_test compares with the program's own.
/// every_key.yaml has one of the five drives.
inline std::set<std::string> keys_of_seeds(const std::string& source) {
  std::set<std::string> keys;
  for (const char* seed : {"every_key", "reference_motion", "torque_table", "velocity_table", "wheel_angle_table"})
    collect_paths(YAML::LoadFile(source + "/test/fuzz/scene/" + seed + ".yaml"), "", keys);
  return keys;
}

}  // namespace youbot_base_sim
