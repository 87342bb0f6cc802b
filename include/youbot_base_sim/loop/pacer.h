#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

/// How fast simulated time goes against the wall clock, as lately seen.
class SpeedMeter {
 public:
  /// Simulated time is t (s) now. Returns simulated seconds per second, over the last half second or more.
  double at(double t);

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point since_;
  double since_t_ = std::numeric_limits<double>::infinity();  // s
  double speed_ = 0;
};

/// Keeps simulated time in step with the wall clock. Deadlines are absolute, so the loop catches up after a late
/// instant and the mean rate is exact. A lag beyond a limit is given up as lost.
class Pacer {
 public:
  /// `factor`: simulated seconds per second; 0: as fast as possible. `max_lag`: s of wall time.
  Pacer(double factor, double max_lag) : factor_(factor), max_lag_(max_lag) {}

  /// Makes simulated time t (s) due now, and later times accordingly.
  void start(double t);

  /// Simulated time that is due now, s. Needs a factor other than 0.
  double now() const;

  /// How the loop kept time since the last `take_timing`.
  struct Timing {
    std::int64_t instants = 0;
    double lateness = 0;      ///< from an instant's being due to the loop's arrival there, mean, s
    double max_lateness = 0;  ///< s
    double busy = 0;          ///< share of the time that the loop did not wait
    double lost = 0;          ///< given up, s
  };

  /// Wall time until simulated time t (s) is due, s; not positive if it is.
  double wait_for(double t) const;

  /// Calls `wait`, which waits for something other than time, and counts its duration as idle.
  template <class Wait>
  void idle(const Wait& wait) {
    begin_wait();
    wait();
    awake_since_ = Clock::now();
  }

  /// Records that the loop has reached simulated time t (s), which is due. Returns the wall time that is given up, s; 0
  /// unless the lag exceeds the limit.
  double arrive(double t);

  /// Returns the timing and clears it.
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
