// Where simulated time waits, and for how long.

#include "youbot_base_sim/loop/lockstep.h"

#include <gtest/gtest.h>

#include <cmath>

namespace youbot_base_sim {
namespace {

LockstepSettings settings(double period, double timeout, bool end_with_commands = false) {
  LockstepSettings settings;
  settings.on = true;
  settings.period = period;
  settings.timeout = timeout;
  settings.end_with_commands = end_with_commands;
  return settings;
}

TEST(Lockstep, waits_once_where_a_period_begins) {
  Lockstep lockstep(settings(0.02, 10), 0.001);
  EXPECT_TRUE(lockstep.waits(0));
  EXPECT_FALSE(lockstep.waits(7));
  EXPECT_EQ(lockstep.left(7), 13);
  lockstep.release(0);
  EXPECT_FALSE(lockstep.waits(0));
  EXPECT_TRUE(lockstep.waits(20));
}

TEST(Lockstep, idles_until_it_starts) {
  for (const bool told : {false, true}) {
    Lockstep lockstep(settings(0.02, 10), 0.001);
    EXPECT_TRUE(lockstep.idles());
    EXPECT_EQ(lockstep.patience(), 0.02);
    lockstep.idle();
    EXPECT_EQ(lockstep.idle_time(), 0.02);
    told ? lockstep.start() : lockstep.release(0);
    EXPECT_FALSE(lockstep.idles());
    EXPECT_TRUE(lockstep.started());
  }
}

TEST(Lockstep, waits_for_a_player_for_ever_unless_it_may_end) {
  EXPECT_FALSE(Lockstep(settings(0, 20), 0.001).awaits_rest());
  EXPECT_FALSE(Lockstep(settings(0, 20), 0.001).idles());
  EXPECT_TRUE(std::isinf(Lockstep(settings(0, 20), 0.001).patience()));
  EXPECT_EQ(Lockstep(settings(0, 20, true), 0.001).patience(), 20);
  EXPECT_TRUE(std::isinf(Lockstep(settings(0, 0, true), 0.001).patience()));
}

}  // namespace
}  // namespace youbot_base_sim
