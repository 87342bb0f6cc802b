#pragma once

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <functional>
#include <stdexcept>
#include <string>

namespace youbot_base_sim {

/// Handles messages until `happened`. Nothing here sleeps: the limit only ends a test that has failed.
inline void wait_for(const std::string& what, const std::function<bool()>& happened) {
  const auto limit = ros::WallTime::now() + ros::WallDuration(20);
  while (!happened()) {
    if (!ros::ok() || ros::WallTime::now() > limit) throw std::runtime_error("waited in vain for " + what);
    ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.01));
  }
}

}  // namespace youbot_base_sim

/// The main function of a rostest.
#define YOUBOT_BASE_SIM_ROSTEST_MAIN()                                                                              \
  int main(int argc, char** argv) {                                                                                 \
    ros::init(argc, argv, "rostest");                                                                               \
    const ros::NodeHandle keep_alive;                                                                               \
    ::testing::InitGoogleTest(&argc, argv);                                                                         \
    const bool none = ::testing::UnitTest::GetInstance()->test_to_run_count() == 0;                                 \
    const int failures = RUN_ALL_TESTS() + none; /* a filter may be misspelt */                                     \
    ros::shutdown();                             /* before static objects go, which roscpp's threads make use of */ \
    return failures;                                                                                                \
  }
