#include "youbot_base_sim/integration/sliding_mode.h"

#include <cmath>

namespace youbot_base_sim {

bool SlidingMode::stands(const ContactSystem& system, const State& x, double t, int i, int direction) {
  const bool hops = direction == -last_direction_[i] && std::abs(x.dphi()[i]) * (t - last_crossing_[i]) < kHop;
  if (!hops || system.sharing(i, x, t).attractive) return false;
  last_direction_[i] = direction;
  last_crossing_[i] = t;
  return true;
}

bool SlidingMode::enters(const ContactSystem& system, const State& x, double t, int i, int direction,
                         double max_momentum) {
  if (direction != -last_direction_[i] || t > last_crossing_[i] + kWindow) reversals_[i] = 0;
  last_direction_[i] = direction;
  last_crossing_[i] = t;
  if (++reversals_[i] <= (holds_early_ ? kEarlyChatter : kMinChatter)) return false;
  if (!system.sharing(i, x, t).attractive) return false;
  return holds_early_ || reversals_[i] > kMaxChatter || system.momentum(i, x) < max_momentum;
}

}  // namespace youbot_base_sim
