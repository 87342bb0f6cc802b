#pragma once

#include <memory>

#include "method_table.h"
#include "youbot_base_sim/integration/integration.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// What an integration is made of; `step` is that of a method without step size control, s.
struct Parts {
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const Tolerance& tolerance;
  double step;
  const MotionSoFar* before;  // null: the motion begins
};

/// Integrates the motion of this SlipModel by a method of the table. Each has a file of its own, which takes
/// long to compile.
template <class Model>
std::unique_ptr<Integration> integrate(const Parts& parts, MakeGeneralMethod make_method);

extern template std::unique_ptr<Integration> integrate<PaperModel<ViscousLaw>>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<PaperModel<CoulombLaw>>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<ExtendedModel<ViscousLaw>>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<ExtendedModel<CoulombLaw>>(const Parts&, MakeGeneralMethod);

}  // namespace youbot_base_sim
