#pragma once

#include <Eigen/Dense>
#include <random>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Noise (standard deviation of a reading) and biases of an inertial measurement unit, about a small MEMS unit's.
struct ImuSettings {
  double rate_noise = 2e-3;          ///< rad/s
  double rate_bias = 1e-3;           ///< rad/s
  double acceleration_noise = 0.02;  ///< m/s^2
  double acceleration_bias = 0.02;   ///< m/s^2, along each axis
};

/// An inertial measurement unit at the origin of base_footprint. It reads means over the time between two readings, as
/// units that integrate do: so the kicks of roller switches, which are too short to be met by samples, count in full.
class Imu {
 public:
  /// Starts at time t (s) with heading zero.
  Imu(const ImuSettings& settings, const FloorParameters& floor, double t, const State& state);

  /// Advances to a reading at time t (s).
  void update(double t, const State& state);

  double rate() const { return rate_; }                              ///< about z, rad/s
  const Eigen::Vector3d& acceleration() const { return specific_; }  ///< specific force, m/s^2: +g upwards at rest
  double heading() const { return heading_; }                        ///< integrated from the readings of the rate, rad

  double rate_variance() const;          ///< rad^2/s^2
  double acceleration_variance() const;  ///< m^2/s^4
  double heading_variance() const;       ///< rad^2

 private:
  ImuSettings settings_;
  Eigen::Vector3d upwards_;  // g, in the scene's frame, m/s^2
  double start_, t_;         // s
  double psi_;
  Eigen::Vector2d velocity_;  // in the scene's frame, m/s
  double rate_ = 0, heading_ = 0;
  double walked_variance_ = 0;  // of the heading, by the rate's noise, rad^2
  Eigen::Vector3d specific_ = Eigen::Vector3d::Zero();
  std::mt19937_64 random_;  // has a fixed seed, so that every run draws the same noise
};

}  // namespace youbot_base_sim
