#pragma once

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

/// The rates (rad/s) at which rollers without inertia have no torque; `torque` gives their torques (N m) as a function
/// of their rates, of which it falls. Begins at `guess`, which may be any.
///
/// The rate of a roller that takes over, or with which the motion starts, may be far from any solution. Newton's
/// iterations do not find it from there, and no shorter step brings it nearer. A bracket finds it.
template <class Torque>
Wheels rates_without_torque(const Wheels& guess, const Torque& torque) {
  constexpr double kReach = 1, kGrowth = 8, kLargestReach = 1e9;  // rad/s
  constexpr double kClose = 3e-16;  // of the rate: what friction makes of less is less than any tolerance
  constexpr int kMaxTries = 100;
  Wheels low = guess, high = guess, at_low = torque(guess), at_high = at_low;
  for (double reach = kReach; (at_low < 0).any() && reach < kLargestReach; reach *= kGrowth) {
    low = (at_low < 0).select(low - reach, low);
    at_low = torque(low);
  }
  for (double reach = kReach; (at_high > 0).any() && reach < kLargestReach; reach *= kGrowth) {
    high = (at_high > 0).select(high + reach, high);
    at_high = torque(high);
  }
  for (int tries = 0; tries < kMaxTries && (high - low > kClose * (1 + low.abs())).any(); ++tries) {
    const Wheels chord = low + (high - low) * (at_low / (at_low - at_high).max(1e-300));
    const Wheels middle = tries % 2 == 0 ? chord.max(low).min(high) : Wheels(0.5 * (low + high));
    const Wheels at_middle = torque(middle);
    const WheelMask below = at_middle > 0;
    low = below.select(middle, low);
    at_low = below.select(at_middle, at_low);
    high = below.select(high, middle);
    at_high = below.select(at_high, at_middle);
  }
  return 0.5 * (low + high);
}

}  // namespace youbot_base_sim
