#pragma once

#include <gtest/gtest.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <cstdio>
#include <cstring>
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

/// Calls a service; false where it fails. The link is one that lasts: where the server closes it after the answer,
/// roscpp loses one answer in some thousands on a busy machine (ros_comm, issue 1976).
template <class Service>
bool call_service(const std::string& name, Service& service) {
  return ros::service::createClient<Service>(name, /*persistent=*/true).call(service);
}

/// Runs the tests of a rostest. For rostest, a run without tests, as by a filter that is misspelt, is a success, but
/// one without results is none.
inline int run_rostest(int argc, char** argv) {
  ros::init(argc, argv, "rostest");
  const ros::NodeHandle keep_alive;
  testing::InitGoogleTest(&argc, argv);
  const int failures = RUN_ALL_TESTS();
  if (testing::UnitTest::GetInstance()->test_to_run_count() == 0)
    std::remove(testing::GTEST_FLAG(output).substr(std::strlen("xml:")).c_str());
  ros::shutdown();  // before static objects go, which roscpp's threads make use of
  return failures;
}

}  // namespace youbot_base_sim
