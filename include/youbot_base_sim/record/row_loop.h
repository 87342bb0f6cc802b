#pragma once

#include <cstdint>

#include "youbot_base_sim/record/run_audit.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Takes a simulation that stands at t = 0 through its scene from row to row: t = 0, the multiples of 1 / output_rate,
/// and the duration. The energy is audited at each row and, where rows are far apart, in between.
class RowLoop {
 public:
  RowLoop(Simulation& simulation, EnergyAudit& energy) : simulation_(simulation), energy_(energy) {}

  /// Advances to the next row; false if there is none. Throws as Simulation::advance_to, and std::runtime_error where
  /// the state is no longer finite.
  bool next();

  double t() const { return t_; }  ///< of the row, s

 private:
  void audit_until(double t);

  Simulation& simulation_;
  EnergyAudit& energy_;
  std::int64_t rows_ = 0;  // so far
  double t_ = 0;
};

}  // namespace youbot_base_sim
