#pragma once

#include <memory>

#include "youbot_base_sim/integration/methods.h"

namespace youbot_base_sim {

class PaperFeatures;
class ExtendedFeatures;

/// The parts of an integration.
struct Parts {
  const RobotParameters& robot;
  const FloorParameters& floor;
  const State& start;
  const TorqueProfile& torque;
  const Tolerance& tolerance;
  const Method& method;
  bool keeps_up;
  const MotionSoFar* before;  // null: the motion begins
};

/// Makes the integrator of a model that slips with PaperFeatures or ExtendedFeatures. Each has a file of its own,
/// because it takes long to compile.
template <class Features>
std::unique_ptr<MotionIntegrator> make_slip_integrator(Model model, const Parts& parts);

}  // namespace youbot_base_sim
