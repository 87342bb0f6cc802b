#pragma once

#include <limits>
#include <vector>

#include "youbot_base_sim/export.h"
#include "youbot_base_sim/physics/applied_loads.h"
#include "youbot_base_sim/text/number.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

// Ranges of the numbers in scenes and messages.
inline constexpr Range kLoadMasses{1e-12, 1e6, "kg"};
inline constexpr Range kLoadInertias{0, 1e6, "kg m^2"};
inline constexpr Range kLoadPositions{-1e3, 1e3, "m"};
inline constexpr Range kWrenchForces{-1e6, 1e6, "N"};
inline constexpr Range kWrenchTorques{-1e6, 1e6, "N m"};

/// The loads on the base and the wrenches that act on it, as functions of time.
struct LoadSchedule {
  /// From `start` (s) on and before `end`.
  struct Stretch {
    double start = 0, end = std::numeric_limits<double>::infinity();
    bool contains(double t) const { return start <= t && t < end; }
  };
  struct PlannedLoad : Stretch {
    Load load;
    bool at_rest = false;  ///< added at rest: the base keeps its momentum rather than its velocities
  };
  struct PlannedWrench : Stretch {
    Wrench wrench;
  };
  std::vector<PlannedLoad> loads;
  std::vector<PlannedWrench> wrenches;

  bool empty() const { return loads.empty() && wrenches.empty(); }

  /// The loads and wrenches at time t, s. Unless `settled`, loads that are added at rest at exactly t are left out.
  AppliedLoads at(double t, bool settled = true) const;

  /// The time of the next change after t, s; infinite: never.
  double next_change(double t) const;
};

}  // namespace youbot_base_sim
