#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "youbot_base_sim/integration/reaction_monitor.h"
#include "youbot_base_sim/integration/sliding_mode.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

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
