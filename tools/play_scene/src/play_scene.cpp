// Plays a scene's drive into base_node. Ends when the scene is over.

#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/ros/conversions.h"
#include "youbot_base_sim/ros/program.h"
#include "youbot_base_sim/ros/topics.h"
#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;

/// The latest time, s, that a clock of whole nanoseconds may round to this: misses no segment that begins with a
/// control period.
double latest_of(const ros::Time& clock) {
  const double t = time_of(clock) + 0.5e-9;
  return t + ControlTime::rounding(t);
}

/// The private parameters, by their names.
struct PlayerSettings {
  /// Throws ParameterError if one is bad.
  explicit PlayerSettings(Parameters parameters) {
    parameters.read("scene", scene, "a scene file, with a drive");
    parameters.read_choice("model", model, model_names());
    parameters.read("duration", duration, Range{1e-6, 1e9, "s"});
    parameters.read("lockstep_timeout", timeout, {1e-3, 1e6, "s", true});
    parameters.refuse_others();
  }

  std::string scene, model;
  std::optional<double> duration;  // s, in place of the scene's
  double timeout = 0;              // s of wall time for base_node to come; 0: for ever
};

/// Plays a scene's drive into base_node: answers each /clock message with the commands for the control period that
/// begins at its time.
class ScenePlayer {
 public:
  /// Throws ParameterError if one is bad, if the scene has no drive, or if /use_sim_time is not true.
  explicit ScenePlayer(const PlayerSettings& settings) : timeout_(settings.timeout) {
    if (settings.scene.empty()) throw ParameterError("parameter ~scene is missing: must be a scene file");
    const SceneSettings model = {{"model", settings.model, true}};
    try {
      scene_ = load_scene(settings.scene, settings.model.empty() ? SceneSettings() : model);
    } catch (const SceneError& error) {
      throw ParameterError(fmt::format("parameter ~scene: {}", error.what()));
    }
    if (std::holds_alternative<std::monostate>(scene_.drive)) {
      throw ParameterError(
          fmt::format("parameter ~scene: {}: drive is left out: there is nothing to play", quote_path(settings.scene)));
    }
    scene_.duration = settings.duration.value_or(scene_.duration);
    if (!ros::param::param("/use_sim_time", false)) {
      throw ParameterError("parameter /use_sim_time: must be true, play_scene goes by base_node's /clock");
    }
    torque_ = make_torque_profile(scene_);
    connect();
  }

  /// Plays until the clock has reached the scene's duration. Throws std::runtime_error if base_node does not come, or
  /// if it or ROS goes before.
  void run() {
    ROS_INFO("waiting for base_node: a /clock, and a subscriber of %s", commands_.getTopic().c_str());
    const ros::SteadyTime beginning = ros::SteadyTime::now();
    ros::SteadyTime start;
    while (latest_of(now_) < scene_.duration) {
      if (base_lost_) throw std::runtime_error(fmt::format("{} is gone at t = {} s", base_, time_of(now_)));
      if (!ros::ok()) throw std::runtime_error(fmt::format("interrupted at t = {} s", time_of(now_)));
      if (timeout_ > 0 && commanded_.isZero() && (ros::SteadyTime::now() - beginning).toSec() > timeout_) {
        throw std::runtime_error(
            fmt::format("no base_node for {:g} s: no /clock, or no subscriber of the commands", timeout_));
      }
      if (now_ != commanded_ && listeners_.count(base_)) {
        if (commanded_.isZero()) start = ros::SteadyTime::now();
        command();
        commanded_ = now_;
      }
      ros::getGlobalCallbackQueue()->callOne(ros::WallDuration(0.1));
    }
    const double wall_time = (ros::SteadyTime::now() - start).toSec();
    ROS_INFO("the scene is over at t = %g s, %.3g times real time", time_of(now_), time_of(now_) / wall_time);
    ros::WallDuration(0.5).sleep();  // lets what was published last arrive at a recorder before a launch file ends it
  }

 private:
  void connect() {
    const auto gain = [this](const ros::SingleSubscriberPublisher& listener) {
      listeners_.insert(listener.getSubscriberName());
    };
    const auto lose = [this](const ros::SingleSubscriberPublisher& listener) {
      listeners_.erase(listener.getSubscriberName());
      base_lost_ = base_lost_ || listener.getSubscriberName() == base_;
    };
    commands_ = torque_
                    ? node_.advertise<brics_actuator::JointTorques>(kTorqueTopic, kCommandQueueSize, gain, lose)
                    : node_.advertise<brics_actuator::JointVelocities>(kVelocityTopic, kCommandQueueSize, gain, lose);
    clock_ = node_.subscribe(kClockTopic, kCommandQueueSize, &ScenePlayer::take_time, this,
                             ros::TransportHints().tcpNoDelay());
  }

  void take_time(const ros::MessageEvent<const rosgraph_msgs::Clock>& event) {
    base_ = event.getPublisherName();
    now_ = event.getConstMessage()->clock;
  }

  void command() {
    const double in_period = latest_of(now_);
    if (torque_) {
      torque_->begin_segment(in_period);
      commands_.publish(torque_message(torque_->value(time_of(now_)), now_));
    } else {
      const WheelTable& rates = std::get<VelocityTable>(scene_.drive).table;
      commands_.publish(velocity_message(rates.at(in_period), now_));
    }
  }

  Scene scene_;
  const double timeout_;                   // as in PlayerSettings
  std::unique_ptr<TorqueProfile> torque_;  // null where the scene tracks velocities
  ros::NodeHandle node_;
  ros::Publisher commands_;
  ros::Subscriber clock_;
  ros::Time now_;        // zero: not known yet
  ros::Time commanded_;  // the time that the last command was for
  std::string base_;     // name of the node whose clock it is
  std::set<std::string> listeners_;
  bool base_lost_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  return run_program(
      argc, argv, "play_scene",
      [] {
        ScenePlayer(PlayerSettings({ros::NodeHandle("~"), "~"})).run();
      },
      "Plays a scene's drive into base_node in lockstep, as launch/paper_case.launch does.",
      [] { PlayerSettings(Parameters("~")); });
}
