#pragma once

#include <cstdint>

namespace youbot_base_sim {

/// Rollers a second above which switches are counted, not located, and the contact is averaged. Real bases: below 20.
constexpr double kMaxLocatedRate = 500;

/// One roller taking over from another; several switches in one record if they follow too fast to be located.
struct RollerSwitch {
  /// s: located to 1e-12 s; interpolated in fallback steps; for an averaged contact, when it was noticed.
  double t;
  int wheel;        ///< 0..3: fl, fr, bl, br
  int roller_from;  ///< 0..n-1
  int roller_to;    ///< 0..n-1
  double phi;       ///< wheel angle, on the far side of the edge, rad; for an averaged contact, when it was noticed
  int direction;    ///< +1 or -1: sign of the wheel's rotation
  std::int64_t count = 1;  ///< switches that this record stands for
};

}  // namespace youbot_base_sim
