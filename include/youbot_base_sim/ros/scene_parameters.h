#pragma once

#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The scene of a node that runs until it is ended: `overrides`, the parameter `scene` (a scene file) and `profile` and
/// `friction_scale`, which override its values. Without a file: the paper's robot with the measured profile, at rest at
/// the origin, and a relative tolerance of 1e-5. Throws ParameterError; it names a bad override as the parameter that
/// has its name.
Scene read_scene(Parameters& parameters, SceneOverrides overrides);

}  // namespace youbot_base_sim
