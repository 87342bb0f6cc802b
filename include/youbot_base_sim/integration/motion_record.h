#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/reactions.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// Wheels that chatter on an edge: they come back to it from hops of less than kLongestHop. A wheel that chatters on
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

  bool holds_early = false;  ///< wheels are held early, to save work

 private:
  std::array<int, kWheels> last_direction_{};
  std::array<double, kWheels> last_crossing_{};
};

/// Normal reactions of the four wheels, N, and the side that bears all, if one does.
struct FloorReactions {
  Wheels N = Wheels::Zero();
  Side tipping = Side::kNone;
};

/// The record that all steppers of one motion write to.
struct MotionRecord {
  MotionRecord() { switches.reserve(1024); }  // before it allocates

  /// Wheel i, at angle phi (rad), came from roller `from` (unwrapped) to its present one at time t (s); nothing if they
  /// are the same. More than one roller makes one record with their count.
  void record_switch(const ContactModes& modes, int i, std::int64_t from, double t, double phi) {
    const std::int64_t to = modes.roller(i), count = std::abs(to - from);
    if (count == 0) return;
    statistics.switches += static_cast<std::uint64_t>(count);
    const int n = modes.rollers();
    switches.push_back({t, i, wrapped(from, n), wrapped(to, n), phi, to > from ? +1 : -1, count});
    for (std::size_t k = switches.size() - 1; k > 0 && switches[k].t < switches[k - 1].t; --k) {
      std::swap(switches[k], switches[k - 1]);
    }
  }

  /// Records the rollers that wheel i of state x, whose contact is averaged, has passed since the last record, as one.
  void record_passed_rollers(ContactModes& modes, int i, const State& x, double t) {
    const std::int64_t from = modes.roller(i);
    modes.track_roller(i, x);
    record_switch(modes, i, from, t, x.phi()[i]);
  }

  /// The switches since the last call, in order of time.
  std::vector<RollerSwitch> take_switches() {
    std::vector<RollerSwitch> taken(switches);
    switches.clear();  // keeps its memory
    return taken;
  }

  /// Records the reactions at the end of a step from `t - dt` to t, s. Throws TippedOver where the motion ends.
  void record_reactions(const FloorReactions& now, double t, double dt) {
    reactions.min_N = reactions.min_N.min(now.N);
    reactions.time_off_floor += (now.N <= 0).select(Wheels::Constant(dt), Wheels::Zero());
    const bool tipped_before = reactions.tipping != Side::kNone;
    reactions.tipping = now.tipping;
    if (now.tipping == Side::kNone) return;
    if (ends_tipping) throw TippedOver(t, now.tipping);
    if (!tipped_before) reactions.tipped_at = t;
    reactions.tipped = now.tipping;
    reactions.time_at_limit += dt;
  }

  IntegrationStatistics statistics;
  std::vector<RollerSwitch> switches;  ///< not yet taken
  ReactionRecord reactions;
  bool ends_tipping = true;  ///< the motion ends at the tipping limit
  SlidingMode sliding_mode;  ///< of wheels that chatter
};

}  // namespace youbot_base_sim
