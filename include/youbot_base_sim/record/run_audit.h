#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

class Twin;

/// Processor time of a run, by output interval. Reads the thread's clock twice an interval, 0.2 us each.
class RunCost {
 public:
  struct Period {
    double start = 0;     ///< simulated time, s
    double length = 0;    ///< s
    double cpu_time = 0;  ///< s
  };

  void start(double t);  ///< begins an interval at simulated time t, s
  void stop(double t);   ///< ends it

  double cpu_time() const { return cpu_time_; }       ///< s
  const Period& slowest() const { return slowest_; }  ///< the one with the largest processor time
  std::size_t periods() const { return cpu_times_.size(); }
  std::size_t late_periods() const { return late_; }  ///< took longer than they last

  /// Processor time that a share (0 to 1) of the intervals does not exceed, s.
  double percentile(double share) const;

 private:
  double t_ = 0;
  double clock_ = 0;
  double cpu_time_ = 0;
  Period slowest_;
  std::size_t late_ = 0;
  std::vector<float> cpu_times_;
};

/// The scale of a run's energy, and how well its balance closes: the largest values over the rows, J.
class EnergyAudit {
 public:
  void add_row(const Simulation& simulation);

  double max_balance_error() const { return max_balance_error_; }
  double max_kinetic_energy() const { return max_kinetic_energy_; }
  /// Energy that the drives exchange with the wheels in either direction: integral of sum |M dphi|, trapezoidal rule.
  double drive_work() const { return drive_work_; }
  double longest_interval() const { return longest_interval_; }  ///< between two rows, s

 private:
  double t_ = 0;
  double power_ = 0;  // sum |M dphi| of the last row, W
  double max_balance_error_ = 0;
  double max_kinetic_energy_ = 0;
  double drive_work_ = 0;
  double longest_interval_ = 0;
};

/// Length of the paths of the base and of the wheels' rims, m.
struct PathLength {
  double base = 0;  ///< of O; a turn counts at the wheels' centres
  Wheels wheels = Wheels::Zero();
};

/// Takes a simulation that stands at t = 0 through its scene from row to row: t = 0, the multiples of 1 / output_rate,
/// and the duration. Audits the energy at each row and, if rows are far apart, at ends of control periods in between.
class RowLoop {
 public:
  explicit RowLoop(Simulation& simulation) : simulation_(simulation) {}

  /// Advances to the next row; false if there is none. Throws as Simulation::advance_to, and std::runtime_error where
  /// the state is no longer finite.
  bool next();

  double t() const { return t_; }  ///< of the row, s
  const EnergyAudit& energy() const { return energy_; }
  const PathLength& path() const { return path_; }  ///< summed over the rows

 private:
  void audit_until(double t);
  void add_path(const State& before);

  Simulation& simulation_;
  EnergyAudit energy_;
  PathLength path_;
  std::int64_t rows_ = 0;  // so far
  double t_ = 0;
};

/// Why a result may be unreliable, in one line; empty if it is reliable: the integration kept to its own method, wheels
/// that were held early cannot matter, the method keeps such a tolerance, and the energy balance closes to a share of the
/// energy that the motion had or exchanged. That share is a thousand times the tolerance, but at least 1e-9 and at most
/// a thousandth (or ten times a looser tolerance); with prescribed wheels at least 2e-14 m/s over the regularization
/// speed. Good runs close it to the tolerance itself, mostly to a hundredth of that.
std::string unreliability_reason(const Simulation& simulation, const EnergyAudit& energy, const PathLength& path);

/// The same of a run with a twin, unless that is null: both agree too.
std::string unreliability_reason(const Simulation& simulation, const RowLoop& rows, const Twin* twin);

/// The summary of a run, and of its twin if there is one, as a JSON object. `completed`: to the scene's duration;
/// `wall_time` in s.
std::string summary_json(const Simulation& simulation, bool completed, double wall_time, const RunCost& cost,
                         const RowLoop& rows, const Twin* twin);

/// The same in a few lines for a person.
std::string summary_text(const Simulation& simulation, double wall_time, const Twin* twin = nullptr);

}  // namespace youbot_base_sim
