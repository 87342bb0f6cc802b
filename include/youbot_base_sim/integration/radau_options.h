#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The mechanisms and numbers of Radau, for tests and studies: each mechanism can be switched off. docs/tuning.md says
/// what each is worth. A number that is infinite (or 0, where that is said) switches its mechanism off.
struct RadauOptions {
  // RadauNewton
  bool primal_dual = true;  ///< friction is an unknown of its own; else that of the slip
  int max_iterations = 25;
  double min_damping = 1.0 / 16;  ///< shortest part of a correction
  int free_corrections = 4;       ///< may grow
  double free_growth = 4;         ///< by this
  bool reuses_matrix = true;
  /// Largest gap between the friction of F and V, in f N, at which a matrix is reused.
  double friction_mismatch = 0.03;
  double early_estimate_correction = 3000;  ///< first correction from which on the error is estimated at once
  double early_reject_error = 1.5;          ///< error of a step that is given up

  // RadauConvergence
  double convergence = 0.03;  ///< kappa
  double first_rate = 0.1, min_rate = 0.03, max_rate = 0.5;
  double first_curvature = 1, curvature_memory = 0.8;
  double curvature_margin = 10;
  double predictable_fraction = 0.1;  ///< of nu

  // RadauError
  double roller_scale = 3;
  double rim_scale = 0.1;  ///< 0: off
  double transient_stiffness_ratio = 4;
  bool weakest_damping = true;
  bool second_filter = true;
  double unseen_energy = 0.01;  ///< of the tolerance
  bool pose_estimate = true;
  double pose_share = 30;
  bool pose_in_full = true;

  // RadauPrediction
  bool predicts = true;  ///< else from the start
  bool follows_friction = true;
  bool line_after_switch = true;
  double far = 1.5;
  double small_error = 1e-3;       ///< of nu
  double switch_transient = 1e-4;  ///< s
  double gripping_share = 0.9;

  // Radau
  bool start_by_motion = true;
  bool reuses_friction = true;
  bool dense_friction = true;
  double dense_gripping_share = 0.98;
  double failure_shrinkage = 0.3;
  bool trend = true;  ///< of StepSizeController
  double safety = 0.8, max_shrinkage = 0.2, max_growth = 8;
};

}  // namespace youbot_base_sim
