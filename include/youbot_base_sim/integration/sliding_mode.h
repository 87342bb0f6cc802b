#pragma once

#include <array>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// Which wheels chatter on an edge: they come back to it from hops of less than kLongestHop. A wheel that chatters on
/// an edge which attracts it enters sliding mode, once the error of that no longer counts or where work is to be saved.
class SlidingMode {
 public:
  static constexpr double kLongestHop = 1e-3;  ///< s
  static constexpr double kHop = 1e-13;        ///< rad: some hundred times what phi is rounded to

  /// Wheel i crosses its edge at time t (s) in `direction`. Returns the time since its last crossing (s) if that was
  /// in the other direction; else infinity.
  double hop(int i, double t, int direction) {
    const double hop = direction == -last_direction_[i] ? t - last_crossing_[i] : kInfinity;
    last_direction_[i] = direction;
    last_crossing_[i] = t;
    return hop;
  }

  /// True if wheels are held early, to save work.
  bool holds_early() const { return holds_early_; }
  void hold_early(bool early) { holds_early_ = early; }

 private:
  std::array<int, kWheels> last_direction_{};
  std::array<double, kWheels> last_crossing_{};
  bool holds_early_ = false;
};

}  // namespace youbot_base_sim
