#pragma once

#include "youbot_base_sim/physics/reactions.h"

namespace youbot_base_sim {

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

}  // namespace youbot_base_sim
