// SwitchingIntegrator on wheels whose angles are known in closed form.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "physics/random_states.h"
#include "wheelwork.h"
#include "youbot_base_sim/integration/switching_integrator.h"

namespace youbot_base_sim {
namespace {

// Steps are exact whatever is allowed: this makes for long ones, and cubics far off the mark.
constexpr Tolerance kTolerance{1e-3, 1e-3};

class SwitchingTest : public testing::Test {
 protected:
  using Integrator = SwitchingIntegrator<WheelworkStepper>;

  // Runs to t_end in calls of at most `period` seconds each, unless one gives up; what happened is left in the members.
  bool run(double t_end, double period = 1e9) {
    x = wheels.start();
    switches.clear();
    for (t = 0; t < t_end;) {
      const bool reached =
          integrator.advance(wheels, x, t, std::min(t_end, t + period), [&](const RollerSwitch& event, State& state) {
            switches.push_back(event);
            check_far_side(event, state);
          });
      if (!reached) return false;
    }
    EXPECT_EQ(t, t_end);
    return true;
  }

  void check_far_side(const RollerSwitch& event, const State& state) {
    const int i = event.wheel;
    EXPECT_EQ(event.phi, state.phi()[i]);
    EXPECT_GE(event.t, t_of_last_switch);
    t_of_last_switch = event.t;
    EXPECT_EQ(wheels.geometry.roller_at(event.phi), wheels.roller(i));
    EXPECT_EQ(event.roller_to, wrapped(static_cast<int>(wheels.roller(i))));
    EXPECT_EQ(event.roller_from, wrapped(static_cast<int>(wheels.roller(i)) - event.direction));
    const double edge = event.direction > 0 ? wheels.lower_edge()[i] : wheels.upper_edge()[i];
    EXPECT_NEAR(event.phi, edge, 1e-12 * std::abs(state.dphi()[i]) + 1e-15 * std::abs(edge));
  }

  // Each switch that is due is located to 1e-12 s, and puts its wheel on the edge: what it was off by, the wheel's
  // later switches inherit. `more` (s) is added to that, and a tenth for what sums round. Switches closer in time than
  // the accuracy may come in any order.
  void expect_exact_switches(double duration, double more = 0) {
    std::vector<RollerSwitch> due = exact_switches(wheels, duration);
    ASSERT_EQ(switches.size(), due.size());
    std::array<int, kWheels> passed{};
    for (const RollerSwitch& event : switches) {
      const double accuracy = 1.1e-12 * ++passed[event.wheel] + more;
      const auto match = std::find_if(due.begin(), due.end(), [&](const RollerSwitch& other) {
        return other.wheel == event.wheel && other.direction == event.direction &&
               other.roller_from == event.roller_from && std::abs(other.t - event.t) < accuracy;
      });
      ASSERT_NE(match, due.end()) << "wheel " << event.wheel << " at " << event.t << " s";
      due.erase(match);
    }
  }

  std::uint64_t work() const {
    const IntegrationStatistics& s = integrator.statistics();
    return s.steps + s.rejected_steps + s.location_steps;
  }

  Wheelwork wheels;
  Integrator integrator{kTolerance, kRollers};
  State x;
  double t = 0;
  double t_of_last_switch = 0;
  std::vector<RollerSwitch> switches;
};

TEST_F(SwitchingTest, LocatesEverySwitch) {
  // Forwards; backwards; forwards and back; slowly at first, over many edges at last.
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_3 = {-0.5, -0.5, 0.3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  for (const double period : {10.0, 1e-3, 0.3}) {
    t_of_last_switch = 0;
    integrator.restart();
    ASSERT_TRUE(run(2, period));
    EXPECT_GT(switches.size(), 40u);
    expect_exact_switches(2);
    // The last wheel ends at 33 rad/s, after 16 switches that put it where it was to 1e-12 s.
    EXPECT_NEAR(x.phi()[3], 2 + 0.5 * 2 + 16, 33 * 16 * 1e-12);
  }
  EXPECT_EQ(integrator.statistics().switches, 3 * switches.size());
}

TEST_F(SwitchingTest, LocatesSwitchesAtTheSameTime) {
  // Wheels 0, 1 and 3 alike but for the direction and for whole rollers, wheel 2 behind by as much as is given.
  for (const double lag : {0.0, 1e-15, 3e-12, 3e-9, 3e-6}) {  // rad, at 5 rad/s and more
    wheels.c_0 = {0.2, -0.2, 0.2 - lag, 0.2 + kPi / 3};
    wheels.c_1 = {5, -5, 5, 5};
    wheels.c_3 = {1, -1, 1, 1};
    t_of_last_switch = 0;
    integrator.restart();
    ASSERT_TRUE(run(1));
    EXPECT_EQ(switches.size(), 24u);
    expect_exact_switches(1);
  }
}

TEST_F(SwitchingTest, LocatesTheFirstOfTwoSwitchesInOneStep) {
  // Wheel 3 turns steadily and reaches its edge at t = 0.3 s; wheel 0 does so earlier or later by `lag` (s), at a rate
  // that varies so much that the cubics through a step's ends may well have it the other way round.
  for (const double lag : {-1e-2, -1e-3, -1e-4, -1e-6, -1e-8, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2}) {
    for (const double c_4 : {-20.0, 20.0}) {
      const double t_0 = 0.3 + lag;
      wheels.c_0 = {kPi / 6 - 4 * t_0 - c_4 * std::pow(t_0, 4), 0, 0, kPi / 6 - 5 * 0.3};
      wheels.c_1 = {4, 0, 0, 5};
      wheels.c_4[0] = c_4;
      t_of_last_switch = 0;
      integrator.restart();
      ASSERT_TRUE(run(0.4));
      expect_exact_switches(0.4);
    }
  }
}

TEST_F(SwitchingTest, GrazesWithoutSwitching) {
  for (const int side : {+1, -1}) {
    for (const double beyond : {-1e-3, -1e-9, 0.0, 1e-9, 1e-3}) {  // rad that wheel 1 gets past its edge, at t = 0.5 s
      wheels.c_0[1] = side * (kPi / 6 + beyond - 0.25);
      wheels.c_1[1] = side * 1.0;
      wheels.c_2[1] = side * -1.0;
      t_of_last_switch = 0;
      const std::uint64_t work_before = work();
      integrator.restart();
      ASSERT_TRUE(run(1));
      if (beyond == 0) {
        // Rounding decides whether it gets past, but it must come back.
        EXPECT_EQ(switches.size() % 2, 0u);
        EXPECT_LE(switches.size(), 2u);
      } else {
        ASSERT_EQ(switches.size(), beyond < 0 ? 0u : 2u) << "side " << side << ", beyond " << beyond;
      }
      if (beyond > 0) {
        // Rounding leaves phi good to 1e-14 rad at most, and it passes the edge at 2 sqrt(beyond) rad/s.
        expect_exact_switches(1, 1e-14 / (2 * std::sqrt(beyond)));
        EXPECT_EQ(switches[0].direction, side);
      }
      EXPECT_EQ(wheels.roller(1), 0);
      EXPECT_LT(work() - work_before, 300u);
    }
  }
}

TEST_F(SwitchingTest, StartsOnAnEdge) {
  struct Start {
    double rate, acceleration;  // rad/s, rad/s^2
    bool leaves;                // the roller that (2.1) names, which is the upper one
  };
  for (const Start& start : {Start{1, 0, false}, Start{1, -1, false}, Start{-1, 0, true}, Start{-1, 1, true},
                             Start{0, 1, false}, Start{0, -1, true}, Start{0, 0, false}}) {
    for (const int k : {0, 1, -1, -3, 17}) {
      SCOPED_TRACE(testing::Message() << "rate " << start.rate << ", acceleration " << start.acceleration
                                      << ", upper edge of roller " << k);
      wheels.c_0[2] = wheels.geometry.upper_edge(k);
      wheels.c_1[2] = start.rate;
      wheels.c_2[2] = start.acceleration / 2;
      t_of_last_switch = 0;
      const std::uint64_t work_before = work();
      integrator.restart();
      ASSERT_TRUE(run(0.1, 0.01));
      ASSERT_EQ(switches.size(), start.leaves ? 1u : 0u);
      if (start.leaves) {
        EXPECT_EQ(switches[0].t, 0);
        EXPECT_EQ(switches[0].direction, -1);
        EXPECT_LT(switches[0].phi, wheels.geometry.upper_edge(k));
      }
      EXPECT_EQ(wheels.roller(2), start.leaves ? k : k + 1);
      const double moved = 0.1 * start.rate + 0.005 * start.acceleration;
      EXPECT_NEAR(x.phi()[2], wheels.geometry.upper_edge(k) + moved, 1e-13);
      EXPECT_LT(work() - work_before, 300u);
    }
  }
}

TEST_F(SwitchingTest, RocksOverAnEdgeForAsLongAsItDoes) {
  // Thrown up at 1 rad/s from the edge against 10 rad/s^2 on either side: back after 0.2 s, over and over.
  wheels.pull = 10;
  wheels.c_0 = {kPi / 6 - 0.05, 0, 0, 0};  // at rest here a tenth of a second before
  wheels.c_2 = {0, -5, -5, -5};            // the others stay where they are
  ASSERT_TRUE(run(3));
  ASSERT_EQ(switches.size(), 15u);
  for (int k = 0; k < 15; ++k) {
    EXPECT_EQ(switches[k].wheel, 0);
    EXPECT_EQ(switches[k].direction, k % 2 == 0 ? 1 : -1);
    // Each time is off by 1e-12 s at the most, and so is the next one's start.
    EXPECT_NEAR(switches[k].t, 0.1 + 0.2 * k, 1.1e-12 * (k + 1));
  }
}

TEST_F(SwitchingTest, ComesToRestOnTwoRollersWhereSwitchesHaveNoEnd) {
  // The same with damping: amplitudes shrink, and the switches' number grows exponentially.
  integrator = Integrator({1e-10, 1e-10}, kRollers);
  wheels.pull = 10;
  wheels.damping = 1000;
  wheels.c_0[0] = kPi / 6 - 1e-6;
  wheels.c_2 = {0.5, -5, -5, -5};
  ASSERT_TRUE(run(1));
  EXPECT_EQ(integrator.statistics().shared_contacts, 1u);
  EXPECT_TRUE(wheels.shared(0));
  EXPECT_EQ(wheels.lower_roller(0), 0);
  EXPECT_EQ(x.phi()[0], wheels.geometry.upper_edge(0));
  EXPECT_EQ(x.dphi()[0], 0);
  EXPECT_GT(switches.size(), 8u);
  EXPECT_LT(work(), 2000u);
}

TEST_F(SwitchingTest, GoesOnFromTwoRollersWhenOneOfThemBearsItAlone) {
  // A push that grows and is as strong as the pull at t = 0.5 s, upwards or downwards.
  for (const int side : {+1, -1}) {
    wheels.pull = 10;
    wheels.c_0[0] = wheels.geometry.upper_edge(0);
    wheels.c_3[0] = side * 10 / 3.0;
    integrator.restart();
    t_of_last_switch = 0;
    const std::uint64_t shared_before = integrator.statistics().shared_contacts;
    ASSERT_TRUE(run(0.5 - 1e-5));
    EXPECT_EQ(integrator.statistics().shared_contacts, shared_before + 1);
    ASSERT_TRUE(wheels.shared(0));
    EXPECT_EQ(x.phi()[0], wheels.geometry.upper_edge(0));
    const auto ignore = [](const RollerSwitch&, State&) {};
    ASSERT_TRUE(integrator.advance(wheels, x, t, 0.6, ignore));
    EXPECT_FALSE(wheels.shared(0));
    EXPECT_EQ(wheels.roller(0), side > 0 ? 1 : 0);
    // From there, ddphi = 20 (t - 0.5).
    EXPECT_NEAR(x.phi()[0] - wheels.geometry.upper_edge(0), side * 10 / 3.0 * std::pow(0.1, 3), 1e-6);
  }
}

TEST_F(SwitchingTest, LocatesEverySwitchThoughStepsFail) {
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  for (const int nth : {5, 3}) {
    wheels.every_nth_step_fails = nth;
    t_of_last_switch = 0;
    integrator.restart();
    ASSERT_TRUE(run(2));
    EXPECT_GT(switches.size(), 40u);
    expect_exact_switches(2);
  }
}

TEST_F(SwitchingTest, GivesUpWhereNoStepSucceeds) {
  wheels.c_3[1] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_FALSE(run(1));
  EXPECT_EQ(t, 0);
  EXPECT_TRUE((x.values == wheels.start().values).all());
  EXPECT_EQ(integrator.statistics().exhausted, 1u);
  EXPECT_LT(work(), 1000u);
}

TEST_F(SwitchingTest, GivesUpWhereSwitchesAreMoreThanItsBoundOfWork) {
  wheels.c_1[3] = 1e9;  // a roller every nanosecond
  ASSERT_FALSE(run(1));
  EXPECT_GT(t, 1e-6);
  EXPECT_LE(work(), 4100u);  // kMaxAttempts, and the last location
  EXPECT_EQ(integrator.statistics().exhausted, 1u);
}

TEST_F(SwitchingTest, LetsTheCallerChangeVelocitiesAtASwitch) {
  wheels.c_1 = {3, -3, 0, 0};
  x = wheels.start();
  x.dgamma() << 1, 2, 3, 4;
  double time = 0;
  integrator.advance(wheels, x, time, 0.25,
                     [](const RollerSwitch& event, State& state) { state.dgamma()[event.wheel] = 0; });
  EXPECT_TRUE((x.dgamma() == Wheels{0, 0, 3, 4}).all());
}

}  // namespace
}  // namespace youbot_base_sim
