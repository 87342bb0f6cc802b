#include "youbot_base_sim/ros/wait_notice.h"

#include <ros/console.h>

namespace youbot_base_sim {

namespace {

constexpr auto kFirst = std::chrono::seconds(1);
constexpr auto kNext = std::chrono::seconds(10);

}  // namespace

void WaitNotice::waits_for(const std::string& what) {
  const auto now = Clock::now();
  if (what_.empty()) due_ = now + kFirst;
  what_ = what;
  if (now < due_) return;
  due_ = now + kNext;
  ROS_INFO_STREAM(what_);
}

}  // namespace youbot_base_sim
