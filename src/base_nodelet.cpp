// The simulated base as a nodelet: the other nodelets of its manager get its messages without a copy.

#include <nodelet/nodelet.h>

#include <atomic>
#include <functional>
#include <pluginlib/class_list_macros.hpp>
#include <thread>

#include "youbot_base_sim/ros/base_node.h"

namespace youbot_base_sim {

class BaseNodelet : public nodelet::Nodelet {
 public:
  ~BaseNodelet() override {
    stop_ = true;
    if (loop_.joinable()) loop_.join();
  }

 private:
  /// Loading fails if this throws; the manager then says no reason.
  void onInit() override {
    try {
      run_base_ = make_base_node(getNodeHandle(), getPrivateNodeHandle(), stop_);
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(error.what());
      throw;
    }
    loop_ = std::thread([this] { run(); });
  }

  void run() {
    try {
      run_base_();
    } catch (const std::exception& error) {
      NODELET_FATAL_STREAM(error.what());
    }
    run_base_ = {};  // with its topics and services
    if (!stop_) NODELET_INFO("%s has ended, and stays loaded until it is unloaded", getName().c_str());
  }

  std::atomic<bool> stop_{false};
  std::function<void()> run_base_;
  std::thread loop_;
};

}  // namespace youbot_base_sim

PLUGINLIB_EXPORT_CLASS(youbot_base_sim::BaseNodelet, nodelet::Nodelet)
