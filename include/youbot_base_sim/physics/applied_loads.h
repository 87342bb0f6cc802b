#pragma once

#include <Eigen/Dense>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

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
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< of action, from O at the height of the axles, m: platform
  double torque = 0;                                ///< about OZ, N m
  bool fixed = false;                               ///< true if the force keeps its direction in the fixed frame

  bool operator==(const Wrench& other) const {
    return force == other.force && point == other.point && torque == other.torque && fixed == other.fixed;
  }
};

/// The loads on the base and the wrenches that act on it.
struct AppliedLoads {
  std::vector<Load> loads;
  std::vector<Wrench> wrenches;
};

/// The robot with these loads: mass, centre of mass and moment of inertia about OZ are those of both together.
RobotParameters loaded(const RobotParameters& robot, const std::vector<Load>& loads);

/// Gravity along a sloping floor and wrenches, in the platform's frame, N and N m.
struct ExternalForce {
  Wheels v = Wheels::Zero();  ///< on (V_X, V_Y, Omega, 0)
  double down = 0;            ///< -W_Z: how much more presses on the floor
  double pitch = 0;           ///< p_Z W_X - p_X W_Z, the moment of the wrenches that loads the front wheels
  double roll = 0;            ///< p_Z W_Y - p_Y W_Z, the moment that loads the left ones
  double g_X = 0, g_Y = 0;    ///< gravity along the floor, m/s^2
};

/// Gravity and wrenches as a function of the heading alone. `robot` is the loaded one.
class ExternalForces {
 public:
  ExternalForces(const RobotParameters& robot, const FloorParameters& floor, const std::vector<Wrench>& wrenches);

  /// The forces at the heading with this cosine and sine.
  ExternalForce at(double cosine, double sine) const { return by_heading_ ? sum(cosine, sine) : steady_; }

  /// True if they depend on the heading.
  bool by_heading() const { return by_heading_; }

  /// Gravity that presses on the floor, g cos(slope), m/s^2.
  double normal_gravity() const { return normal_; }

 private:
  ExternalForce sum(double cosine, double sine) const;

  double m_s_, m_a_X_, m_a_Y_;
  double along_x_, along_y_;  // gravity along the floor, in the fixed frame, m/s^2
  double normal_;
  ExternalForce steady_;       // of wrenches whose direction is fixed to the platform
  std::vector<Wrench> fixed_;  // the others
  bool by_heading_;
};

}  // namespace youbot_base_sim
