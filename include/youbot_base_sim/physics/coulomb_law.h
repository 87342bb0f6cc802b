#pragma once

#include "youbot_base_sim/physics/contact_friction.h"
#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

/// Model 2b: F = -f N V_P / sqrt(nu^2 + |V_P|^2), Coulomb friction (4.11) regularised as in section 5.2 of the paper.
class CoulombLaw {
 public:
  CoulombLaw(const RobotParameters&, const FloorParameters&) {}

  /// True if friction is limited by the normal reaction N.
  static constexpr bool kLimited = true;

  /// The resistance to slip where nu^2 + |V_P|^2 is `speed_squared` (m^2/s^2) and f N is `limit` (N).
  SlipResistance at(const Wheels& speed_squared, double nu_squared, const Wheels& limit) const {
    const Wheels inverse_speed = speed_squared.sqrt().inverse();
    return {limit * inverse_speed, inverse_speed, nu_squared * inverse_speed.square()};
  }

  /// The largest friction where f N is `limit`, N.
  Wheels largest(const Wheels& limit) const { return limit; }
};

}  // namespace youbot_base_sim
