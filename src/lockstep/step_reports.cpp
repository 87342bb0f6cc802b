#include "youbot_base_sim/lockstep/step_reports.h"

#include <ros/console.h>
#include <ros/message_event.h>
#include <ros/names.h>
#include <std_msgs/Time.h>

#include <algorithm>
#include <map>
#include <utility>

namespace youbot_base_sim {

namespace {

constexpr auto kSilence = std::chrono::milliseconds(250);  // after which no report is under way

class StepReports : public TimeGate {
 public:
  StepReports(ros::NodeHandle& node, const std::vector<std::string>& nodes, std::chrono::duration<double> patience,
              const std::function<void(const ros::Time& time)>& send)
      : patience_(patience), send_(send) {
    for (const std::string& name : nodes) nodes_[ros::names::resolve(name)];
    using Event = const ros::MessageEvent<const std_msgs::Time>&;
    const auto take = [this](Event event) { report(event.getPublisherName(), event.getMessage()->data); };
    reports_ = node.subscribe<std_msgs::Time, Event>("step_done", 1000, take, {}, ros::TransportHints().tcpNoDelay());
  }

  bool is_ready() const override { return is_ready_; }
  void note_message(const std::string& node) override { report(node, announced_); }

  void announce(const ros::Time& time) override {
    if (time == announced_) return send_(time);  // to a newcomer
    if (time < announced_) {                     // a new start
      is_ready_ = false;
      for (auto& [name, node] : nodes_) node.done = {};
    }
    ++steps_;
    announced_ = time;
    if (is_ready_) waiting_since_ = Clock::now();
    send_(time);
  }

  bool await_rest() override {
    const bool is_late = Clock::now() >= waiting_since_ + patience_;
    bool all_done = true, all_have_come = true;
    for (auto& [name, node] : nodes_) {
      if (node.done >= announced_ || node.given_up) continue;
      all_have_come = all_have_come && !node.done.isZero();
      all_done = all_done && is_late;
      if (!is_late) continue;
      ROS_WARN("%s has not reported for %g s that it is done with t = %.9g s: time %s", name.c_str(), patience_.count(),
               announced_.toSec(), is_ready_ ? "no longer waits for it" : "waits for it");
      if (is_ready_) given_up_.insert(name);
      node.given_up = is_ready_;
    }
    const bool was_ready = is_ready_;
    is_ready_ = was_ready || (all_have_come && Clock::now() >= last_report_.second + kSilence);
    if (is_late && all_have_come && !is_ready_)
      ROS_WARN("%s reports without a pause: time waits until all are silent for a while", last_report_.first.c_str());
    if (is_late || is_ready_ != was_ready) waiting_since_ = Clock::now();
    return was_ready ? all_done : is_ready_ || !all_have_come;  // time may wake those that have not come
  }

 private:
  using Clock = std::chrono::steady_clock;

  struct Node {
    ros::Time done;            // zero: it has not come
    Clock::duration waited{};  // for all reports
    bool given_up = false;
  };

  void report(const std::string& name, const ros::Time& time) {
    if (nodes_.count(name) == 0) return;
    Node& node = nodes_[name];
    last_report_ = {name, Clock::now()};
    if (is_ready_ && time >= announced_ && node.done < announced_) node.waited += last_report_.second - waiting_since_;
    node.done = std::max(node.done, time);
    if (time >= announced_ && std::exchange(node.given_up, false))
      ROS_WARN("%s reports again: time waits for it", name.c_str());
  }

  std::pair<std::string, double> slowest() const override { return slowest_of(nodes_); }

  const std::chrono::duration<double> patience_;
  const std::function<void(const ros::Time& time)> send_;
  std::map<std::string, Node> nodes_;  // by name
  bool is_ready_ = false;
  ros::Time announced_;
  std::pair<std::string, Clock::time_point> last_report_;
  Clock::time_point waiting_since_ = Clock::now();
  ros::Subscriber reports_;
};

}  // namespace

std::unique_ptr<TimeGate> make_step_reports(ros::NodeHandle& node, const std::vector<std::string>& nodes,
                                            std::chrono::duration<double> patience,
                                            const std::function<void(const ros::Time& time)>& send) {
  return std::make_unique<StepReports>(node, nodes, patience, send);
}

}  // namespace youbot_base_sim
