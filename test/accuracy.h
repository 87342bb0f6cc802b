#pragma once

#include <cmath>
#include <memory>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The scene by a relative tolerance, and an absolute one of a thousandth of it.
inline Scene at_tolerance(Scene scene, double tolerance) {
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  return scene;
}

/// A simulation of the scene at this tolerance, at the scene's end.
inline std::unique_ptr<Simulation> run(const Scene& scene, double tolerance) {
  auto simulation = std::make_unique<Simulation>(at_tolerance(scene, tolerance));
  simulation->advance_to(scene.duration);
  return simulation;
}

/// How far a pose (m, rad) is from another one, at the wheels' centres, m.
inline double distance(const State& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.y() - b.y(), 0.28 * (a.psi() - b.z()));
}
inline double distance(const State& a, const State& b) { return distance(a, {b.x(), b.y(), b.psi()}); }

}  // namespace youbot_base_sim
