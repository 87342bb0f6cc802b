#pragma once

#include <gtest/gtest.h>
#include <ros/ros.h>

/// The main function of a rostest.
#define YOUBOT_BASE_SIM_ROSTEST_MAIN()                                                  \
  int main(int argc, char** argv) {                                                     \
    ros::init(argc, argv, "rostest");                                                   \
    const ros::NodeHandle keep_alive;                                                   \
    ::testing::InitGoogleTest(&argc, argv);                                             \
    const int failures = RUN_ALL_TESTS();                                               \
    ros::shutdown(); /* before static objects go, which roscpp's threads make use of */ \
    return failures;                                                                    \
  }
