#pragma once

#include <ros/console.h>

#include <chrono>
#include <map>
#include <string>

namespace youbot_base_sim {

/// Logs at most one line a second for each subject, one of a small set of names. (ROS_WARN_THROTTLE goes by simulated
/// time, which may stand still.)
class ThrottledLog {
 public:
  void warn(const std::string& subject, const std::string& text) {
    if (due(subject)) ROS_WARN_STREAM(text);
  }
  void error(const std::string& subject, const std::string& text) {
    if (due(subject)) ROS_ERROR_STREAM(text);
  }

 private:
  using Clock = std::chrono::steady_clock;

  bool due(const std::string& subject) {
    const auto now = Clock::now();
    Clock::time_point& next = next_[subject];
    if (now < next) return false;
    next = now + std::chrono::seconds(1);
    return true;
  }

  std::map<std::string, Clock::time_point> next_;  // by subject: when it may have its next line
};

}  // namespace youbot_base_sim
