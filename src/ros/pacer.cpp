#include "youbot_base_sim/ros/pacer.h"

#include <algorithm>
#include <ctime>
#include <utility>

namespace youbot_base_sim {

void Pacer::start(double t) {
  start_ = Clock::now();
  start_t_ = t;
}

double Pacer::now() const { return start_t_ + factor_ * std::chrono::duration<double>(Clock::now() - start_).count(); }

double Pacer::wait_until(double t) {
  if (factor_ == 0) return 0;
  using std::chrono::duration;
  const auto due = start_ + std::chrono::duration_cast<Clock::duration>(duration<double>((t - start_t_) / factor_));
  const auto asked = Clock::now();
  timing_.busy += duration<double>(asked - awake_since_).count();
  double lag = duration<double>(asked - due).count();
  if (lag > most_lag_) {
    start(t);
    timing_.lost += lag;
    awake_since_ = start_;
    return lag;
  }
  awake_since_ = asked;
  if (lag < 0) {
    // std::chrono's steady clock is CLOCK_MONOTONIC here; its sleep_until waits for the remaining time, which adds the
    // time from asking to sleeping to every period. An absolute deadline does not. A signal ends it: the loop then
    // sees.
    const auto since_boot = std::chrono::duration_cast<std::chrono::nanoseconds>(due.time_since_epoch()).count();
    timespec deadline{static_cast<time_t>(since_boot / 1000000000), static_cast<long>(since_boot % 1000000000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
    awake_since_ = Clock::now();
    lag = duration<double>(awake_since_ - due).count();
  }
  ++timing_.waits;
  timing_.lateness += lag;
  timing_.most_lateness = std::max(timing_.most_lateness, lag);
  return 0;
}

Pacer::Timing Pacer::take_timing() {
  Timing taken;
  std::swap(taken, timing_);
  const auto now = Clock::now();
  const double passed = std::chrono::duration<double>(now - timing_start_).count();
  timing_start_ = now;
  if (taken.waits > 0) taken.lateness /= static_cast<double>(taken.waits);
  if (passed > 0) taken.busy /= passed;
  return taken;
}

}  // namespace youbot_base_sim
