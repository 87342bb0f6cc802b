#include "youbot_base_sim/ros/time_services.h"

#include <boost/make_shared.hpp>
#include <chrono>
#include <utility>

#include "youbot_base_sim/ros/node_constants.h"

namespace youbot_base_sim {

namespace {

constexpr auto kPollInterval = std::chrono::milliseconds(100);  // between two looks whether there will be an answer

/// Makes the loop call a function where it takes its callbacks.
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

TimeServices::TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, Loop loop)
    : loop_(std::move(loop)), loop_queue_(queue), paused_(paused) {
  step_node_.setCallbackQueue(&step_queue_);
  servers_ = {private_node.advertiseService(kPauseService, &TimeServices::pause, this),
              private_node.advertiseService(kUnpauseService, &TimeServices::unpause, this),
              private_node.advertiseService(kResetService, &TimeServices::reset, this),
              step_node_.advertiseService(kStepService, &TimeServices::step, this)};
  spinner_.start();
}

TimeServices::~TimeServices() {
  closing_ = true;
  spinner_.stop();
}

bool TimeServices::pause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  end_step("ended by ~pause");
  paused_ = true;
  return true;
}

bool TimeServices::unpause(std_srvs::Empty::Request&, std_srvs::Empty::Response&) {
  end_step("ended by ~unpause");
  paused_ = false;
  loop_.restart();
  return true;
}

bool TimeServices::reset(std_srvs::Empty::Request&, std_srvs::Empty::Response&) { return loop_.reset(); }

/// Runs in a thread of its own.
bool TimeServices::step(Step::Request& request, Step::Response& response) {
  const auto answer = std::make_shared<std::promise<Step::Response>>();
  std::future<Step::Response> answered = answer->get_future();
  loop_queue_.addCallback(boost::make_shared<LoopCallback>([this, answer, periods = request.periods] {
    answer_ = answer;
    left_ = periods;
  }));
  while (answered.wait_for(kPollInterval) != std::future_status::ready) {
    if (closing_ || !ros::ok()) return false;
  }
  response = answered.get();
  return true;
}

void TimeServices::advanced(std::int64_t periods) {
  left_ -= periods;
  if (left_ == 0) answer(true, "");
}

void TimeServices::end_step(const std::string& reason) {
  if (stepping()) answer(false, reason);
}

void TimeServices::answer(bool success, const std::string& message) {
  Step::Response response;
  response.success = success;
  response.message = message;
  response.t = loop_.time();
  answer_->set_value(response);
  answer_.reset();
}

}  // namespace youbot_base_sim
