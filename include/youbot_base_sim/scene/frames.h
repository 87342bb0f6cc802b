#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Height of the wheels' axles in base_link and base_footprint, m, as in the youBot's official description. In these
/// frames the floor is at z = kAxleHeight - R.
constexpr double kAxleHeight = -0.034;
inline double floor_height(const RobotParameters& robot) { return kAxleHeight - robot.R; }

/// The frame of wheel i at the wheel's angle phi (rad), in base_footprint.
inline Eigen::Isometry3d wheel_pose(const RobotParameters& robot, int i, double phi) {
  return Eigen::Translation3d(robot.rho_X()[i], robot.rho_Y()[i], kAxleHeight) *
         Eigen::AngleAxisd(phi, Eigen::Vector3d::UnitY());
}

/// The frame of roller k of wheel i in that of the wheel, at the roller's angle 0 about its own axis, x.
inline Eigen::Isometry3d roller_pose(const RobotParameters& robot, int i, int k) {
  return Eigen::AngleAxisd(-k * 2 * M_PI / robot.rollers, Eigen::Vector3d::UnitY()) *
         Eigen::Translation3d(0, 0, -robot.R_d) *
         Eigen::AngleAxisd(std::atan(robot.tan_delta()[i]), Eigen::Vector3d::UnitZ());
}

}  // namespace youbot_base_sim
