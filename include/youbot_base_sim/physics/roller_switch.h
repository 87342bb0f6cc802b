#pragma once

#include <cstdint>

namespace youbot_base_sim {

/// Rollers that a wheel may pass in a second before its switches are counted rather than located, and its contact is
/// averaged over a roller. Real bases pass fewer than 20.
constexpr double kMaxLocatedRate = 500;

/// One roller taking over from another, or one record for several switches of a wheel that passes rollers too fast to
/// report them one by one.
struct RollerSwitch {
  /// s: located to 1e-12 s; interpolated in fallback steps; for an averaged contact, when it was noticed.
  double t;
  int wheel;        ///< 0..3: fl, fr, bl, br
  int roller_from;  ///< 0..n-1
  int roller_to;    ///< 0..n-1
  double phi;       ///< wheel angle, on the far side of the edge, rad; for an averaged contact, when it was noticed
  int direction;    ///< +1 or -1: sign of the wheel's rotation
  /// Switches that this record stands for: more than 1 only where a wheel passes several rollers between two looks.
  std::int64_t count = 1;
};

}  // namespace youbot_base_sim
