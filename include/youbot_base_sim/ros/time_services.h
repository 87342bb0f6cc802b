#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>
#include <youbot_base_sim/Step.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// The services of simulated time: ~pause, ~unpause, ~reset (std_srvs/Empty) and ~step (youbot_base_sim/Step).
///
/// The loop serves them where it takes its callbacks, between control periods. The answer of ~step waits until the loop
/// has advanced by all periods asked for, so that service runs in a thread of its own: its request reaches the loop
/// through the loop's own callback queue, which the loop serves between two parts of the step. One step is under way at
/// a time; others wait for it.
class TimeServices {
 public:
  struct Loop {
    std::function<double()> time;   ///< simulated time, s
    std::function<void()> restart;  ///< time advances from now on, after a pause
    std::function<bool()> reset;    ///< back to t = 0; false: refused
  };

  /// Offers the services, in the private namespace. `queue`, the loop's, must outlive this.
  TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, Loop loop);
  ~TimeServices();
  TimeServices(const TimeServices&) = delete;
  TimeServices& operator=(const TimeServices&) = delete;

  // The rest is for the loop's thread.

  /// Whether time stands still but for steps.
  bool paused() const { return paused_; }

  /// Whether a step is under way, and by how many control periods it still is to advance.
  bool stepping() const { return answer_ != nullptr; }
  std::int64_t left() const { return left_; }

  /// The loop has advanced by some of them. Answers the request if they were the last.
  void advanced(std::int64_t periods);

  /// Answers that the step has ended, or is refused, and why.
  void end_step(const std::string& reason);

 private:
  bool pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&);
  bool step(Step::Request& request, Step::Response& response);
  void answer(bool success, const std::string& message);

  Loop loop_;
  ros::CallbackQueue& loop_queue_;
  ros::CallbackQueue step_queue_;
  ros::NodeHandle step_node_{"~"};
  std::vector<ros::ServiceServer> servers_;
  ros::AsyncSpinner spinner_{1, &step_queue_};
  std::atomic<bool> closing_{false};
  std::shared_ptr<std::promise<Step::Response>> answer_;  // null: no step is under way
  std::int64_t left_ = 0;
  bool paused_;
};

}  // namespace youbot_base_sim
