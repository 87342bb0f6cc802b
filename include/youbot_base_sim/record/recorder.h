#pragma once

#include <memory>
#include <string>

#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A file for the rows of a run, which appears under its name only with `commit` (see OutputFile). Throws OutputError
/// where the system refuses, and must not be used afterwards.
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

/// Rows of the motion as CSV: t, pose, velocities, phi, dphi, dgamma; SI units, heading unwrapped, wheels in the order
/// fl, fr, bl, br; numbers that read back to the same double. Begins with `comment`, lines that begin with #.
std::unique_ptr<Recorder> state_csv(OutputFile file, const std::string& comment = "");

/// Rows of roller switches as CSV: t (s), wheel (fl ...), roller_from, roller_to (0 .. n-1), phi (rad), direction (+1
/// or -1), count (1, or the rollers that a fast wheel has passed between two looks). Else as `state_csv`.
std::unique_ptr<Recorder> switch_csv(OutputFile file, const std::string& comment = "");

}  // namespace youbot_base_sim
