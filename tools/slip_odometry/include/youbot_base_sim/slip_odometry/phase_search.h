#pragma once

#include <array>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Finds which rollers touch the floor by the ripple of the drives' torques: nine candidates try three phases of each
/// wheel. Every pair of phases of two wheels occurs once (Taguchi's array L9), so that means over three candidates
/// show what one wheel's phase does. Steps begin at a third of a roller and are halved twice.
class PhaseSearch {
 public:
  static constexpr int kCandidates = 9;
  using Torques = std::array<Wheels, kCandidates>;

  /// For wheels with `rollers` rollers.
  explicit PhaseSearch(int rollers);

  /// The angles that candidate k adds to those of the wheels, rad; once they are found, what all add.
  Wheels phases(int k) const;

  /// Takes drive torques (N m), measured and expected by each candidate, of the last dt (s). True if phases change.
  bool update(const Wheels& measured, const Torques& expected, double dt);

  bool found() const { return step_ == 0; }

  /// One standard deviation of the phases, rad: by the scatter over seconds, and by step.
  const Wheels& sigma() const { return sigma_; }

 private:
  bool finish_step();

  double pitch_, step_;  // rad
  Wheels center_, sigma_;
  double time_ = 0, size_ = 0;                             // s; mean of torques over it, N m
  double second_ = 0;                                      // s, of the present one
  std::array<double, kCandidates> misfit_{};               // in it
  std::vector<Eigen::Array<double, 2, kWheels>> seconds_;  // sine and cosine parts of the misfits of each
};

}  // namespace youbot_base_sim
