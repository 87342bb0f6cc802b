#pragma once

#include "youbot_base_sim/physics/contact_friction.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Model 2a: F = -mu_0 V_P (paper, (4.10)).
class ViscousLaw {
 public:
  /// mu_0 follows from the mass of the robot without loads.
  ViscousLaw(const RobotParameters& robot, const FloorParameters& floor) : mu_0_(floor.mu_0(robot)) {}

  static constexpr bool kLimited = false;

  SlipResistance at(const Wheels&, double, const Wheels&) const { return {mu_0_, Wheels::Zero(), Wheels::Ones()}; }

  Wheels largest(const Wheels&) const { return Wheels::Constant(kInfinity); }

 private:
  alignas(kAlignment) Wheels mu_0_;  // N s/m
};

}  // namespace youbot_base_sim
