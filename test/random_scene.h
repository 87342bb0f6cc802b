#pragma once

#include <vector>

#include "physics/random_states.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// Lets the scene begin with random velocities of the platform and all wheels rolling, at random angles of up to `phi`.
inline void set_in_motion(Scene& scene, Random& random, double phi) {
  scene.initial.V_X() = random.uniform(-0.5, 0.5);
  scene.initial.V_Y() = random.uniform(-0.5, 0.5);
  scene.initial.Omega() = random.uniform(-1, 1);
  NoSlipModel(scene.robot).constrain(scene.initial);
  scene.initial.phi() = random.wheels(-phi, phi);
}

/// A random robot in motion under random torques of up to `max_torque` (N m), held from each of `starts` (s) to the
/// next: pieces as a scene has them.
inline Scene random_scene(Random& random, Model model, const std::vector<double>& starts, double max_torque) {
  Scene scene;
  scene.model = model;
  scene.robot = random_robot(random);
  scene.initial.values.col(0).head<3>() = random.wheels(-2, 2).head<3>();
  set_in_motion(scene, random, 3);
  TorqueSegments segments;
  for (const double start : starts) segments.push_back({start, random.wheels(-max_torque, max_torque)});
  scene.drive = segments;
  return scene;
}

}  // namespace youbot_base_sim
