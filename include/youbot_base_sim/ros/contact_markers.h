#pragma once

#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>

#include <cstddef>
#include <optional>
#include <string>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// How contacts are drawn.
struct MarkerOptions {
  double friction_scale = 3e-3;  ///< length of an arrow of any force, m/N
  double slip_scale = 2;         ///< of an arrow of any slip, m for each m/s
  std::string frame;             ///< that of the base; empty: the contacts'
  std::string world_frame;       ///< that of the scene; empty: what lies on the floor is not shown
  std::string roller_mesh;       ///< URI; empty: rollers in contact are not coloured
};

/// The options for a robot: with its meshes, and with the base where it is in the scene's frame if TF has that.
MarkerOptions marker_options(const RobotParameters& robot, bool has_world);

/// Arrows end at this length, m: those of a wheel that spins freely would leave the picture.
constexpr double kMaxArrow = 0.4;

/// The contacts for rviz. Namespaces: `contact_points`, `friction` (yellow arrows, on the base) and `slip` (violet
/// ones), `rollers` (those in contact, green; red where friction is saturated, as are its point), `status` (simulated
/// time, switches so far), `legend`.
///
/// Of the physics beyond the paper, where a scene or the node's user asks for any: `normal_reactions` (blue arrows, and
/// `off_floor` over wheels that have lifted off), `slope` (an arrow uphill), `patches` (blue: slippery, orange: rough;
/// they fade over their soft edges), `loads` (boxes of 2500 kg/m^3 at most half a metre wide, and a stick to the height
/// of the axles), `wrenches` (thick turquoise arrows that end where the force acts, arcs for torques).
class ContactMarkers {
 public:
  explicit ContactMarkers(const MarkerOptions& options) : options_(options) {}

  /// `contacts` are those of the simulation now.
  visualization_msgs::MarkerArray at(const ContactsStamped& contacts, const Simulation& simulation);

 private:
  MarkerOptions options_;
  std::size_t most_loads_ = 0, most_wrenches_ = 0;  // that were shown: what has gone is deleted
};

}  // namespace youbot_base_sim
