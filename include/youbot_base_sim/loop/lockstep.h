#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace youbot_base_sim {

/// Conditions on which simulated time waits: that all nodes that follow /clock rest, or the commands of a player, which
/// answers each /clock message with one.
struct LockstepSettings {
  bool on = false;
  double period = 0;    ///< step of /clock for nodes that rest, s, a multiple of the control period; 0: for a player
  double timeout = 10;  ///< wall time to wait for a node to rest, or for the command of a player that may end, s
  bool end_with_commands = false;  ///< the node ends when the last publisher of commands is gone
};

/// The points of time at which simulated time waits. Counts time in control periods.
class Lockstep {
 public:
  /// `control_period` in s.
  Lockstep(const LockstepSettings& settings, double control_period)
      : settings_(settings),
        every_(settings.period > 0 ? std::max<std::int64_t>(1, std::llround(settings.period / control_period)) : 1) {}

  /// True if it waits for nodes to rest: then /clock advances by whole periods, after all else.
  bool awaits_rest() const { return settings_.on && settings_.period > 0; }

  /// True if a period of lockstep begins at control period k.
  bool begins(std::int64_t k) const { return settings_.on && k % every_ == 0; }

  /// True if a period begins at control period k that may not begin yet.
  bool waits(std::int64_t k) const { return begins(k) && k != released_; }

  /// Control periods from k to the next period of lockstep, 1 or more; without lockstep, the largest number.
  std::int64_t left(std::int64_t k) const {
    return settings_.on ? every_ - k % every_ : std::numeric_limits<std::int64_t>::max();
  }

  /// True if /clock advances while nothing is simulated yet: nodes that are to rest sleep before they command.
  bool idles() const { return awaits_rest() && !started_; }

  /// Wall time to wait for a command, s: of a period that idles, else of a player's.
  double patience() const {
    if (idles()) return settings_.period;
    const bool gives_up = settings_.end_with_commands && settings_.timeout > 0;
    return gives_up ? settings_.timeout : std::numeric_limits<double>::infinity();
  }

  /// /clock advances by one period while nothing is simulated yet.
  void idle() { ++idle_periods_; }

  /// Time that has passed so, s.
  double idle_time() const { return static_cast<double>(idle_periods_) * settings_.period; }

  /// The simulation begins.
  void start() { started_ = true; }

  /// Lets control period k begin.
  void release(std::int64_t k) {
    released_ = k;
    started_ = true;
  }

  /// True if the simulation has begun.
  bool started() const { return started_; }

 private:
  LockstepSettings settings_;
  std::int64_t every_;  // control periods
  std::int64_t released_ = -1;
  std::int64_t idle_periods_ = 0;  // of lockstep
  bool started_ = false;
};

}  // namespace youbot_base_sim
