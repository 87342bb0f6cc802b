#pragma once

#include <chrono>
#include <map>
#include <string>

namespace youbot_base_sim {

/// Logs at most one line a second for each subject, since commands may cause a thousand warnings a second.
/// (ROS_WARN_THROTTLE goes by simulated time, which may stand still.)
class ThrottledLog {
 public:
  /// `subject` is one of a small set of names.
  void warn(const std::string& subject, const std::string& text);
  void error(const std::string& subject, const std::string& text);

 private:
  using Clock = std::chrono::steady_clock;

  bool silent(const std::string& subject);

  std::map<std::string, Clock::time_point> last_;  // by subject
};

}  // namespace youbot_base_sim
