#include "youbot_base_sim/lockstep/time_gate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ros/console.h>

#include <algorithm>

namespace youbot_base_sim {

void TimeGate::note_late(const std::string& node) {
  if (++late_[node] > 1) return;
  ROS_WARN("%s commands while all nodes rest, so by the wall clock: another run may have another result", node.c_str());
}

std::string TimeGate::broken_promise() const {
  if (given_up_.empty()) return "";
  return fmt::format("lockstep: time has not waited for {}: another run may have another result",
                     fmt::join(given_up_, ", "));
}

std::map<std::string, std::string> TimeGate::counters() const {
  const auto [name, waited] = slowest();
  return {{"steps", std::to_string(steps_)},
          {"late commands", fmt::format("{}", late_)},
          {"nodes given up", fmt::format("{}", fmt::join(given_up_, " "))},
          {"slowest node", fmt::format("{}: {:.3g} ms a step", name, waited / std::max(1.0, 1.0 * steps_))}};
}

}  // namespace youbot_base_sim
