#pragma once

#include <atomic>
#include <string>

#include "youbot_base_sim/physics/reactions.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// What would have kept the base of a scene on the floor that ended as `end` says: a lighter load, or a lower centre of
/// mass where it carries none; found by running the scene with others, to its end or a minute further. In words; empty
/// if nothing of the kind would, or once `stop` is set.
std::string what_would_hold(const Scene& scene, const TippedOver& end, const std::atomic<bool>& stop);

}  // namespace youbot_base_sim
