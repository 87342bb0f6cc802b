#pragma once

#include <ros/ros.h>
#include <rosgraph_msgs/Clock.h>

#include <memory>
#include <set>
#include <string>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

/// The scene that play_scene is told to play, by the private parameters `scene`, `model` and `duration` (s, in place of
/// the scene's). Throws ParameterError if one is bad, if the scene has no drive, or if /use_sim_time is not true.
Scene read_scene_to_play();

/// Plays a scene's drive into base_node: answers each /clock message with the commands for the control period that
/// begins at its time.
class ScenePlayer {
 public:
  explicit ScenePlayer(const Scene& scene);

  /// Plays until the clock has reached the scene's duration. Throws std::runtime_error if base_node or ROS goes before.
  void run();

 private:
  void take_time(const ros::MessageEvent<const rosgraph_msgs::Clock>& event);
  void gain(const ros::SingleSubscriberPublisher& subscriber) { listeners_.insert(subscriber.getSubscriberName()); }
  void lose(const ros::SingleSubscriberPublisher& subscriber);
  void command(double t);

  const Scene scene_;
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
