#pragma once

#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>

#include <array>
#include <cstddef>
#include <string>

#include "youbot_base_sim/ros/frame_names.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// Settings of the drawing of contacts.
struct MarkerOptions {
  double friction_scale = 3e-3;                    ///< length of an arrow of any force, m/N
  double slip_scale = 2;                           ///< of an arrow of any slip, m for each m/s
  std::string frame;                               ///< the base's; empty: the contacts'
  std::string world_frame;                         ///< the scene's; empty: what lies on the floor is not shown
  std::array<std::string, kWheels> roller_meshes;  ///< URIs; empty: rollers in contact are not coloured
};

/// The options for a robot: with its meshes, and with the base where it is in the scene's frame if TF has that.
MarkerOptions marker_options(const RobotParameters& robot, bool has_world, const FrameNames& frames = {});

/// The length at which arrows end, m: those of a spinning wheel would leave the picture.
constexpr double kMaxArrow = 0.4;

/// The contacts for rviz, and what is beyond the paper where a simulation has it: docs/rviz.md lists the namespaces.
class ContactMarkers {
 public:
  explicit ContactMarkers(const MarkerOptions& options) : options_(options) {}

  /// `contacts` are those of the simulation now.
  visualization_msgs::MarkerArray at(const ContactsStamped& contacts, const Simulation& simulation);

 private:
  MarkerOptions options_;
  std::size_t most_loads_ = 0, most_wrenches_ = 0;  // shown so far: what has gone is deleted
};

}  // namespace youbot_base_sim
