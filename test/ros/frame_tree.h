#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <map>
#include <set>
#include <string>

namespace youbot_base_sim {

/// The frames on /tf and /tf_static, or of messages, with all parents that each is given.
class FrameTree {
 public:
  void listen() {
    for (const char* topic : {"/tf", "/tf_static"}) {
      subscribers_.push_back(
          node_.subscribe<tf2_msgs::TFMessage>(topic, 1000, [this](const auto& message) { add(*message); }));
    }
  }

  void add(const tf2_msgs::TFMessage& message) {
    for (const auto& one : message.transforms) parents_[one.child_frame_id].insert(one.header.frame_id);
  }

  bool has(const std::string& frame) const { return parents_.count(frame) > 0; }

  /// Each frame has one parent, and all hang on `root`.
  void expect_whole(const std::string& root) const {
    for (const auto& [frame, parents] : parents_) {
      EXPECT_EQ(parents.size(), 1u) << frame << " below " << fmt::format("{}", fmt::join(parents, " and "));
      std::string above = frame;
      for (std::size_t k = 0; k <= parents_.size() && has(above); ++k) above = *parents_.at(above).begin();
      EXPECT_EQ(above, root) << "above " << frame;
    }
  }

 private:
  ros::NodeHandle node_;
  std::vector<ros::Subscriber> subscribers_;
  std::map<std::string, std::set<std::string>> parents_;
};

}  // namespace youbot_base_sim
