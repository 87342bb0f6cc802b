#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace youbot_base_sim {

/// What two real bases, A and B, did when they were told a velocity at rest (docs/drop_in.md, Velocity loops). A's
/// records are of 10 Hz and tell neither at what angles the wheels started nor the load: a base that rises within a
/// factor of `factor` of it is one of its kind. A overshoots by 13 to 21 %, B by nothing that can be seen.
namespace records {

constexpr double rise_ahead = 0.26, rise_sideways = 0.52, rise_turning = 0.32;  // of A, 10 to 90 %, s
constexpr double factor = 1.7, max_overshoot = 0.21;
constexpr double speed = 0.1, turn = 0.314;  // m/s, rad/s
constexpr double settled = 1.6;              // s: B's slowest wheels were at 90 % by then

}  // namespace records

/// The answer to a step, in shares of what was told.
class RateStep {
 public:
  /// The share at time t, s; to be called with increasing times from the first after zero on.
  void add(double t, double share) {
    const auto crossing = [&](double level) { return t_ + (t - t_) * (level - share_) / (share - share_); };
    if (share_ < 0.1 && share >= 0.1 && time_to_10_ == 0) time_to_10_ = crossing(0.1);
    if (share_ < 0.9 && share >= 0.9 && time_to_90_ == 0) time_to_90_ = crossing(0.9);
    overshoot_ = std::max(overshoot_, share - 1);
    if (t >= records::settled) {
      sum_ += share;
      ++settled_;
    }
    t_ = t;
    share_ = share;
  }

  double rise() const { return time_to_90_ - time_to_10_; }  ///< s
  double time_to_90() const { return time_to_90_; }          ///< s
  double overshoot() const { return overshoot_; }
  double settled() const { return sum_ / settled_; }  ///< mean, once it has settled

 private:
  double t_ = 0, share_ = 0, time_to_10_ = 0, time_to_90_ = 0, overshoot_ = 0, sum_ = 0;
  int settled_ = 0;
};

/// Expects what base A did.
inline void expect_like_a_real_base(double rise, double overshoot, double settled, double rise_of_A,
                                    const std::string& what) {
  EXPECT_GT(rise, rise_of_A / records::factor) << what;
  EXPECT_LT(rise, rise_of_A * records::factor) << what;
  EXPECT_LT(overshoot, records::max_overshoot) << what;
  EXPECT_NEAR(settled, 1, 0.02) << what;
}

}  // namespace youbot_base_sim
