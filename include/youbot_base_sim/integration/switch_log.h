#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/physics/contact_modes.h"
#include "youbot_base_sim/physics/roller_switch.h"

namespace youbot_base_sim {

/// The switches since the last call of `take`, in order of time. It has room for kRoom before it allocates.
class SwitchLog {
 public:
  explicit SwitchLog(IntegrationStatistics& statistics) : statistics_(&statistics) { switches_.reserve(kRoom); }

  /// Wheel i, at angle phi (rad), came from roller `from` (unwrapped) to its present one at time t (s); nothing if they
  /// are the same. More than one roller makes one record with their count.
  void record(const ContactModes& modes, int i, std::int64_t from, double t, double phi) {
    const std::int64_t to = modes.roller(i), count = std::abs(to - from);
    if (count == 0) return;
    statistics_->switches += static_cast<std::uint64_t>(count);
    const int n = modes.rollers();
    switches_.push_back({t, i, wrapped(from, n), wrapped(to, n), phi, to > from ? +1 : -1, count});
    for (std::size_t k = switches_.size() - 1; k > 0 && switches_[k].t < switches_[k - 1].t; --k) {
      std::swap(switches_[k], switches_[k - 1]);
    }
  }

  /// Begins with those of another log, which are counted already.
  void begin_with(const std::vector<RollerSwitch>& before) { switches_.assign(before.begin(), before.end()); }

  std::vector<RollerSwitch> take() {
    std::vector<RollerSwitch> taken(switches_);
    switches_.clear();  // which keeps its memory
    return taken;
  }

 private:
  static constexpr std::size_t kRoom = 1024;

  IntegrationStatistics* statistics_;
  std::vector<RollerSwitch> switches_;
};

}  // namespace youbot_base_sim
