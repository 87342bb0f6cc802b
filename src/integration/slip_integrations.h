#pragma once

#include <memory>

#include "method_table.h"
#include "youbot_base_sim/integration/integration.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/contact_law.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

template <class Law>
struct Beyond;

/// What an integration is made of; `step` is that of a method without step size control, s.
struct Parts {
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const Tolerance& tolerance;
  double step;
};

/// Integrates the motion under this friction law by a method of the table. Each law has a file of its own, which takes
/// long to compile.
template <class Law>
std::unique_ptr<Integration> integrate(const Parts& parts, MakeGeneralMethod make_method);

extern template std::unique_ptr<Integration> integrate<ViscousLaw>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<CoulombLaw>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<Beyond<ViscousLaw>>(const Parts&, MakeGeneralMethod);
extern template std::unique_ptr<Integration> integrate<Beyond<CoulombLaw>>(const Parts&, MakeGeneralMethod);

}  // namespace youbot_base_sim
