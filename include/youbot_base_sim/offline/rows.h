#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The scale of a run's energy, and how well its balance closes: the largest values over the rows, J.
struct EnergyAudit {
  double max_balance_error = 0, max_kinetic_energy = 0;
  /// Energy that the drives exchange with the wheels in either direction: integral of sum |M dphi|, trapezoidal rule.
  double drive_work = 0;
  double longest_interval = 0;  ///< between two rows, s
};

/// Length of the paths of the base and of the wheels' rims, m.
struct PathLength {
  double base = 0;  ///< of O; a rotation counts at the wheels' centres
  Wheels wheels = Wheels::Zero();
};

/// Takes a simulation that stands at t = 0 through its scene from row to row: t = 0, the multiples of 1 / output_rate,
/// and the duration. Audits the energy at each row and, if rows are far apart, at ends of control periods in between.
class RowLoop {
 public:
  /// Calls `at_look`, which may throw, at each look at the energy.
  explicit RowLoop(
      Simulation& simulation, std::function<void()> at_look = [] {})
      : simulation_(simulation), at_look_(std::move(at_look)) {}

  /// Advances to the next row; false: there is none. Throws as advance_to, and std::runtime_error for a NaN or Inf.
  bool next();

  /// Advances to time t (s), which need be no row, with the same audit and exceptions.
  void advance_to(double t);

  double t() const { return t_; }  ///< of the row, s
  const EnergyAudit& energy() const { return energy_; }
  const PathLength& path() const { return path_; }  ///< summed over the rows

 private:
  void look();

  Simulation& simulation_;
  std::function<void()> at_look_;
  EnergyAudit energy_;
  double audited_ = 0, power_ = 0;  // s, and sum |M dphi| then, W
  PathLength path_;
  std::int64_t rows_ = 0;  // so far
  double t_ = 0;
};

}  // namespace youbot_base_sim
