#pragma once

#include <chrono>
#include <string>

namespace youbot_base_sim {

/// What keeps simulated time from going on: said on the console once that has taken a second, and then every ten.
class WaitNotice {
 public:
  /// Time waits for this, in words that may change from call to call.
  void waits_for(const std::string& what);

  /// Time goes on.
  void over() { what_.clear(); }

  /// What it waits for; empty if it goes on.
  const std::string& what() const { return what_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  Clock::time_point due_;
};

}  // namespace youbot_base_sim
