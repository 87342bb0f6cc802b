#pragma once

#include <ros/console.h>
#include <ros/time.h>

#include <map>
#include <string>

namespace youbot_base_sim {

/// Logs at most one line a second for each subject, one of a small set of names. (ROS_WARN_THROTTLE goes by simulated
/// time, which may stand still.)
class ThrottledLog {
 public:
  void log(ros::console::Level level, const std::string& subject, const std::string& text) {
    const auto now = ros::SteadyTime::now();
    if (now < next_[subject]) return;
    next_[subject] = now + ros::WallDuration(1);
    ROS_LOG_STREAM(level, ROSCONSOLE_DEFAULT_NAME, text);
  }
  void warn(const std::string& subject, const std::string& text) { log(ros::console::levels::Warn, subject, text); }
  void error(const std::string& subject, const std::string& text) { log(ros::console::levels::Error, subject, text); }

 private:
  std::map<std::string, ros::SteadyTime> next_;  // by subject: when it may have its next line
};

}  // namespace youbot_base_sim
