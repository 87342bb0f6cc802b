#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/export.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// A mistake in a scene or the driver's configuration, in one line that names the key, its value and what is allowed.
struct SceneError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A value in place of a scene file's at a key such as "floor.friction" or "initial.wheel_angles[0]".
struct SceneSetting {
  SceneSetting() = default;
  /// `text` is YAML or, if it `is_literal`, a text as it stands.
  SceneSetting(std::string of, std::string text, bool literal = false)
      : key(std::move(of)), value(std::move(text)), is_literal(literal) {}
  SceneSetting(std::string of, double number);
  SceneSetting(std::string of, const Eigen::ArrayXd& numbers);  ///< a list

  std::string key;
  std::string value;
  bool is_literal = false;
};
using SceneSettings = std::vector<SceneSetting>;

}  // namespace youbot_base_sim
