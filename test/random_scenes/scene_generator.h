#pragma once

#include <cstdint>
#include <string>

namespace youbot_base_sim {

/// A random scene file, and the table that its drive names.
struct RandomScene {
  std::string text;   ///< YAML: one line for each section
  std::string table;  ///< CSV; empty if the drive has none
};

/// Scene number `number`, the same on every machine: any model, method, drive and feature, around the paper's robot.
/// Every key of a scene comes up. A few scenes combine what is refused. `table_name` is the file to name as the
/// drive's table.
RandomScene random_scene_file(std::uint32_t number, const std::string& table_name);

}  // namespace youbot_base_sim
