#pragma once

namespace youbot_base_sim {

/// Radau's mechanisms and numbers; docs/tuning says what each is worth. Infinity switches friction_mismatch,
/// matrix_mismatch, curvature_margin, unseen_energy, pose_time, far and switch_transient off.
struct RadauOptions {
  // RadauNewton
  bool primal_dual = true;  ///< friction is an unknown of its own; else that of the slip
  int max_iterations = 10;
  bool reuses_matrix = true;
  double friction_mismatch = 0.03;  ///< gap between the friction of F and V up to which a matrix is reused, in f N
  double matrix_mismatch = 0.2;     ///< the same where it was made
  // RadauConvergence
  double convergence = 0.03;  ///< kappa
  double first_rate = 0.03;
  double curvature_memory = 0.8;
  double curvature_margin = 10;
  // RadauError
  double roller_scale = 3;
  double unseen_energy = 0.01;  ///< of the tolerance; -1: never filtered twice
  double pose_time = 4e-3;      ///< s
  // RadauPrediction
  bool predicts = true;  ///< else from the start
  bool line_after_switch = true;
  double far = 1.5;
  double switch_transient = 1e-4;  ///< s
  double gripping_share = 0.9;     ///< 0: friction never leads
  // Radau
  bool start_by_motion = true;
  double dense_gripping_share = 0.98;  ///< 0: off
  // StepSizeController
  bool trend = true;
  double safety = 0.8, max_shrinkage = 0.2, max_growth = 8;
};

// Constants, but for studies/bench, which compiles Radau with variables in their place.
#ifdef YOUBOT_BASE_SIM_RADAU_VARIES
inline RadauOptions radau_options;
#else
inline constexpr RadauOptions radau_options;
#endif

}  // namespace youbot_base_sim
