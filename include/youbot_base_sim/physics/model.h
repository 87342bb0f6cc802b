#pragma once

#include <stdexcept>

#include "youbot_base_sim/physics/coulomb_law.h"
#include "youbot_base_sim/physics/viscous_law.h"

namespace youbot_base_sim {

/// The models of the paper. Those that slip differ in the friction law alone.
enum class Model {
  kNoSlip,   ///< 1: no slip
  kViscous,  ///< 2a: viscous friction
  kCoulomb   ///< 2b: Coulomb friction
};

/// Stands for a friction law, a class like CoulombLaw.
template <class FrictionLaw>
struct LawOf {
  using Law = FrictionLaw;
};

/// Calls `visit` with the LawOf `model`. Throws std::logic_error for a model that does not slip.
template <class Visit>
auto visit_law(Model model, const Visit& visit) {
  switch (model) {
    case Model::kViscous:
      return visit(LawOf<ViscousLaw>());
    case Model::kCoulomb:
      return visit(LawOf<CoulombLaw>());
    case Model::kNoSlip:
      break;
  }
  throw std::logic_error("a model without slip has no friction law");
}

/// True if the contacts slip; true if the normal reactions limit their friction.
inline bool slips(Model model) { return model != Model::kNoSlip; }
inline bool limits_friction(Model model) {
  return slips(model) && visit_law(model, [](auto law) { return decltype(law)::Law::kLimited; });
}

}  // namespace youbot_base_sim
