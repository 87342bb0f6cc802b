#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "youbot_base_sim/integration/reaction_monitor.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/roller_switch.h"

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

/// The record that all steppers of one motion write to.
class MotionRecord {
 public:
  MotionRecord() { switches_.reserve(kRoom); }

  /// Wheel i, at angle phi (rad), came from roller `from` (unwrapped) to its present one at time t (s); nothing if they
  /// are the same. More than one roller makes one record with their count.
  void record_switch(const ContactModes& modes, int i, std::int64_t from, double t, double phi) {
    const std::int64_t to = modes.roller(i), count = std::abs(to - from);
    if (count == 0) return;
    statistics.switches += static_cast<std::uint64_t>(count);
    const int n = modes.rollers();
    switches_.push_back({t, i, wrapped(from, n), wrapped(to, n), phi, to > from ? +1 : -1, count});
    for (std::size_t k = switches_.size() - 1; k > 0 && switches_[k].t < switches_[k - 1].t; --k) {
      std::swap(switches_[k], switches_[k - 1]);
    }
  }

  /// Records the rollers that wheel i of state x, whose contact is averaged, has passed since the last record, as one.
  void record_passed_rollers(ContactModes& modes, int i, const State& x, double t) {
    const std::int64_t from = modes.roller(i);
    modes.track_roller(i, x);
    record_switch(modes, i, from, t, x.phi()[i]);
  }

  /// Continues the record of another integration.
  void begin_with(const IntegrationStatistics& before, const std::vector<RollerSwitch>& switches) {
    statistics = before;
    switches_.assign(switches.begin(), switches.end());
  }

  /// The switches since the last call, in order of time.
  std::vector<RollerSwitch> take_switches() {
    std::vector<RollerSwitch> taken(switches_);
    switches_.clear();  // which keeps its memory
    return taken;
  }

  IntegrationStatistics statistics;
  ReactionMonitor reactions;
  SlidingMode sliding_mode;  ///< which wheels chatter

 private:
  static constexpr std::size_t kRoom = 1024;  // for switches, before it allocates

  std::vector<RollerSwitch> switches_;
};

}  // namespace youbot_base_sim
