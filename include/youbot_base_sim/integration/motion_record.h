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

/// Records the normal reactions at the ends of steps, and ends the motion where the base reaches its tipping limit.
class ReactionMonitor {
 public:
  /// True if the motion ends at the tipping limit: it does unless it was asked to continue there.
  bool ends_tipping() const { return ends_tipping_; }
  void continue_when_tipping() { ends_tipping_ = false; }

  /// Records the reactions at the end of a step from `t - dt` to t, s. Throws TippedOver where the motion ends.
  void watch(const FloorReactions& reactions, double t, double dt) {
    record_.min_N = record_.min_N.min(reactions.N);
    record_.time_off_floor += (reactions.N <= 0).select(Wheels::Constant(dt), Wheels::Zero());
    const bool tipped_before = record_.tipping != Side::kNone;
    record_.tipping = reactions.tipping;
    if (reactions.tipping == Side::kNone) return;
    if (ends_tipping_) throw TippedOver(t, reactions.tipping);
    if (!tipped_before) record_.tipped_at = t;
    record_.tipped = reactions.tipping;
    record_.time_at_limit += dt;
  }

  const ReactionRecord& record() const { return record_; }

  /// Continues the record of another integration.
  void begin_with(const ReactionRecord& before) { record_ = before; }

 private:
  ReactionRecord record_;
  bool ends_tipping_ = true;
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
