#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "youbot_base_sim/offline/rows.h"
#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

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

/// The summary of a run, and of its twin if there is one, as a JSON object. `completed`: to the scene's duration;
/// `wall_time` in s.
std::string summary_json(const Simulation& simulation, bool completed, double wall_time, const RunCost& cost,
                         const RowLoop& rows, const Twin* twin);

/// The summary in a few lines for a person.
std::string summary_text(const Simulation& simulation, double wall_time, const Twin* twin = nullptr);

}  // namespace youbot_base_sim
