#pragma once

#include <ros/time.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace youbot_base_sim {

/// Statistics of a loop that keeps pace with a clock. Durations are s of wall time.
class LoopTiming {
 public:
  /// Statistics since the last `take`.
  struct Report {
    std::int64_t instants = 0;
    double lateness = 0;  ///< from an instant's being due to the loop's arrival there, mean
    double max_lateness = 0;
    double busy = 0;   ///< share of the time that the loop did not wait
    double lost = 0;   ///< given up
    double speed = 0;  ///< simulated seconds per second
  };

  /// Calls `wait` and counts its duration as idle.
  template <class Wait>
  void idle(const Wait& wait) {
    report_.busy += (ros::SteadyTime::now() - awake_since_).toSec();
    wait();
    awake_since_ = ros::SteadyTime::now();
  }

  /// The loop arrives at an instant, `lateness` after that was due.
  void arrive(double lateness) {
    ++report_.instants;
    report_.lateness += lateness;
    report_.max_lateness = std::max(report_.max_lateness, lateness);
  }

  /// The loop gives up a lag.
  void lose(double lag) { report_.lost += lag; }

  /// Returns the report at simulated time t (s) and begins another.
  Report take(double t) {
    Report taken = std::exchange(report_, {});
    const auto now = ros::SteadyTime::now();
    const double passed = (now - start_).toSec();
    taken.busy += (now - awake_since_).toSec();
    start_ = awake_since_ = now;
    if (taken.instants > 0) taken.lateness /= static_cast<double>(taken.instants);
    if (passed > 0) {
      taken.busy /= passed;
      taken.speed = std::max(0.0, t - start_t_) / passed;  // unknown after a reset
    }
    start_t_ = t;
    return taken;
  }

 private:
  Report report_;  // lateness and busy as sums
  ros::SteadyTime start_ = ros::SteadyTime::now(), awake_since_ = start_;
  double start_t_ = 0;
};

}  // namespace youbot_base_sim
