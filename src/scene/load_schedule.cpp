#include "youbot_base_sim/scene/load_schedule.h"

#include <algorithm>

namespace youbot_base_sim {

AppliedLoads LoadSchedule::at(double t, bool settled) const {
  AppliedLoads applied;
  for (const PlannedLoad& planned : loads) {
    if (planned.contains(t) && (settled || !planned.at_rest || planned.start != t))
      applied.loads.push_back(planned.load);
  }
  for (const PlannedWrench& planned : wrenches) {
    if (planned.contains(t)) applied.wrenches.push_back(planned.wrench);
  }
  return applied;
}

double LoadSchedule::next_change(double t) const {
  double next = std::numeric_limits<double>::infinity();
  const auto look = [&](const Stretch& stretch) {
    for (const double change : {stretch.start, stretch.end}) {
      if (change > t) next = std::min(next, change);
    }
  };
  for (const PlannedLoad& planned : loads) look(planned);
  for (const PlannedWrench& planned : wrenches) look(planned);
  return next;
}

}  // namespace youbot_base_sim
