#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

/// Control time: whole control periods, and the one rule by which a time in seconds falls into one of them. Period k
/// begins at k * period, so that an hour of periods is an hour. Times count as equal within `kUlps` units in the last
/// place: a fixed slack would either swallow short events or miss boundaries of long runs.
class ControlTime {
 public:
  /// `period` in s, greater than 0.
  explicit ControlTime(double period) : period_(period) {}

  double period() const { return period_; }                                        ///< s
  double begin(std::int64_t k) const { return static_cast<double>(k) * period_; }  ///< of period k, s

  /// The most that rounding may have moved a time t that is the result of a few operations, s.
  static double rounding(double t) { return kUlps * std::numeric_limits<double>::epsilon() * std::abs(t); }

  /// True if time t has reached `due`, both s.
  static bool reached(double due, double t) { return due <= t + rounding(t); }

  /// The first period that begins at time t (s) or later: the one from which what arrives at t acts.
  std::int64_t first_from(double t) const {
    const auto k = static_cast<std::int64_t>(std::ceil(periods(t)));
    return reached(t, begin(k - 1)) ? k - 1 : k;
  }

  /// Number of periods that have ended by time t, s.
  std::int64_t ended_by(double t) const {
    const auto k = static_cast<std::int64_t>(std::floor(periods(t)));
    return reached(begin(k + 1), t) ? k + 1 : k;
  }

 private:
  static constexpr double kUlps = 4;
  static constexpr double kMaxPeriods = 1e18;  // periods, for infinite times

  double periods(double t) const { return std::clamp(t / period_, -kMaxPeriods, kMaxPeriods); }

  double period_;
};

/// Instants at multiples of a period, k / rate: not summed up, so they do not drift.
class Instants {
 public:
  /// `rate` in Hz.
  explicit Instants(double rate) : rate_(rate) {}

  /// True if the next instant is at time t (s) or earlier.
  bool due(double t) const { return ControlTime::reached(next_, t); }

  /// True as `due` is; then proceeds to the next instant.
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
  std::int64_t instants_ = 0;  // met so far
  double next_ = 0;            // s
};

}  // namespace youbot_base_sim
