#pragma once

#include <chrono>
#include <string>

namespace youbot_base_sim {

/// A bar on the terminal for what takes longer than a second; nothing where standard error is none. Clear it before
/// printing anything else.
class ProgressBar {
 public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Whether it is to be drawn now: at most ten times a second, so that callers need not count.
  bool due() const;
  /// `share` is from 0 to 1; `text` stands behind the bar.
  void draw(double share, const std::string& text);
  void clear();
  /// For good, where what is printed besides shows how far it is, and would be mixed with the bar.
  void hide() { shown_ = false; }

  bool shown() const { return shown_; }

 private:
  using Clock = std::chrono::steady_clock;

  bool shown_;  // at all
  bool drawn_ = false;
  Clock::time_point next_ = Clock::now() + std::chrono::seconds(1);
};

}  // namespace youbot_base_sim
