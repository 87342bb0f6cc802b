#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

/// How simulated time waits for command messages. A period of lockstep is either each control period, for players that
/// answer each /clock message, or several of them, for nodes with a loop of their own.
struct LockstepSettings {
  bool on = false;
  /// Period of the commanding node's loop, s, a multiple of the control period. 0: each control period.
  double period = 0;
  /// Wall time to wait for a command, s; 0: for ever. If none comes, time advances without one.
  double timeout = 0;
  /// Whether the node ends instead; and it ends when the last publisher of commands is gone.
  bool end_with_commands = false;
};

/// Where simulated time waits for a command message, and for how long. Counts time in control periods.
class Lockstep {
 public:
  /// `control_period` in s.
  Lockstep(const LockstepSettings& settings, double control_period)
      : settings_(settings),
        every_(settings.period > 0 ? std::max<std::int64_t>(1, std::llround(settings.period / control_period)) : 1) {}

  /// Whether the node that commands has a loop of its own: /clock then advances by whole periods of lockstep, each
  /// after all else that is published.
  bool has_own_period() const { return settings_.on && settings_.period > 0; }

  /// Whether a period of lockstep begins at control period k.
  bool begins(std::int64_t k) const { return settings_.on && k % every_ == 0; }

  /// Whether time waits at control period k: one begins for which there was no command yet.
  bool waits(std::int64_t k) const { return begins(k) && k != released_; }

  /// Control periods from k to where the next period of lockstep begins, 1 or more; without lockstep no number is too
  /// many.
  std::int64_t left(std::int64_t k) const {
    return settings_.on ? every_ - k % every_ : std::numeric_limits<std::int64_t>::max();
  }

  /// Whether /clock advances while nothing is simulated yet: until a node that has a loop of its own first commands.
  bool idles() const { return has_own_period() && !started_; }

  /// s of wall time that a command may take to come. After one has not come, until the next a period takes as long as
  /// it does by the wall clock.
  double patience() const {
    if (idles()) return settings_.period;
    if (settings_.timeout == 0) return std::numeric_limits<double>::infinity();
    return unanswered_ && !settings_.end_with_commands ? settings_.period : settings_.timeout;
  }

  /// /clock advances by one period while nothing is simulated yet.
  void idle() { ++idle_periods_; }

  /// By how much it has done so, s.
  double idle_time() const { return static_cast<double>(idle_periods_) * settings_.period; }

  /// Whether the node ends for want of a command, which has not come within the patience: at once, or, where it idles,
  /// after as long.
  bool ends() const {
    if (!settings_.end_with_commands || settings_.timeout == 0) return false;
    return !idles() || idle_time() >= settings_.timeout;
  }

  /// Control period k has its command, or none in time: time advances.
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
