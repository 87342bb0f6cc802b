#pragma once

#include <memory>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A simulation whose wheels follow `motion` from its time 0 on, with the angles of the motion plus `offset` (rad). The
/// base starts at the origin, as if the wheels rolled, without the scene's loads and drive. If `compliant`, a spring and
/// a damper draw each wheel to its angle: measured angles contain the ripple of the rollers that touched the floor, and
/// simulated wheels on other rollers would slip if they followed it exactly.
std::unique_ptr<Simulation> follow_wheel_angles(Scene scene, const std::shared_ptr<const WheelMotion>& motion,
                                                const Wheels& offset, bool compliant);

}  // namespace youbot_base_sim
