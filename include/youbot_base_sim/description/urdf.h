#pragma once

#include <functional>
#include <string>

#include "youbot_base_sim/description/meshes.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// The URI at which viewers find the mesh of a part of a robot.
using MeshUri = std::function<std::string(Part, const RobotParameters&)>;

enum class RollerJoints {
  kFixed,   ///< for the driver's joint states, which have no rollers
  kTurning  ///< continuous, with the sign of gamma; needs the rollers' joint states
};

/// URDF of `robot`, drawn from the parameters of the simulation. Joints have the driver's names: base_footprint -
/// base_link, then for each wheel caster_joint_xx (about z, always 0) - wheel_joint_xx (about y, positive forward) -
/// roller_joint_xx_0 .. n-1. SI units.
///
/// Roller k of a wheel points straight down at the wheel angle k 2 pi / n. The x axis of its link is the roller's axis
/// e_i (paper, section 2). Meshes are those of meshes.h.
///
/// The body has the mass m at (a_X, a_Y) in the plane of the axles and the share of I_s that the wheels leave it, or,
/// if they leave none, the inertia of a solid box. Each wheel has m_1 and J_1; rollers have no inertia, as in the
/// paper. The planar model has no moments about the other axes: they are those of a box and of a disc.
///
/// Every robot of a scene can be drawn. Rollers that would end in a point before they meet end there.
std::string urdf(const RobotParameters& robot, RollerJoints rollers, const MeshUri& mesh_uri);

}  // namespace youbot_base_sim
