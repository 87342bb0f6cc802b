#include "youbot_base_sim/ros/node_clock.h"

#include <ros/master.h>
#include <std_srvs/Empty.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {

namespace {

constexpr double kMaxLag = 1.0;                                 // s of wall time, before the loop stops catching up
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

NodeClock::NodeClock(const BaseSettings& settings, BaseLoop& loop, Publications& publications,
                     const std::atomic<bool>& stop)
    : settings_(settings),
      loop_(loop),
      publications_(publications),
      paced_(settings.lockstep.on || settings.real_time_factor > 0),
      follows_(!settings.publish_clock && ros::Time::isSimTime()),
      lockstep_(settings.lockstep, loop.control_period()) {
  if (!lockstep_.awaits_rest()) return;
  followers_.emplace(std::chrono::milliseconds(std::llround(1e3 * settings.lockstep.timeout)), stop);
}

// Latched, so that a node that comes while time stands still knows the time at once. As a publisher it subscribes too,
// to know of others; it takes no message.
void NodeClock::connect(ros::NodeHandle& node) {
  if (settings_.publish_clock) {
    publications_.advertise<rosgraph_msgs::Clock>(node, kClockTopic, kRecorderQueueSize, true,
                                                  [this](const std::string& name, bool comes) {
                                                    if (!followers_) return;
                                                    comes ? followers_->add(name) : followers_->remove(name);
                                                  });
  }
  if (!settings_.publish_clock && !follows_) return;
  auto options = ros::SubscribeOptions::create<rosgraph_msgs::Clock>(
      kClockTopic, 1, [this](const auto& message) { take_time(*message); }, {},
      settings_.publish_clock ? &unread_ : node.getCallbackQueue());
  options.transport_hints = ros::TransportHints().tcpNoDelay();
  clock_subscriber_ = node.subscribe(options);
}

/// Another node's time wakes the loop. Where it goes back, the simulation goes on from there.
void NodeClock::take_time(const rosgraph_msgs::Clock& message) {
  if (message.clock < latest_) {
    ROS_WARN("/clock goes back from %g s to %g s: the simulation goes on", latest_.toSec(), message.clock.toSec());
    zero_ += message.clock - latest_;
  }
  latest_ = message.clock;
}

std::string NodeClock::rivals() const {
  if (clock_subscriber_.getNumPublishers() < 2) return "";
  XmlRpc::XmlRpcValue request, response, state;
  request[0] = ros::this_node::getName();
  std::string names;
  if (!ros::master::execute("getSystemState", request, response, state, false)) return "nodes unknown";
  for (int k = 0; k < state[0].size(); ++k) {
    if (static_cast<std::string>(state[0][k][0]) != kClockTopic) continue;
    for (int i = 0; i < state[0][k][1].size(); ++i) {
      names += (i ? ", " : "") + static_cast<std::string>(state[0][k][1][i]);
    }
  }
  return names;
}

void NodeClock::announce() {
  publications_.publish(kClockTopic, [this] {
    rosgraph_msgs::Clock message;
    message.clock = stamp(loop_.time());
    return message;
  });
}

void NodeClock::start() {
  latest_ = ros::Time::now();
  zero_ = latest_ - ros::Time();
  start_ = SteadyClock::now();
  start_t_ = loop_.time();
  running_ = true;
}

void NodeClock::reset() {
  lockstep_ = Lockstep(settings_.lockstep, loop_.control_period());
  start();
}

bool NodeClock::wants_each_period() const {
  if (!settings_.publish_clock || lockstep_.awaits_rest()) return false;
  return paced_ || publications_.heard(kRollerSwitchesTopic) || publications_.heard(kClockTopic);
}

/// Simulated time that is due now by a clock, s.
double NodeClock::due() const {
  if (!running_) return loop_.time();
  if (follows_) return (latest_ - ros::Time() - zero_).toSec();
  return start_t_ + settings_.real_time_factor * since(start_);
}

// How long another node's clock takes is not known: its next message wakes the loop.
double NodeClock::wait_for(double t) const {
  constexpr double kRounding = 5e-10;  // of /clock, s
  if (follows_) return t <= due() + kRounding ? 0 : std::numeric_limits<double>::infinity();
  return settings_.real_time_factor == 0 ? 0 : (t - due()) / settings_.real_time_factor;
}

double NodeClock::arrive() {
  if (settings_.real_time_factor == 0) return 0;
  const double t = loop_.time(), lag = (due() - t) / settings_.real_time_factor;
  if (lag <= (settings_.lockstep.on ? 0 : kMaxLag)) {
    ++timing_.instants;
    timing_.lateness += lag;
    timing_.max_lateness = std::max(timing_.max_lateness, lag);
    return 0;
  }
  timing_.lost += lag;
  start_ = SteadyClock::now();
  start_t_ = t;
  if (settings_.lockstep.on) return 0;  // time that it waited for others
  zero_ += ros::Duration(lag);
  loop_.bring_requests_forward();
  return lag;
}

NodeClock::Timing NodeClock::take_timing() {
  Timing taken = std::exchange(timing_, {});
  const double passed = since(timing_start_);
  taken.busy += since(awake_since_);
  timing_start_ = awake_since_ = SteadyClock::now();
  if (taken.instants > 0) taken.lateness /= static_cast<double>(taken.instants);
  if (passed > 0) {
    taken.busy /= passed;
    taken.speed = std::max(0.0, loop_.time() - timing_start_t_) / passed;  // after a reset it is not known
  }
  timing_start_t_ = loop_.time();
  return taken;
}

// With nothing to keep pace with, a /clock message each control period would cost more than the simulation itself.
void NodeClock::begin_publishing(bool is_due, bool switched) {
  if (!lockstep_.awaits_rest() && (paced_ || is_due || switched)) announce();
}

void NodeClock::end_publishing() {
  if (lockstep_.awaits_rest() && lockstep_.begins(loop_.periods())) publish_period();
}

/// In lockstep with nodes that rest, /clock advances once all else has arrived.
void NodeClock::publish_period() {
  followers_->await_rest();
  announce();
  followers_->let_clock_arrive();
}

ros::Time NodeClock::stamp(double t) const {
  return settings_.publish_clock ? stamp_of(lockstep_.idle_time() + t) : ros::Time() + (zero_ + ros::Duration(t));
}

double NodeClock::arrival() const {
  if (!settings_.publish_clock) return std::max(loop_.time(), due());
  const std::int64_t k = loop_.periods();
  if (!lockstep_.awaits_rest() || lockstep_.waits(k)) return loop_.time();
  // Within a period messages act from the next on.
  return static_cast<double>(k + lockstep_.left(k)) * loop_.control_period();
}

TimeServices::TimeServices(ros::NodeHandle& private_node, ros::CallbackQueue& queue, bool paused, const BaseLoop& loop,
                           NodeClock& clock, const std::function<void()>& reset, const std::function<void()>& end)
    : loop_(loop), loop_queue_(queue), step_node_(private_node), paused_(paused) {
  const auto offer = [&](const char* service, const std::function<void()>& serve) {
    return private_node.advertiseService<std_srvs::Empty::Request, std_srvs::Empty::Response>(
        service, [serve](auto&, auto&) { return serve(), true; });
  };
  const auto set_paused = [this, &clock](bool value) {
    end_step(value ? "ended by ~pause" : "ended by ~unpause");
    paused_ = value;
    if (value) return;
    clock.lockstep().start();
    clock.start();
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
