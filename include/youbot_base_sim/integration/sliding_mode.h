#pragma once

#include <array>
#include <cmath>

#include "youbot_base_sim/integration/contact_system.h"

namespace youbot_base_sim {

/// Decides when a wheel that chatters on an edge, as both rollers drive it back, enters sliding mode: it may after
/// kMinChatter reversals within kWindow of one another, if its momentum no longer counts, and must after kMaxChatter.
/// Most chatter dies down within a hundred reversals; what a wheel loses that must rest is in inverse proportion to
/// kMaxChatter, and the work is in proportion. Where the budget of work is short a wheel is held after kEarlyChatter.
class SlidingMode {
 public:
  static constexpr double kHop = 1e-13;  ///< rad: some hundred times what phi of one turn is rounded to

  /// Whether wheel i, which crosses its edge at time t (s) in `direction` and state x, comes back from a hop of less
  /// than kHop, where the edge does not attract it: it stands on that edge.
  bool stands(const ContactSystem& system, const State& x, double t, int i, int direction) {
    const bool hops = direction == -last_direction_[i] && std::abs(x.dphi()[i]) * (t - last_crossing_[i]) < kHop;
    if (!hops || system.sharing(i, x, t).attractive) return false;
    last_direction_[i] = direction;
    last_crossing_[i] = t;
    return true;
  }

  /// Wheel i crosses its edge at time t (s) in `direction`; x is its state there and `max_momentum` (m/s) a speed of
  /// the platform that does not count. True if it enters sliding mode instead.
  bool enters(const ContactSystem& system, const State& x, double t, int i, int direction, double max_momentum) {
    if (direction != -last_direction_[i] || t > last_crossing_[i] + kWindow) reversals_[i] = 0;
    last_direction_[i] = direction;
    last_crossing_[i] = t;
    if (++reversals_[i] <= (holds_early_ ? kEarlyChatter : kMinChatter)) return false;
    if (!system.sharing(i, x, t).attractive) return false;
    return holds_early_ || reversals_[i] > kMaxChatter || system.momentum(i, x) < max_momentum;
  }

  /// Whether wheels are held early, to save work.
  bool holds_early() const { return holds_early_; }
  void hold_early(bool early) { holds_early_ = early; }

  /// Wheel i has left sliding mode.
  void left(int i) { reversals_[i] = 0; }

 private:
  static constexpr int kEarlyChatter = 1, kMinChatter = 8, kMaxChatter = 128;
  static constexpr double kWindow = 1e-3;  // s

  std::array<int, kWheels> last_direction_{}, reversals_{};
  std::array<double, kWheels> last_crossing_{};
  bool holds_early_ = false;
};

}  // namespace youbot_base_sim
