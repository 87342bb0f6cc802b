#include <gtest/gtest.h>

#include "youbot_base_sim/integration/motion_record.h"

namespace youbot_base_sim {
namespace {

TEST(ReactionMonitorTest, EndsTheMotionAtTheTippingLimit) {
  ReactionMonitor monitor;
  monitor.watch({{10, 20, 30, 0}, Side::kNone}, 0.1, 0.1);
  try {
    monitor.watch({{0, 60, 0, 0}, Side::kRight}, 0.3, 0.2);
    FAIL() << "nothing was thrown";
  } catch (const TippedOver& tipped) {
    EXPECT_EQ(tipped.time(), 0.3);
    EXPECT_EQ(tipped.side(), Side::kRight);
  }
  EXPECT_TRUE((monitor.record().min_N == Wheels{0, 20, 0, 0}).all());
  EXPECT_TRUE((monitor.record().time_off_floor == Wheels{0.2, 0, 0.2, 0.1 + 0.2}).all());
}

TEST(ReactionMonitorTest, RecordsWhenTheLimitWasReachedAndForHowLong) {
  ReactionMonitor monitor;
  monitor.continue_when_tipping();
  EXPECT_FALSE(monitor.ends_tipping());
  const Wheels N = {10, 10, 10, 10};
  const Side sides[] = {Side::kNone, Side::kLeft, Side::kFront, Side::kNone, Side::kRear, Side::kNone};
  for (int k = 0; k < 6; ++k) monitor.watch({N, sides[k]}, k, 1);
  EXPECT_EQ(monitor.record().tipping, Side::kNone);
  EXPECT_EQ(monitor.record().tipped, Side::kRear);
  EXPECT_EQ(monitor.record().tipped_at, 4.0);  // the last time
  EXPECT_EQ(monitor.record().time_at_limit, 3);
}

}  // namespace
}  // namespace youbot_base_sim
