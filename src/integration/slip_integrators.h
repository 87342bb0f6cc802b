#pragma once

#include <memory>

#include "method_table.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/parameters.h"
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

/// Integrates the motion of a model that slips by a method of the table, with the paper's features or with all of them.
/// Each stands in a file of its own, which takes long to compile.
std::unique_ptr<MotionIntegrator> make_paper_integrator(Model model, const Parts& parts, MakeGeneralMethod make_method);
std::unique_ptr<MotionIntegrator> make_extended_integrator(Model model, const Parts& parts,
                                                           MakeGeneralMethod make_method);

}  // namespace youbot_base_sim
