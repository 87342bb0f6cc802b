#include "youbot_base_sim/loop/pacer.h"

#include <algorithm>
#include <utility>

namespace youbot_base_sim {

double SpeedMeter::at(double t) {
  constexpr double kLong = 0.5;  // s of wall time
  const Clock::time_point now = Clock::now();
  const double passed = std::chrono::duration<double>(now - since_).count();
  if (t >= since_t_ && passed < kLong) return speed_;
  // After a start, a reset, or a long pause the load is unknown.
  speed_ = t >= since_t_ && passed < 4 * kLong ? (t - since_t_) / passed : 0;
  since_ = now;
  since_t_ = t;
  return speed_;
}

void Pacer::start(double t) {
  start_ = Clock::now();
  start_t_ = t;
}

double Pacer::now() const { return start_t_ + factor_ * std::chrono::duration<double>(Clock::now() - start_).count(); }

Pacer::Clock::time_point Pacer::due(double t) const {
  return start_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>((t - start_t_) / factor_));
}

void Pacer::begin_wait() { timing_.busy += std::chrono::duration<double>(Clock::now() - awake_since_).count(); }

double Pacer::wait_for(double t) const {
  return factor_ == 0 ? 0 : std::chrono::duration<double>(due(t) - Clock::now()).count();
}

double Pacer::arrive(double t) {
  if (factor_ == 0) return 0;
  const double lag = std::chrono::duration<double>(Clock::now() - due(t)).count();
  if (lag > max_lag_) {
    start(t);
    timing_.lost += lag;
    return lag;
  }
  ++timing_.instants;
  timing_.lateness += lag;
  timing_.max_lateness = std::max(timing_.max_lateness, lag);
  return 0;
}

Pacer::Timing Pacer::take_timing() {
  Timing taken;
  std::swap(taken, timing_);
  const auto now = Clock::now();
  const double passed = std::chrono::duration<double>(now - timing_start_).count();
  timing_start_ = now;
  // The time since the last wait counts as busy here, and no more from now on.
  taken.busy += std::chrono::duration<double>(now - awake_since_).count();
  awake_since_ = now;
  if (taken.instants > 0) taken.lateness /= static_cast<double>(taken.instants);
  if (passed > 0) taken.busy /= passed;
  return taken;
}

}  // namespace youbot_base_sim
