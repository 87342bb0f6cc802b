#include "youbot_base_sim/ros/step_service.h"

#include <boost/make_shared.hpp>
#include <chrono>
#include <functional>
#include <utility>

#include "youbot_base_sim/ros/node_constants.h"

namespace youbot_base_sim {

namespace {

constexpr auto kPatience = std::chrono::milliseconds(100);  // between two looks whether there will be an answer

/// Has the loop call a function where it takes its callbacks.
class LoopCallback : public ros::CallbackInterface {
 public:
  explicit LoopCallback(std::function<void()> function) : function_(std::move(function)) {}
  CallResult call() override {
    function_();
    return Success;
  }

 private:
  std::function<void()> function_;
};

}  // namespace

StepService::StepService(ros::CallbackQueue& loop_queue) : loop_queue_(loop_queue) {
  node_.setCallbackQueue(&queue_);
  server_ = node_.advertiseService(kStepService, &StepService::serve, this);
  spinner_.start();
}

StepService::~StepService() {
  closing_ = true;
  spinner_.stop();
}

bool StepService::serve(Step::Request& request, Step::Response& response) {
  const auto answer = std::make_shared<std::promise<Step::Response>>();
  std::future<Step::Response> answered = answer->get_future();
  loop_queue_.addCallback(boost::make_shared<LoopCallback>([this, answer, periods = request.periods] {
    answer_ = answer;
    left_ = periods;
  }));
  while (answered.wait_for(kPatience) != std::future_status::ready) {
    if (closing_ || !ros::ok()) return false;
  }
  response = answered.get();
  return true;
}

void StepService::advanced(std::int64_t periods, double t) {
  left_ -= periods;
  if (left_ == 0) answer(true, "", t);
}

void StepService::end(const std::string& reason, double t) {
  if (asked()) answer(false, reason, t);
}

void StepService::answer(bool success, const std::string& message, double t) {
  Step::Response response;
  response.success = success;
  response.message = message;
  response.t = t;
  answer_->set_value(response);
  answer_.reset();
}

}  // namespace youbot_base_sim
