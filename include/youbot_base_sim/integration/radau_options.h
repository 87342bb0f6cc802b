#pragma once

namespace youbot_base_sim {

/// The mechanisms of Radau and their numbers, for tests and studies: each can be switched off. docs/tuning.md says what
/// each is worth.
struct RadauOptions {
  // RadauNewton
  bool primal_dual = true;  ///< friction is an unknown of its own; else that of the slip
  int max_iterations = 25;
  double min_damping = 1.0 / 16;    ///< shortest part of a correction that is tried
  int free_corrections = 4;         ///< so many may grow; 0: damped from the first one on
  double free_growth = 4;           ///< by this factor; infinity: never damped
  bool reuses_matrix = true;        ///< for a correction that is likely to be the last one
  double friction_mismatch = 0.03;  ///< largest gap between F and the slip's friction at that, over f N
  bool gives_up = true;             ///< on a step whose error is too large after two iterations

  // RadauConvergence
  double convergence = 0.03;  ///< kappa
  double first_rate = 0.1;
  double curvature_memory = 0.8;  ///< 1: no quadratic convergence is expected
  double curvature_margin = 10;

  // RadauError
  double roller_scale = 3;
  bool second_filter = true;
  bool pose_estimate = true;

  // RadauPrediction
  bool predicts = true;           ///< else iterations begin at the start's velocities
  bool follows_friction = true;   ///< where contacts grip
  double gripping_share = 0.9;    ///< of f N
  bool line_after_switch = true;  ///< a step that began with a switch is extrapolated by its last two stages
  double far = 1.5;               ///< steps from which on the start of the last one is left out; infinity: never

  // Radau
  bool start_by_motion = true;         ///< forces at the start by the last stage's equation
  bool reuses_friction = true;         ///< after a jump of the torque or an event
  double dense_gripping_share = 0.98;  ///< as `gripping_share`; 0: slip within a step by its polynomial

  // StepSizeController
  bool trend = true;
  double safety = 0.8, max_shrinkage = 0.2, max_growth = 8;
};

}  // namespace youbot_base_sim
