#include "youbot_base_sim/ros/scene_parameters.h"

#include <fmt/format.h>

#include <optional>
#include <string>

namespace youbot_base_sim {

namespace {

// Defaults without a scene. The tolerance puts a minute of driving within a few micrometres, at a third of the run time
// of the scenes' default; the profile is that of a real base.
constexpr double kTolerance = 1e-5;
constexpr char kProfile[] = "measured";

}  // namespace

Scene read_scene(Parameters& parameters, SceneSettings settings) {
  std::string path, profile;
  std::optional<double> friction_scale;
  parameters.read("scene", path);
  if (path.empty()) {
    profile = kProfile;
    settings.insert(settings.begin(), {"solver.relative_tolerance", kTolerance});  // later ones replace it
  }
  parameters.read("profile", profile);
  SceneSetting setting("robot.profile", profile, true);
  if (parameters.read("friction_scale", friction_scale, kFrictionScales)) {
    parameters.require(profile == "measured", "friction_scale", fmt::format("{:g}", *friction_scale),
                       "left out unless profile = measured is given too");
    setting = {"robot.profile", fmt::format("{{name: measured, friction_scale: {}}}", *friction_scale)};
  }
  if (!profile.empty()) settings.push_back(setting);
  try {
    default_scene(settings, SceneUse::kCommands);
  } catch (const SceneError& error) {  // "solver.method = ...", for ~method
    const std::string mistake = error.what();
    throw ParameterError("parameter ~" + mistake.substr(mistake.rfind('.', mistake.find(" = ")) + 1));
  }
  try {
    return path.empty() ? default_scene(settings, SceneUse::kCommands)
                        : load_scene(path, settings, SceneUse::kCommands);
  } catch (const SceneError& error) {
    throw ParameterError(fmt::format("parameter ~scene: {}", error.what()));
  }
}

}  // namespace youbot_base_sim
