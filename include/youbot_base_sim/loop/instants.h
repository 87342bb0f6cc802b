#pragma once

#include <cstdint>

#include "youbot_base_sim/drive/control_time.h"

namespace youbot_base_sim {

/// Instants at multiples of a period, k / rate: not summed up, so they do not drift.
class Instants {
 public:
  /// `rate` in Hz.
  explicit Instants(double rate) : rate_(rate) {}

  /// True if the next instant is at time t (s) or earlier.
  bool due(double t) const { return ControlTime::reached(next_, t); }

  /// As `due`; if so, proceeds to the next instant.
  bool meet(double t) {
    if (!due(t)) return false;
    next_ = static_cast<double>(++instants_) / rate_;
    return true;
  }

  /// Time of the next instant, s.
  double next() const { return next_; }

  /// Back to t = 0.
  void reset() { *this = Instants(rate_); }

 private:
  double rate_;
  std::int64_t instants_ = 0;  // that have been met
  double next_ = 0;            // s
};

}  // namespace youbot_base_sim
