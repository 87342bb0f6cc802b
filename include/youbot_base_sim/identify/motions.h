#pragma once

#include <vector>

#include "youbot_base_sim/identify/drive_record.h"

namespace youbot_base_sim {

/// A stretch of a record under one command, or one that changes little, s.
struct Motion {
  double begin, end;
  bool held;              ///< the command stays the same
  bool moving;            ///< the command is not zero
  bool held_out = false;  ///< kept from the fit, to judge it by: every third that moves, and the stop after it
};

/// The record, cut where the command jumps; stretches are at least one second long, and at most four unless held.
std::vector<Motion> motions(const DriveRecord& record);

/// When the base has settled after a jump of the command, s.
constexpr double kSettlingTime = 1.0;

}  // namespace youbot_base_sim
