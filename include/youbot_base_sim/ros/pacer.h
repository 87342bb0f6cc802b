#pragma once

#include <chrono>
#include <cstdint>

namespace youbot_base_sim {

/// Keeps simulated time in step with the wall clock: instants have absolute deadlines, so that late ones are caught up
/// with and the mean rate is exact, up to a lag that is given up as lost.
class Pacer {
 public:
  /// `factor` simulated seconds pass in a second; 0: as many as can. A lag above `max_lag` (s of wall time) is given
  /// up.
  Pacer(double factor, double max_lag) : factor_(factor), max_lag_(max_lag) {}

  /// Simulated time t (s) is due now, and later times accordingly.
  void start(double t);

  /// Simulated time that is due now, s. For a factor other than 0.
  double now() const;

  /// What the instants since the last `take_timing` tell about the loop.
  struct Timing {
    std::int64_t instants = 0;
    double lateness = 0;      ///< from an instant's being due to the loop's arrival there, mean, s
    double max_lateness = 0;  ///< s
    double busy = 0;          ///< share of the time that the loop did not wait
    double lost = 0;          ///< given up, s
  };

  /// Sleeps until simulated time t (s) is due, not at all if it is.
  void sleep_until(double t);

  /// Calls `wait`, which waits for something else than time, and does not count that as being busy.
  template <class Wait>
  void idle(const Wait& wait) {
    begin_wait();
    wait();
    awake_since_ = Clock::now();
  }

  /// The loop is at simulated time t (s), which is due. Returns the wall time that is given up, s; mostly 0.
  double arrive(double t);

  /// Clears it.
  Timing take_timing();

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point due(double t) const;
  void begin_wait();

  double factor_;
  double max_lag_;
  Clock::time_point start_;
  double start_t_ = 0;
  Timing timing_;  // lateness and busy as sums, s
  Clock::time_point timing_start_ = Clock::now();
  Clock::time_point awake_since_ = timing_start_;
};

}  // namespace youbot_base_sim
