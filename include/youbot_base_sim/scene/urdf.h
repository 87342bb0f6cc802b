#pragma once

#include <string>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Height of the wheels' axles in base_link and base_footprint, m, as in the youBot's official description. In these
/// frames the floor is at z = kAxleHeight - R.
constexpr double kAxleHeight = -0.034;
inline double floor_height(const RobotParameters& robot) { return kAxleHeight - robot.R; }

enum class RollerJoints {
  kFixed,   ///< for the driver's joint states, which have no rollers; the spin of a plain roller cannot be seen
  kTurning  ///< continuous, with the sign of gamma and a dark stripe; needs the rollers' joint states
};

/// URDF of `robot`, drawn from the parameters of the simulation. Joints have the driver's names: base_footprint -
/// base_link, then for each wheel caster_joint_xx (about z, always 0) - wheel_joint_xx (about y, positive forward) -
/// roller_joint_xx_0 .. n-1. SI units; primitives only, no meshes.
///
/// Roller k of a wheel points straight down at the wheel angle k 2 pi / n. The x axis of its link is the roller's axis
/// e_i (paper, section 2). It is a stack of discs whose middle circles touch the cylinder of radius R around the axle
/// from inside.
///
/// The body has the mass m at (a_X, a_Y) in the plane of the axles and the share of I_s that the wheels leave it; each
/// wheel has m_1 and J_1, and rollers have no inertia, as in the paper. The planar model has no moments about the other
/// axes: they are those of a box and of a disc. If I_s leaves the body nothing, it has the inertia of a solid box.
///
/// Every robot that a scene may have can be drawn. Where rollers would end in a point before they meet their
/// neighbours, as those of no real wheel do, they are drawn up to that point.
std::string urdf(const RobotParameters& robot, RollerJoints rollers = RollerJoints::kFixed);

}  // namespace youbot_base_sim
