#include "youbot_base_sim/ros/scene_parameters.h"

#include <fmt/format.h>

#include <string>

namespace youbot_base_sim {

namespace {

// Defaults without a scene. The tolerance puts a minute of driving within a few micrometres, at a third of the run time
// of the scenes' default; the profile is that of a real base.
constexpr double kTolerance = 1e-5;
constexpr char kProfile[] = "measured";

}  // namespace

Scene read_scene(Parameters& parameters, SceneOverrides overrides) {
  std::string path;
  overrides.endless = true;
  parameters.read("scene", path);
  parameters.read("profile", overrides.profile);
  parameters.read("friction_scale", overrides.friction_scale, kFrictionScales);
  if (path.empty()) {
    if (!overrides.relative_tolerance) overrides.relative_tolerance = kTolerance;
    if (overrides.profile.empty()) overrides.profile = kProfile;
  }
  std::string where = "~";  // continued by the name of an override: "model = ..."
  try {
    const Scene scene = default_scene(overrides);
    where = "~scene: ";
    return path.empty() ? scene : load_scene(path, overrides);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter {}{}", where, error.what()));
  }
}

}  // namespace youbot_base_sim
