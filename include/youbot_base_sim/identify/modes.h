#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

constexpr int kModes = 3;
constexpr std::array<const char*, kModes> kModeNames = {"ahead", "sideways", "turning"};

/// The parts of four wheels' rates or torques that drive the base forward, laterally and in yaw: means with the signs
/// that each wheel has in that motion. What is left, wheels that work against each other, depends on where every roller
/// happened to stand, and is not looked at.
inline Eigen::Vector3d modes(const Wheels& w) {
  return Eigen::Vector3d{w[0] + w[1] + w[2] + w[3], -w[0] + w[1] + w[2] - w[3], -w[0] + w[1] - w[2] + w[3]} / 4;
}

/// The wheels' part in each mode.
inline Wheels wheels_of(const Eigen::Vector3d& m) {
  return {m[0] - m[1] - m[2], m[0] + m[1] + m[2], m[0] + m[1] - m[2], m[0] - m[1] + m[2]};
}

/// Low-pass filter of first order for samples at times t (s). At those that are `left_out` it stays as it was.
template <class Value>
std::vector<Value> low_pass(const std::vector<double>& t, const std::vector<Value>& samples, double time_constant,
                            const std::vector<bool>& left_out = {}) {
  std::vector<Value> filtered(samples);
  for (std::size_t k = 1; k < samples.size(); ++k) {
    if (!left_out.empty() && left_out[k]) {
      filtered[k] = filtered[k - 1];
      continue;
    }
    const double keep = std::exp(-(t[k] - t[k - 1]) / time_constant);
    filtered[k] = keep * filtered[k - 1] + (1 - keep) * samples[k];
  }
  return filtered;
}

}  // namespace youbot_base_sim
