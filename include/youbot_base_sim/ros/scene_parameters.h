#pragma once

#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The scene of a node that runs until it is ended: that of the parameter `scene` (a scene file) with these settings
/// and those of the parameters `profile` and `friction_scale`. Without a file: the paper's robot with the measured
/// profile, at rest at the origin, and a relative tolerance of 1e-5. Throws ParameterError; it names a bad setting as
/// the parameter that has its name.
Scene read_scene(Parameters& parameters, SceneSettings settings);

}  // namespace youbot_base_sim
