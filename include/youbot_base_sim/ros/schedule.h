#pragma once

#include <cstdint>

namespace youbot_base_sim {

/// Instants at the multiples of a period, each met by the first control period that ends there or later. Never a sum of
/// periods: an hour of them is an hour.
class Schedule {
 public:
  /// `rate` in Hz; `slack` (s) is how much too early still counts, for rounding.
  Schedule(double rate, double slack) : rate_(rate), slack_(slack) {}

  /// Whether an instant is due at time t, s.
  bool due(double t) const { return t >= next_ - slack_; }

  /// The same; if one is, the next one is waited for from now on.
  bool meet(double t) {
    if (!due(t)) return false;
    next_ = static_cast<double>(++instants_) / rate_;
    return true;
  }

  /// Time of the instant that is waited for, s.
  double next() const { return next_; }

  /// Back to t = 0.
  void reset() { instants_ = 0, next_ = 0; }

 private:
  double rate_;
  double slack_;
  std::int64_t instants_ = 0;  // that have been met
  double next_ = 0;            // s
};

}  // namespace youbot_base_sim
