#pragma once

#include <string>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A file that the rows of a run go to. What it writes appears under the file's name only with `commit`; without it,
/// what was written is kept under a name that marks it as incomplete (see OutputFile). Throws OutputError where the
/// system refuses, and must not be used afterwards.
class Recorder {
 public:
  virtual ~Recorder() = default;

  /// A row at time t (s), which is that of `simulation`; `events`: those since the last row.
  virtual void write(double t, const Simulation& simulation, const Events& events) = 0;

  /// Puts the file in its place.
  virtual void commit() = 0;

  /// Ends the file early. Returns the name under which it is kept; empty if nothing is.
  virtual std::string keep_incomplete() = 0;
};

}  // namespace youbot_base_sim
