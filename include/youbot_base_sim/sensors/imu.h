#pragma once

#include <Eigen/Dense>
#include <limits>
#include <random>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// Errors of a sensor: noise of each reading, white noise by density (larger the shorter a reading), a bias that walks.
struct SensorErrors {
  double noise = 0;    ///< in units of the reading
  double density = 0;  ///< those over sqrt(Hz)
  double bias = 0;     ///< at the start
  double walk = 0;     ///< of the bias: its units over sqrt(s)

  /// Variance of a reading that averages `interval` (s), without its bias.
  double noise_variance(double interval) const { return noise * noise + density * density / interval; }
  /// Variance of the bias `t` (s) after the start.
  double bias_variance(double t) const { return bias * bias + walk * walk * t; }
};

/// An inertial measurement unit, by default about a small MEMS unit in the middle of the base.
struct ImuSettings {
  SensorErrors rate{2e-3, 0, 1e-3, 0};          ///< rad/s
  SensorErrors acceleration{0.02, 0, 0.02, 0};  ///< m/s^2, along each axis
  Eigen::Vector3d position{0, 0, 0};            ///< in base_link, m; its height has no effect
};

/// An inertial measurement unit with the axes of base_link. It reads means over the time between two readings, as
/// units that integrate do: so the kicks of roller switches, which are too short to be met by samples, count in full.
class Imu {
 public:
  /// Starts at time t (s) with heading zero.
  Imu(const ImuSettings& settings, const FloorParameters& floor, double t, const State& state);

  /// Advances to a reading at time t (s).
  void update(double t, const State& state);

  /// The base was put from one state to another: the unit reads only what it does before and after.
  void carry(const State& before, const State& after);

  const Eigen::Vector3d& position() const { return settings_.position; }  ///< in base_link, m

  double rate() const { return rate_; }                              ///< about z, rad/s
  const Eigen::Vector3d& acceleration() const { return specific_; }  ///< specific force, m/s^2: +g upwards at rest
  double heading() const { return heading_; }                        ///< integrated from the readings of the rate, rad

  double rate_variance() const { return variance(settings_.rate); }                  ///< rad^2/s^2
  double acceleration_variance() const { return variance(settings_.acceleration); }  ///< m^2/s^4
  double heading_variance() const;                                                   ///< rad^2

 private:
  double variance(const SensorErrors& errors) const;

  ImuSettings settings_;
  Eigen::Vector3d upwards_;  // g, in the scene's frame, m/s^2
  double start_, t_;         // s
  double psi_;
  Eigen::Vector2d velocity_;  // in the scene's frame, m/s
  Wheels biases_;             // of the rate, rad/s, and of the acceleration's components, m/s^2
  double interval_ = std::numeric_limits<double>::infinity();  // of the last reading, s
  double rate_ = 0, heading_ = 0;
  double noise_variance_ = 0;  // of the heading, by the rate's noise, rad^2
  Eigen::Vector3d specific_ = Eigen::Vector3d::Zero();
  std::mt19937_64 random_;  // has a fixed seed, so that every run draws the same noise
};

}  // namespace youbot_base_sim
