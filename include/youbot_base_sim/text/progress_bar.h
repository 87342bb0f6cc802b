#pragma once

#include <chrono>
#include <string>

namespace youbot_base_sim {

/// A bar on standard error, if that is a terminal, for what takes longer than a second. Clear it before printing.
class ProgressBar {
 public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// True if it is time to draw it: at most ten times a second.
  bool due() const { return shown_ && Clock::now() >= next_; }
  /// `share` is from 0 to 1; `text` stands behind the bar.
  void draw(double share, const std::string& text);
  void clear();
  /// For good, because other output would be mixed with it.
  void hide() { shown_ = false; }

  bool shown() const { return shown_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool shown_;  // at all
  bool drawn_ = false;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(1);
};

}  // namespace youbot_base_sim
