#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <youbot_base_sim/Step.h>

#include <atomic>
#include <cstdint>
#include <future>
#include <memory>
#include <string>

namespace youbot_base_sim {

/// The service ~step. Its answer waits until the loop has gone on by all periods asked for, so it runs in a thread of
/// its own. The loop takes the request from its own callback queue, as everything else, and goes on serving that queue
/// between two parts of the step. One request is under way at a time; others wait for it.
class StepService {
 public:
  /// Offers the service. Requests reach the loop through `loop_queue`, which must outlive this.
  explicit StepService(ros::CallbackQueue& loop_queue);
  ~StepService();
  StepService(const StepService&) = delete;
  StepService& operator=(const StepService&) = delete;

  // The rest is for the loop's thread.

  /// Whether a request waits for its answer.
  bool asked() const { return answer_ != nullptr; }

  /// Control periods that the request still asks for.
  std::int64_t left() const { return left_; }

  /// The loop has gone on by some of them, to time t (s). Answers the request if they were the last.
  void advanced(std::int64_t periods, double t);

  /// Answers that the request has ended, or is refused, at time t (s), and why.
  void end(const std::string& reason, double t);

 private:
  bool serve(Step::Request& request, Step::Response& response);
  void answer(bool success, const std::string& message, double t);

  ros::CallbackQueue& loop_queue_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_{"~"};
  ros::ServiceServer server_;
  ros::AsyncSpinner spinner_{1, &queue_};
  std::atomic<bool> closing_{false};
  std::shared_ptr<std::promise<Step::Response>> answer_;  // null: no request is under way
  std::int64_t left_ = 0;
};

}  // namespace youbot_base_sim
