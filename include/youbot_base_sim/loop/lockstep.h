#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

/// How simulated time waits for command messages: each control period, for players that answer each /clock message, or
/// each period of lockstep, for nodes with a loop of their own.
struct LockstepSettings {
  bool on = false;
  double period = 0;   ///< of the commanding node's loop, s, a multiple of the control period; 0: that period itself
  double timeout = 0;  ///< wall time to wait for a command, s, before time advances without one; 0: for ever
  bool end_with_commands = false;  ///< the node ends instead, and when the last publisher of commands is gone
};

/// Where simulated time waits for a command message, and for how long. Counts time in control periods.
class Lockstep {
 public:
  /// `control_period` in s.
  Lockstep(const LockstepSettings& settings, double control_period)
      : settings_(settings),
        every_(settings.period > 0 ? std::max<std::int64_t>(1, std::llround(settings.period / control_period)) : 1) {}

  /// Whether the commanding node has a loop of its own: then /clock advances by whole periods, after all else.
  bool has_own_period() const { return settings_.on && settings_.period > 0; }

  /// Whether a period of lockstep begins at control period k.
  bool begins(std::int64_t k) const { return settings_.on && k % every_ == 0; }

  /// Whether a period begins at control period k that has no command yet.
  bool waits(std::int64_t k) const { return begins(k) && k != released_; }

  /// Control periods from k to the next period of lockstep, 1 or more; without lockstep, the largest number.
  std::int64_t left(std::int64_t k) const {
    return settings_.on ? every_ - k % every_ : std::numeric_limits<std::int64_t>::max();
  }

  /// Whether /clock advances while nothing is simulated yet: until a node that has a loop of its own first commands.
  bool idles() const { return has_own_period() && !started_; }

  /// Wall time to wait for a command, s. After one has not come, periods last as long as by the wall clock until the
  /// next one.
  double patience() const {
    if (idles()) return settings_.period;
    if (settings_.timeout == 0) return std::numeric_limits<double>::infinity();
    return unanswered_ && !settings_.end_with_commands ? settings_.period : settings_.timeout;
  }

  /// /clock advances by one period while nothing is simulated yet.
  void idle() { ++idle_periods_; }

  /// Time that has passed so, s.
  double idle_time() const { return static_cast<double>(idle_periods_) * settings_.period; }

  /// Whether the node ends, after the patience, for want of a command; while it idles, after the time-out.
  bool ends() const {
    if (!settings_.end_with_commands || settings_.timeout == 0) return false;
    return !idles() || idle_time() >= settings_.timeout;
  }

  /// Lets control period k begin, with its command or because none came in time.
  void release(std::int64_t k, bool answered) {
    released_ = k;
    started_ = started_ || answered;
    unanswered_ = !answered;
  }

  /// Whether the last command did not come in time.
  bool unanswered() const { return unanswered_; }

  /// Whether there has been a command since the beginning.
  bool started() const { return started_; }

 private:
  LockstepSettings settings_;
  std::int64_t every_;  // control periods
  std::int64_t released_ = -1;
  std::int64_t idle_periods_ = 0;  // of lockstep
  bool started_ = false;
  bool unanswered_ = true;  // before the first command no other is waited for
};

}  // namespace youbot_base_sim
