#pragma once

#include <rosgraph_msgs/Log.h>

#include <string>
#include <vector>

#include "base_client.h"

namespace youbot_base_sim {

/// What the base says in the log, as a node or as a nodelet in a manager.
class Log {
 public:
  /// The program's one listener, once it hears the node of `base`, which must be in lockstep.
  static Log& of(BaseClient& base) {
    static Log* log = new Log(base);
    return *log;
  }

  /// Waits for a line of this level that has all of `words`.
  void expect(int level, const std::vector<std::string>& words) {
    wait_for(words[0], [&] {
      for (const rosgraph_msgs::Log& line : lines_) {
        bool has_all = line.level == level;
        for (const std::string& word : words) has_all = has_all && line.msg.find(word) != std::string::npos;
        if (has_all) return true;
      }
      return false;
    });
  }

  /// Lines of this level that have `word`.
  std::size_t count(int level, const std::string& word) const {
    std::size_t count = 0;
    for (const rosgraph_msgs::Log& line : lines_)
      count += line.level == level && line.msg.find(word) != std::string::npos;
    return count;
  }

 private:
  explicit Log(BaseClient& base) {
    subscriber_ = node_.subscribe<rosgraph_msgs::Log>("/rosout", 1000, [this](const auto& line) {
      if (line->name == "/base_node" || line->name == "/manager") lines_.push_back(*line);
    });
    // It is heard when it answers: an empty command is warned about.
    wait_for("a line of the base in the log", [&] {
      base.command(brics_actuator::JointVelocities());
      return !lines_.empty();
    });
  }

  ros::NodeHandle node_;
  ros::Subscriber subscriber_;
  std::vector<rosgraph_msgs::Log> lines_;
};

}  // namespace youbot_base_sim
