#pragma once

#include <chrono>
#include <string>

namespace youbot_base_sim {

/// What keeps simulated time from advancing, and when that is worth a line: on the console once it has taken a second
/// and then every ten, in diagnostics every two.
class WaitNotice {
 public:
  struct Due {
    bool console, diagnostics;
  };

  /// Time waits for this, in words that may change from call to call. Returns where to say it now.
  Due waits_for(const std::string& what);

  /// Time advances.
  void over() { what_.clear(); }

  /// What it waits for; empty if it advances.
  const std::string& what() const { return what_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::string what_;
  Clock::time_point console_due_, diagnostics_due_;
};

}  // namespace youbot_base_sim
