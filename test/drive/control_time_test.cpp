// The one rule by which a time falls into a control period, at the ends of the periods' and of the times' ranges.

#include "youbot_base_sim/drive/control_time.h"

#include <gtest/gtest.h>

#include <limits>

namespace youbot_base_sim {
namespace {

constexpr double kPeriods[] = {1e-6, 1e-3, 0.0033, 1.0 / 3, 1, 10};
constexpr double kInf = std::numeric_limits<double>::infinity();

TEST(ControlTimeTest, BeginningsAreTheirOwnPeriods) {
  for (const double period : kPeriods) {
    const ControlTime time(period);
    for (const std::int64_t k : {0, 1, 2, 3, 7, 49, 1000, 99'999, 123'456'789}) {
      EXPECT_EQ(time.first_from(time.begin(k)), k) << period;
      EXPECT_EQ(time.ended_by(time.begin(k)), k) << period;
    }
  }
}

TEST(ControlTimeTest, RoundingMovesNothingIntoAnotherPeriod) {
  for (const double period : kPeriods) {
    const ControlTime time(period);
    for (std::int64_t k = 1; k < 100'000'000; k = 3 * k + 1) {
      double before = time.begin(k), after = before;
      for (int ulps = 0; ulps < 3; ++ulps) {
        before = std::nextafter(before, 0);
        after = std::nextafter(after, kInf);
        EXPECT_EQ(time.first_from(before), k);
        EXPECT_EQ(time.ended_by(before), k);
        EXPECT_EQ(time.first_from(after), k);
        EXPECT_EQ(time.ended_by(after), k);
      }
    }
  }
}

// Where a slack of 1e-6 of a period, or of 1e-9 s, would miss them.
TEST(ControlTimeTest, WhatIsNotRoundingCounts) {
  for (const double period : kPeriods) {
    const ControlTime time(period);
    for (const std::int64_t k : {1, 2, 3, 1000, 99'999}) {
      const double t = time.begin(k), shortly = 1e-14 * t;
      EXPECT_EQ(time.first_from(t + shortly), k + 1);
      EXPECT_EQ(time.first_from(t - shortly), k);
      EXPECT_EQ(time.ended_by(t + shortly), k);
      EXPECT_EQ(time.ended_by(t - shortly), k - 1);
      EXPECT_FALSE(ControlTime::reached(t + shortly, t));
      EXPECT_TRUE(ControlTime::reached(t - shortly, t));
    }
    EXPECT_EQ(time.first_from(1e-300), 1);
    EXPECT_EQ(time.ended_by(1e-300), 0);
  }
}

TEST(ControlTimeTest, NeverIsNeverReached) {
  const ControlTime time(1e-6);
  EXPECT_FALSE(ControlTime::reached(kInf, 1e9));
  EXPECT_TRUE(ControlTime::reached(1e9, kInf));
  EXPECT_GT(time.ended_by(kInf), std::int64_t{1} << 50);
  EXPECT_GT(time.first_from(kInf), std::int64_t{1} << 50);
}

}  // namespace
}  // namespace youbot_base_sim
