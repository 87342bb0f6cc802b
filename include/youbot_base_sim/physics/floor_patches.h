#pragma once

#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Friction of a floor with patches.
class FloorPatches {
 public:
  explicit FloorPatches(const FloorParameters& floor) : f_(floor.f), patches_(floor.patches) {}

  bool any() const { return !patches_.empty(); }

  /// Coefficient of friction at the contact points (X, Y) in the fixed frame, m; smooth over the edges of patches.
  Wheels friction(const Wheels& X, const Wheels& Y) const;

  /// Distance (m) that contact points at (X, Y) may move in a step without jumping over a soft edge.
  double max_distance(const Wheels& X, const Wheels& Y) const;

 private:
  Wheels f_;
  std::vector<FloorPatch> patches_;
};

}  // namespace youbot_base_sim
