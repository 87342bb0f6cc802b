#include "youbot_base_sim/ros/time_services.h"

#include <std_srvs/Empty.h>

#include <boost/make_shared.hpp>
#include <chrono>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kPollInterval = std::chrono::milliseconds(100);  // between two looks whether there will be an answer

/// A function for a callback queue.
struct FunctionCallback : ros::CallbackInterface {
  explicit FunctionCallback(std::function<void()> called) : function(std::move(called)) {}
  CallResult call() override {
    function();
    return Success;
  }

  std::function<void()> function;
};

}  // namespace

TimeServices::TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, const BaseLoop& loop,
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
  servers_ = {offer(kPauseService, [set_paused] { set_paused(true); }),
              offer(kUnpauseService, [set_paused] { set_paused(false); }), offer(kResetService, reset),
              offer(kEndService, end), step_node_.advertiseService(kStepService, &TimeServices::step, this)};
  spinner_.start();
}

TimeServices::~TimeServices() {
  closing_ = true;
  spinner_.stop();
}

/// Runs in a thread of its own.
bool TimeServices::step(Step::Request& request, Step::Response& response) {
  const auto answer = std::make_shared<std::promise<Step::Response>>();
  std::future<Step::Response> answered = answer->get_future();
  loop_queue_.addCallback(boost::make_shared<FunctionCallback>([this, answer, periods = request.periods] {
    answer_ = answer;
    left_ = periods;
  }));
  while (answered.wait_for(kPollInterval) != std::future_status::ready) {
    if (closing_ || ros::isShuttingDown()) return false;  // which waits for this thread before ros::ok is false
  }
  response = answered.get();
  return true;
}

void TimeServices::end_step(const std::string& reason) {
  if (!stepping()) return;
  Step::Response response;
  response.success = reason.empty();
  response.message = reason;
  response.t = loop_.time();
  answer_->set_value(response);
  answer_.reset();
}

}  // namespace youbot_base_sim
