#pragma once

#include <visualization_msgs/MarkerArray.h>
#include <youbot_base_sim/ContactsStamped.h>

#include <cstdint>
#include <string>

#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// How contacts are drawn.
struct MarkerOptions {
  double friction_scale = 3e-3;  ///< length of an arrow, m/N
  double slip_scale = 2;         ///< likewise, m for each m/s
  std::string frame;             ///< that of the base; empty: the contacts'
  std::string roller_mesh;       ///< URI; empty: rollers in contact are not coloured
};

/// Arrows end at this length, m: those of a wheel that spins freely would leave the picture.
constexpr double kMaxArrow = 0.4;

/// A contact whose friction has this share of its limit or more is drawn as saturated.
constexpr double kSaturated = 0.99;

/// The contacts for rviz. Namespaces: `contact_points`, `friction` (yellow arrows, on the base) and `slip` (violet
/// ones), `rollers` (those in contact, green; red where friction is saturated, as are its point), `status` (simulated
/// time, `real_time_factor`, switches so far), `legend`. `contacts` are those of the simulation.
visualization_msgs::MarkerArray contact_markers(const ContactsStamped& contacts, const Simulation& simulation,
                                                double real_time_factor, const MarkerOptions& options);

}  // namespace youbot_base_sim
