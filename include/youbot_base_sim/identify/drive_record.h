#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "youbot_base_sim/drive/torque_profiles.h"

namespace youbot_base_sim {

/// One drive as a bag records it: wheel readings of the motors, commanded wheel rates, and the true pose where it was
/// measured. Times in s from the first sample; wheels positive forward on all four.
struct DriveRecord {
  std::string name;  ///< of the bag, for messages

  std::vector<double> t;       ///< increasing
  std::vector<Wheels> phi;     ///< rad
  std::vector<Wheels> dphi;    ///< rad/s
  std::vector<Wheels> torque;  ///< N m; empty: the bag has no effort

  WheelTable commands;  ///< rates, rad/s, as they arrived; each holds until the next

  std::vector<double> truth_t;            ///< increasing; empty: not measured
  std::vector<Eigen::Vector3d> truth;     ///< x, y (m), heading (rad, unwrapped) in a fixed frame
  std::vector<Eigen::Vector2d> excluded;  ///< begin and end of stretches that are not fitted: gaps, pushes

  bool has_torque() const { return !torque.empty(); }
  bool has_truth() const { return !truth.empty(); }
  double duration() const { return t.empty() ? 0 : t.back(); }

  /// Whether an excluded stretch covers `time`.
  bool is_excluded(double time) const {
    for (const Eigen::Vector2d& s : excluded) {
      if (time >= s[0] && time <= s[1]) return true;
    }
    return false;
  }
};

}  // namespace youbot_base_sim
