#pragma once

#include <cstdint>

namespace youbot_base_sim {

/// Rollers that a wheel may pass in a second before its switches are counted rather than located, and its contact is
/// averaged over a roller. Real bases pass fewer than 20.
constexpr double kMaxLocatedRate = 500;

/// One roller taking over from another: located exactly, or one record for many switches of a wheel that passes rollers
/// faster than anybody could use one by one.
struct RollerSwitch {
  double t;                ///< when it happened, s; of many, when the last one was noticed
  int wheel;               ///< 0..3: fl, fr, bl, br
  int roller_from;         ///< 0..n-1
  int roller_to;           ///< 0..n-1
  double phi;              ///< wheel angle, on the far side of the edge, rad
  int direction;           ///< +1 or -1: sign of the wheel's rotation
  std::int64_t count = 1;  ///< switches that this record stands for; 1: a located one
};

}  // namespace youbot_base_sim
