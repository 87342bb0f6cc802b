#pragma once

namespace youbot_base_sim {

/// The models of the paper. 2a and 2b differ in the friction law alone, see contact_law.h.
enum class Model {
  kNoSlip,   ///< 1: no slip
  kViscous,  ///< 2a: viscous friction
  kCoulomb   ///< 2b: Coulomb friction
};

}  // namespace youbot_base_sim
