#pragma once

#include <optional>
#include <stdexcept>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/state.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// The side over which a base tips, whose two wheels then bear all; kOff: it is lifted off the floor.
enum class Side { kNone, kLeft, kRight, kFront, kRear, kOff };
const char* name_of(Side side);

/// Extremes of the normal reactions over a motion.
struct ReactionRecord {
  Wheels min_N = Wheels::Constant(kInfinity);  ///< of each wheel, N
  Wheels time_off_floor = Wheels::Zero();      ///< s
  Side tipping = Side::kNone;                  ///< at the last look
  Side tipped = Side::kNone;                   ///< when last at the limit
  std::optional<double> tipped_at;             ///< when it last came to the limit, s
  double time_at_limit = 0;                    ///< s, while it went on there
};

/// The base reached its tipping limit, where the two wheels of one side bear all, or was lifted off.
class TippedOver : public std::domain_error {
 public:
  TippedOver(double t, Side side);
  double time() const { return time_; }  ///< s
  Side side() const { return side_; }    ///< the one that bears all

 private:
  double time_;
  Side side_;
};

}  // namespace youbot_base_sim
