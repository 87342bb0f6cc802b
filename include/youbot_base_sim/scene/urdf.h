#pragma once

#include <string>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Height of the wheels' axles in base_link and base_footprint, m, as in the youBot's official description. The floor
/// therefore lies at z = kAxleHeight - R in these frames.
constexpr double kAxleHeight = -0.034;

enum class RollerJoints {
  kFixed,   ///< needs no joint states of rollers, which the driver does not have; their spin cannot be seen anyway
  kTurning  ///< continuous, positive as gamma is; needs the rollers' joint states; they have a dark stripe
};

/// URDF of `robot`, drawn from the parameters that are simulated, with the driver's names: base_footprint - base_link
/// and for each wheel caster_joint_xx (about z, always 0) - wheel_joint_xx (about y; positive drives forward) -
/// roller_joint_xx_0 .. n-1. Metres, radians, kilograms; primitives only, no meshes.
///
/// Roller k of a wheel stands straight down at the wheel angle k 2 pi / n, and its link's x axis is the roller's axis
/// e_i (paper, section 2). It is a stack of discs whose middle circles touch the cylinder of radius R around the axle
/// from within.
///
/// Inertia: the body has m at (a_X, a_Y) in the plane of the axles and the part of I_s that the wheels leave, each
/// wheel m_1 and J_1; moments about other axes, which the planar model does not know, are a box's and a disc's. Rollers
/// have none, as in the paper. Where I_s leaves the body nothing it has the inertia of a homogeneous box.
///
/// Never fails for parameters that a scene may have. Where no real wheel has them (so few rollers that they end in a
/// point before they meet) the rollers are drawn up to the point.
std::string urdf(const RobotParameters& robot, RollerJoints rollers = RollerJoints::kFixed);

}  // namespace youbot_base_sim
