#pragma once

#include <string>

#include "youbot_base_sim/physics/state.h"

namespace youbot_base_sim {

constexpr char kOdometryFrame[] = "odom";        ///< as the driver's
constexpr char kBaseFrame[] = "base_footprint";  ///< as the driver's; over O, the geometric centre of the base
constexpr char kWorldFrame[] = "world";          ///< the fixed frame of the scene
constexpr char kBaseLinkFrame[] = "base_link";   ///< as the driver's

/// The names of the frames in messages: the driver's, or those of one of several robots.
struct FrameNames {
  std::string prefix;                 ///< of the links' names: empty, or with a slash at its end
  std::string odom = kOdometryFrame;  ///< where wheel odometry began
  std::string base = kBaseFrame;      ///< over O; its pose in `odom` is that of wheel odometry
  std::string world = kWorldFrame;    ///< the fixed frame of the scene, which robots share
  std::string truth = std::string("ground_truth/") + kBaseFrame;  ///< where the base is
  std::string map = {};  ///< another name of `world` in what is asked of the node; empty: none

  /// The frames of the robot with this prefix, as robot_state_publisher adds it. A name that begins with a slash goes
  /// without it. `world` never has it.
  static FrameNames of(const std::string& tf_prefix, const std::string& odom, const std::string& base,
                       const std::string& world) {
    const auto without_slash = [](const std::string& name) { return name.front() == '/' ? name.substr(1) : name; };
    const std::string prefix = tf_prefix.empty() ? "" : without_slash(tf_prefix) + "/";
    const auto prefixed = [&](const std::string& name) {
      return name.front() == '/' ? without_slash(name) : prefix + name;
    };
    return {prefix, prefixed(odom), prefixed(base), without_slash(world),
            prefix + "ground_truth/" + without_slash(base)};
  }

  std::string base_link() const { return prefix + kBaseLinkFrame; }
  std::string imu_link() const { return prefix + "imu_link"; }
  std::string wheel_link(int i) const { return prefix + "wheel_link_" + kWheelNames[i]; }
};

}  // namespace youbot_base_sim
