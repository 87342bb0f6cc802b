#include "youbot_base_sim/physics/parameters.h"

namespace youbot_base_sim {

namespace {

/// 0 for u <= 0, 1 for u >= 1, with two continuous derivatives.
Wheels smooth_step(const Wheels& u) {
  const Wheels s = u.max(0).min(1);
  return s.cube() * (10 - 15 * s + 6 * s.square());
}

/// Share of a patch at each point.
Wheels share(const FloorPatch& patch, const Wheels& X, const Wheels& Y) {
  const double w = patch.edge;
  return smooth_step((X - patch.x0) / w + 0.5) * smooth_step((patch.x1 - X) / w + 0.5) *
         smooth_step((Y - patch.y0) / w + 0.5) * smooth_step((patch.y1 - Y) / w + 0.5);
}

}  // namespace

Wheels FloorParameters::friction_at(const Wheels& X, const Wheels& Y) const {
  Wheels at = f;
  for (const FloorPatch& patch : patches) at += (patch.friction - at) * share(patch, X, Y);
  return at;
}

double FloorParameters::max_distance(const Wheels& X, const Wheels& Y) const {
  double distance = kInfinity;
  for (const FloorPatch& patch : patches) {
    // Distance from the rectangle's outline, from outside or inside.
    const Wheels out_X = (patch.x0 - X).max(X - patch.x1), out_Y = (patch.y0 - Y).max(Y - patch.y1);
    const Wheels outside = (out_X.max(0).square() + out_Y.max(0).square()).sqrt(), inside = -out_X.max(out_Y).min(0);
    distance = std::min(distance, (outside + inside - patch.edge).max(0).minCoeff() + 0.5 * patch.edge);
  }
  return distance;
}

}  // namespace youbot_base_sim
