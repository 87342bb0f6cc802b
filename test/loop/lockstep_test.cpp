// Where simulated time waits for commands, and for how long.

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
  Lockstep lockstep(settings(0.02, 0), 0.001);
  EXPECT_TRUE(lockstep.waits(0));
  EXPECT_FALSE(lockstep.waits(7));
  EXPECT_EQ(lockstep.left(7), 13);
  lockstep.release(0, true);
  EXPECT_FALSE(lockstep.waits(0));
  EXPECT_TRUE(lockstep.waits(20));
}

TEST(Lockstep, continues_by_the_wall_clock_without_commands) {
  Lockstep lockstep(settings(0.02, 1), 0.001);
  EXPECT_TRUE(lockstep.idles());
  EXPECT_EQ(lockstep.patience(), 0.02);
  lockstep.release(0, true);
  EXPECT_FALSE(lockstep.idles());
  EXPECT_EQ(lockstep.patience(), 1);
  lockstep.release(20, false);
  EXPECT_EQ(lockstep.patience(), 0.02) << "no command is waited for twice as long";
  lockstep.release(40, true);
  EXPECT_EQ(lockstep.patience(), 1);
  EXPECT_FALSE(lockstep.ends());
}

TEST(Lockstep, ends_with_a_player_that_does_not_come_or_continue) {
  Lockstep lockstep(settings(0, 20, true), 0.001);
  EXPECT_EQ(lockstep.patience(), 20);
  EXPECT_TRUE(lockstep.ends());
  lockstep.release(0, true);
  EXPECT_EQ(lockstep.patience(), 20);
  EXPECT_TRUE(lockstep.ends());
}

TEST(Lockstep, ends_with_a_node_of_its_own_period) {
  Lockstep lockstep(settings(0.02, 1, true), 0.001);
  for (int k = 0; k < 50; ++k) {
    EXPECT_FALSE(lockstep.ends()) << "idles";
    lockstep.idle();
  }
  EXPECT_TRUE(lockstep.ends());
  lockstep.release(0, true);
  EXPECT_EQ(lockstep.patience(), 1);
  EXPECT_TRUE(lockstep.ends());
}

TEST(Lockstep, waits_for_ever_without_a_time_out) {
  Lockstep lockstep(settings(0, 0, true), 0.001);
  EXPECT_TRUE(std::isinf(lockstep.patience()));
  EXPECT_FALSE(lockstep.ends());
}

}  // namespace
}  // namespace youbot_base_sim
