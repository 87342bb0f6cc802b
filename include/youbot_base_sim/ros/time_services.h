#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/Step.h>

#include <atomic>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/ros/node_clock.h"

namespace youbot_base_sim {

/// The services of simulated time: ~pause, ~unpause, ~reset, ~end (std_srvs/Empty) and ~step (youbot_base_sim/Step),
/// unless time is another's.
///
/// The loop serves them with its callbacks, between control periods. ~step answers only once the loop has advanced by
/// all its periods, so it has a thread of its own, which hands the request to the loop's callback queue. Several steps
/// run one after another.
class TimeServices {
 public:
  /// `reset` goes back to t = 0; it throws std::runtime_error, with a reason for the caller, if it refuses. `end` ends
  /// the node. `queue` is the loop's. All references must outlive this.
  TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, const BaseLoop& loop,
               NodeClock& clock, const std::function<void()>& reset, const std::function<void()>& end)
      : loop_(loop), loop_queue_(queue), step_node_(private_node), paused_(paused) {
    if (!clock.is_master()) return;
    const auto offer = [&](const char* service, const std::function<void()>& serve) {
      return private_node.advertiseService<std_srvs::Empty::Request, std_srvs::Empty::Response>(
          service, [serve](auto&, auto&) { return serve(), true; });
    };
    const auto set_paused = [this, &clock](bool value) {
      end_step(value ? "ended by ~pause" : "ended by ~unpause");
      paused_ = value;
      if (!value) clock.resume();
    };
    step_node_.setCallbackQueue(&step_queue_);
    servers_ = {offer("pause", [set_paused] { set_paused(true); }),
                offer("unpause", [set_paused] { set_paused(false); }), offer("reset", reset), offer("end", end),
                step_node_.advertiseService("step", &TimeServices::step, this)};
    spinner_.start();
  }
  ~TimeServices() {
    closing_ = true;
    spinner_.stop();
  }
  TimeServices(const TimeServices&) = delete;
  TimeServices& operator=(const TimeServices&) = delete;

  // The rest is for the loop's thread.

  /// True if time stands still but for steps.
  bool paused() const { return paused_; }

  /// True if a step is under way; then the control periods that it is still to advance.
  bool stepping() const { return answer_ != nullptr; }
  std::int64_t left() const { return left_; }

  /// The loop has advanced by some of them.
  void advanced(std::int64_t periods) { left_ -= periods; }

  /// Answers a request under way: the step is done, or `reason` says why it has ended early or is refused.
  void end_step(const std::string& reason = "") {
    if (!stepping()) return;
    Step::Response response;
    response.success = reason.empty();
    response.message = reason;
    response.t = loop_.time();
    answer_->set_value(response);
    answer_.reset();
  }

 private:
  /// A function for a callback queue.
  struct FunctionCallback : ros::CallbackInterface {
    explicit FunctionCallback(std::function<void()> called) : function(std::move(called)) {}
    CallResult call() override { return function(), Success; }

    std::function<void()> function;
  };

  /// Runs in a thread of its own.
  bool step(Step::Request& request, Step::Response& response) {
    const auto answer = std::make_shared<std::promise<Step::Response>>();
    std::future<Step::Response> answered = answer->get_future();
    loop_queue_.addCallback(boost::make_shared<FunctionCallback>([this, answer, periods = request.periods] {
      answer_ = answer;
      left_ = periods;
    }));
    while (answered.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready) {
      if (closing_ || ros::isShuttingDown()) return false;  // which waits for this thread before ros::ok is false
    }
    response = answered.get();
    return true;
  }

  const BaseLoop& loop_;
  ros::CallbackQueue& loop_queue_;
  ros::CallbackQueue step_queue_;
  ros::NodeHandle step_node_;
  std::vector<ros::ServiceServer> servers_;
  ros::AsyncSpinner spinner_{1, &step_queue_};
  std::atomic<bool> closing_{false};
  std::shared_ptr<std::promise<Step::Response>> answer_;  // null: no step is under way
  std::int64_t left_ = 0;
  bool paused_;
};

}  // namespace youbot_base_sim
