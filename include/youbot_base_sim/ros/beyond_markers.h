#pragma once

#include <youbot_base_sim/ContactsStamped.h>

#include <string>
#include <utility>
#include <vector>

#include "youbot_base_sim/ros/markers.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// What rviz shows of the physics beyond the paper, where a scene or the node's user asks for any; otherwise nothing.
/// Namespaces: `normal_reactions` (blue arrows, and `off_floor` over wheels that have lifted off), `slope` (an arrow
/// uphill), `patches` (blue: slippery, orange: rough; they fade over their soft edges), `loads` (boxes of 2500 kg/m^3
/// at most half a metre wide, and a stick to the height of the axles), `wrenches` (thick turquoise arrows that end
/// where the force acts, arcs for torques).
class BeyondMarkers {
 public:
  /// Arrows of forces have `force_scale` m/N; `world_frame`: of patches, none are shown if it is empty.
  void add_to(Markers& markers, const ContactsStamped& contacts, const Simulation& simulation, double force_scale,
              const std::string& world_frame);

  /// Lines for the legend, of what can be seen.
  static std::vector<std::pair<std::string, std_msgs::ColorRGBA>> legend(const Simulation& simulation,
                                                                         double force_scale);

  /// A warning for the status, such as that the base is at its tipping limit; empty: none.
  static std::string warning(const Simulation& simulation);

 private:
  void add_loads(Markers& markers, const std::vector<Load>& loads);
  void add_wrenches(Markers& markers, const Simulation& simulation, double force_scale);

  int max_loads_shown_ = 0, max_wrenches_shown_ = 0;  // that were shown: what has gone is deleted
};

}  // namespace youbot_base_sim
