#include "youbot_base_sim/ros/throttled_log.h"

#include <ros/console.h>

namespace youbot_base_sim {

namespace {

constexpr auto kSilence = std::chrono::seconds(1);  // between two lines about the same thing

}  // namespace

void ThrottledLog::warn(const std::string& subject, const std::string& text) {
  if (!silent(subject)) ROS_WARN_STREAM(text);
}

void ThrottledLog::error(const std::string& subject, const std::string& text) {
  if (!silent(subject)) ROS_ERROR_STREAM(text);
}

bool ThrottledLog::silent(const std::string& subject) {
  const auto now = Clock::now();
  const auto [last, is_first] = last_.emplace(subject, now);
  if (!is_first && now - last->second < kSilence) return true;
  last->second = now;
  return false;
}

}  // namespace youbot_base_sim
