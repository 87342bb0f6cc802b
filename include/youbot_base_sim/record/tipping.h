#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "youbot_base_sim/physics/reactions.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// What would have kept the base of a scene on the floor that ended as `end` says: a lighter load, or a lower centre of
/// mass where it carries none, or else less of what pushes it; found by running the scene with others, to its end or a
/// minute further. The search is given up, and says so, once it has taken this many evaluations of the right-hand side.
/// In words; empty if nothing of the kind would, or once `stop` is set.
std::string what_would_hold(const Scene& scene, const TippedOver& end, std::uint64_t max_evaluations,
                            const std::atomic<bool>& stop);

}  // namespace youbot_base_sim
