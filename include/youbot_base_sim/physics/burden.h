#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// A body that the base carries, fixed to the platform.
struct Load {
  double mass = 0;                                     ///< kg
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< of its centre of mass from O at the height of the axles, m
  double inertia = 0;                                  ///< about its own vertical axis, kg m^2

  bool operator==(const Load& other) const {
    return mass == other.mass && position == other.position && inertia == other.inertia;
  }
};

/// A force and a torque that act on the base from outside.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< W, N; (W_X, W_Y) in the platform's frame, or in the fixed one
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< where it acts, from O at the height of the axles, m: platform
  double torque = 0;                                ///< about OZ, N m
  bool fixed = false;                               ///< whether the force keeps its direction in the fixed frame
};

/// What the base carries and what pushes it now.
struct Burden {
  std::vector<Load> loads;
  std::vector<Wrench> wrenches;
};

/// The robot with these loads: mass, centre of mass and moment of inertia about OZ are those of both together.
RobotParameters loaded(const RobotParameters& robot, const std::vector<Load>& loads);

/// What acts on the platform besides wheels and inertia: gravity along a sloping floor, and wrenches. Platform's frame,
/// N and N m.
struct ExternalForce {
  Wheels v = Wheels::Zero();  ///< on (V_X, V_Y, Omega, 0)
  double down = 0;            ///< -W_Z: how much more presses on the floor
  double pitch = 0;           ///< p_Z W_X - p_X W_Z, the moment of the wrenches that loads the front wheels
  double roll = 0;            ///< p_Z W_Y - p_Y W_Z, likewise the left ones
  double g_X = 0, g_Y = 0;    ///< gravity along the floor, m/s^2
};

/// Gravity and wrenches as a function of the heading alone. `robot` is the loaded one.
class ExternalForces {
 public:
  ExternalForces(const RobotParameters& robot, const FloorParameters& floor, const std::vector<Wrench>& wrenches)
      : m_s_(robot.m_s()),
        m_a_X_(robot.m * robot.a_X),
        m_a_Y_(robot.m * robot.a_Y),
        along_(floor.g * std::sin(floor.slope)),
        normal_(floor.slope == 0 ? floor.g : floor.g * std::cos(floor.slope)),
        uphill_(floor.uphill),
        wrenches_(wrenches) {}

  /// At heading psi, rad.
  ExternalForce at(double psi) const { return any() ? sum(psi) : ExternalForce(); }
  bool any() const { return along_ != 0 || !wrenches_.empty(); }

  /// Gravity that presses on the floor, g cos(alpha), m/s^2.
  double normal_gravity() const { return normal_; }

 private:
  ExternalForce sum(double psi) const;

  double m_s_, m_a_X_, m_a_Y_, along_, normal_, uphill_;
  std::vector<Wrench> wrenches_;
};

}  // namespace youbot_base_sim
