#pragma once

#include "youbot_base_sim/integration/reaction_monitor.h"
#include "youbot_base_sim/integration/sliding_mode.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/switch_log.h"
#include "youbot_base_sim/physics/contact_modes.h"

namespace youbot_base_sim {

/// The record that all steppers of one motion write to.
struct MotionRecord {
  MotionRecord() = default;
  MotionRecord(const MotionRecord&) = delete;
  MotionRecord& operator=(const MotionRecord&) = delete;

  /// Records the rollers that wheel i of state x, whose contact is averaged, has passed since the last record, as one.
  void record_passed_rollers(ContactModes& modes, int i, const State& x, double t) {
    const std::int64_t from = modes.roller(i);
    modes.track_roller(i, x);
    switches.record(modes, i, from, t, x.phi()[i]);
  }

  IntegrationStatistics statistics;
  SwitchLog switches{statistics};
  ReactionMonitor reactions;
  SlidingMode sliding_mode;  ///< which wheels chatter
};

}  // namespace youbot_base_sim
