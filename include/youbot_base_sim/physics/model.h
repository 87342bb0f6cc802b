#pragma once

#include <array>
#include <stdexcept>
#include <tuple>

#include "youbot_base_sim/physics/coulomb_law.h"
#include "youbot_base_sim/physics/viscous_law.h"

namespace youbot_base_sim {

/// The models of the paper. Those that slip differ in the friction law alone.
enum class Model {
  kNoSlip,   ///< 1: no slip
  kViscous,  ///< 2a: viscous friction
  kCoulomb   ///< 2b: Coulomb friction
};

/// A model that slips, and its friction law. A new law is a class like CoulombLaw and a row of SlipModels.
template <Model model, class FrictionLaw>
struct SlipModelRow {
  static constexpr Model kModel = model;
  using Law = FrictionLaw;
};
using SlipModels = std::tuple<SlipModelRow<Model::kViscous, ViscousLaw>, SlipModelRow<Model::kCoulomb, CoulombLaw>>;

/// Calls `visit` with the row of `model`. Throws std::logic_error for a model that does not slip.
template <class Visit, std::size_t row = 0>
auto visit_law(Model model, const Visit& visit) -> decltype(visit(std::get<0>(SlipModels()))) {
  if constexpr (row == std::tuple_size_v<SlipModels>) {
    throw std::logic_error("a model without slip has no friction law");
  } else {
    using Row = std::tuple_element_t<row, SlipModels>;
    return Row::kModel == model ? visit(Row()) : visit_law<Visit, row + 1>(model, visit);
  }
}

/// Whether the contacts slip, by a friction law; and whether the normal reactions limit that friction.
inline bool slips(Model model) { return model != Model::kNoSlip; }
inline bool limits_friction(Model model) {
  return slips(model) && visit_law(model, [](auto row) { return decltype(row)::Law::kScalesWithReaction; });
}

}  // namespace youbot_base_sim
