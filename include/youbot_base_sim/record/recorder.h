#pragma once

#include <vector>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A file that the rows of a run go to. What it writes appears under the file's name only with `commit`; without it,
/// nothing is left. Throws std::runtime_error, which names the file, where the system refuses.
class Recorder {
 public:
  virtual ~Recorder() = default;

  /// A row at time t (s), which is that of `simulation`; `switches`: those since the last row, in order of time.
  virtual void write(double t, const Simulation& simulation, const std::vector<RollerSwitch>& switches) = 0;

  /// Puts the file in its place.
  virtual void commit() = 0;
};

}  // namespace youbot_base_sim
