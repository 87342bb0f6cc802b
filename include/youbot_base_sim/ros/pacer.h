#pragma once

#include <chrono>
#include <cstdint>

namespace youbot_base_sim {

/// Keeps simulated time in step with the wall clock: instants have absolute deadlines, so that late ones are caught up
/// with and the mean rate is exact, up to a lag that is given up as lost.
class Pacer {
 public:
  /// `factor` simulated seconds pass in a second; 0: as many as can. A lag above `most_lag` (s of wall time) is given
  /// up.
  Pacer(double factor, double most_lag) : factor_(factor), most_lag_(most_lag) {}

  /// Simulated time t (s) is due now, and later times accordingly.
  void start(double t);

  /// Simulated time that is due now, s. For a factor other than 0.
  double now() const;

  /// What the waits since the last `take_timing` tell about the loop.
  struct Timing {
    std::int64_t waits = 0;
    double lateness = 0;       ///< from the instants that were due to the loop's going on, mean, s
    double most_lateness = 0;  ///< s
    double busy = 0;           ///< share of the time that the loop did not wait
    double lost = 0;           ///< given up, s
  };

  /// Sleeps until simulated time t (s) is due. Returns the wall time that was given up, s; mostly 0.
  double wait_until(double t);

  /// Clears it.
  Timing take_timing();

 private:
  using Clock = std::chrono::steady_clock;

  double factor_;
  double most_lag_;
  Clock::time_point start_;
  double start_t_ = 0;
  Timing timing_;  // lateness and busy as sums, s
  Clock::time_point timing_start_ = Clock::now();
  Clock::time_point awake_since_ = timing_start_;
};

}  // namespace youbot_base_sim
