#include "youbot_base_sim/ros/pacer.h"

#include <cerrno>
#include <cmath>
#include <ctime>

namespace youbot_base_sim {

void Pacer::start(double t) {
  start_ = Clock::now();
  start_t_ = t;
}

double Pacer::wait_until(double t) {
  if (factor_ == 0) return 0;
  using std::chrono::duration;
  const auto due = start_ + std::chrono::duration_cast<Clock::duration>(duration<double>((t - start_t_) / factor_));
  const double lag = duration<double>(Clock::now() - due).count();
  if (lag > most_lag_) {
    start(t);
    return lag;
  }
  if (lag < 0) {
    // std::chrono's steady clock is CLOCK_MONOTONIC here; its sleep_until waits for the remaining time, which adds the
    // time from asking to sleeping to every period. An absolute deadline does not. A signal ends it: the loop then
    // sees.
    const auto since_boot = std::chrono::duration_cast<std::chrono::nanoseconds>(due.time_since_epoch()).count();
    timespec deadline{static_cast<time_t>(since_boot / 1000000000), static_cast<long>(since_boot % 1000000000)};
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &deadline, nullptr);
  }
  return 0;
}

}  // namespace youbot_base_sim
