#pragma once

#include <memory>

#include "method_table.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/model.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// The parts of an integration; `step` applies to methods without step size control, s.
struct Parts {
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const Tolerance& tolerance;
  double step;
  const MotionSoFar* before;  // null: the motion begins
};

/// Makes the integrator of a model that slips, for a method of the table: with the paper's features, or with all of
/// them. Each has a file of its own, because it takes long to compile.
std::unique_ptr<MotionIntegrator> make_paper_integrator(Model model, const Parts& parts, MakeGeneralMethod make_method);
std::unique_ptr<MotionIntegrator> make_extended_integrator(Model model, const Parts& parts,
                                                           MakeGeneralMethod make_method);

}  // namespace youbot_base_sim
