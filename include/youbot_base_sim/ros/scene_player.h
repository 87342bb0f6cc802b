#pragma once

#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <memory>
#include <set>
#include <string>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The parameters of play_scene.
struct PlayerSettings {
  Scene scene;
  /// s of wall time for base_node to come. 0: for ever.
  double timeout = 0;
};

/// Reads them from the private parameters `scene`, `model`, `duration` (s, in place of the scene's) and
/// `lockstep_timeout`. Throws ParameterError if one is bad, if the scene has no drive, or if /use_sim_time is not true.
PlayerSettings read_player_settings();

/// Plays a scene's drive into base_node: answers each /clock message with the commands for the control period that
/// begins at its time.
class ScenePlayer {
 public:
  explicit ScenePlayer(const PlayerSettings& settings);

  /// Plays until the clock has reached the scene's duration. Throws std::runtime_error if base_node does not come, or
  /// if it or ROS goes before.
  void run();

 private:
  void take_time(const ros::MessageEvent<const rosgraph_msgs::Clock>& event);
  void gain(const ros::SingleSubscriberPublisher& subscriber) { listeners_.insert(subscriber.getSubscriberName()); }
  void lose(const ros::SingleSubscriberPublisher& subscriber);
  void command(double t);

  const Scene scene_;
  const double timeout_;                   // s
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

}  // namespace youbot_base_sim
