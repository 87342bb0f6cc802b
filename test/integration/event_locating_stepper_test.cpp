// EventLocatingStepper around a stepper in closed form, on wheels whose angles are known; and its guard.

#include "youbot_base_sim/integration/event_locating_stepper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/integrate/integrate_const.hpp>
#include <boost/numeric/odeint/integrate/integrate_n_steps.hpp>
#include <boost/numeric/odeint/integrate/integrate_times.hpp>
#include <boost/numeric/odeint/iterator/adaptive_time_iterator.hpp>
#include <boost/numeric/odeint/iterator/times_time_iterator.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "physics/random_states.h"
#include "wheelwork.h"
#include "youbot_base_sim/integration/guarded_stepper.h"

namespace youbot_base_sim {
namespace {

namespace odeint = boost::numeric::odeint;

// Steps are exact whatever is allowed: this makes for long ones, and cubics far off the mark.
constexpr Tolerance kTolerance{1e-3, 1e-3};

class EventLocatingStepperTest : public testing::Test {
 protected:
  using Stepper = EventLocatingStepper;

  // Runs to t_end in odeint's loops, cut into periods of that length (s), which must divide it; a period of zero does
  // not cut. What happened is left in the members.
  void run(double t_end, double period = 0) {
    restart();
    go_on(t_end, period);
  }

  Stepper located() { return {std::make_unique<WheelworkStepper>(tolerance), tolerance, *record}; }

  void restart() {
    record.emplace();
    stepper.emplace(located());
    x = wheels.start();
    t = t_of_last_switch = 0;
    switches.clear();
  }

  void go_on(double t_end, double period = 0) {
    const auto observe = [this](const State& state, double now) {
      for (const RollerSwitch& event : record->take_switches()) {
        switches.push_back(event);
        check_far_side(event, state, now);
      }
    };
    if (period == 0) {
      odeint::integrate_adaptive(std::ref(*stepper), std::ref(wheels), x, t, t_end, t_end - t, observe);
    } else {
      const auto periods = static_cast<std::size_t>(std::lround((t_end - t) / period));
      const auto observe_periods = [&](const State& state, double now) {
        for (int i = 0; i < kWheels; ++i) {
          if (wheels.modes().averaged(i)) record->record_passed_rollers(wheels.modes(), i, state, now);
        }
        for (const RollerSwitch& event : record->take_switches()) switches.push_back(event);
      };
      odeint::integrate_n_steps(std::ref(*stepper), std::ref(wheels), x, t, period, periods, observe_periods);
    }
    t = t_end;
  }

  // At the end of the step that ended on the edge; switches at t = 0 are seen a step later.
  void check_far_side(const RollerSwitch& event, const State& state, double now) {
    const int i = event.wheel;
    if (event.t == 0) return;
    EXPECT_EQ(event.t, now);
    EXPECT_EQ(event.phi, state.phi()[i]);
    EXPECT_GE(event.t, t_of_last_switch);
    t_of_last_switch = event.t;
    EXPECT_EQ(event.count, 1);
    EXPECT_EQ(wheels.geometry.roller_at(event.phi), wheels.modes().roller(i));
    EXPECT_EQ(event.roller_to, wrapped(wheels.modes().roller(i), kRollers));
    EXPECT_EQ(event.roller_from, wrapped(wheels.modes().roller(i) - event.direction, kRollers));
    const double edge = event.direction > 0 ? wheels.modes().lower_edge()[i] : wheels.modes().upper_edge()[i];
    const double hop = std::abs(state.dphi()[i]) < 1e-3 ? SlidingMode::kHop : 0;  // back over an edge that it grazes
    EXPECT_NEAR(event.phi, edge, 1e-12 * std::abs(state.dphi()[i]) + 1e-15 * std::abs(edge) + hop);
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
    return record->statistics.steps + record->statistics.rejected_steps + record->statistics.location_steps;
  }

  // Of all records of wheel i, the sum of direction times count.
  std::int64_t rollers_passed(int i) const {
    std::int64_t sum = 0;
    for (const RollerSwitch& event : switches) {
      if (event.wheel == i) sum += event.direction * event.count;
    }
    return sum;
  }

  Wheelwork wheels;
  Tolerance tolerance = kTolerance;
  std::optional<MotionRecord> record;
  std::optional<Stepper> stepper;
  State x;
  double t = 0;
  double t_of_last_switch = 0;
  std::vector<RollerSwitch> switches;
};

TEST_F(EventLocatingStepperTest, LocatesEverySwitch) {
  // Forwards; backwards; forwards and back; slowly at first, over many edges at last.
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_3 = {-0.5, -0.5, 0.3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  for (const double period : {0.0, 1e-3, 0.25}) {
    run(2, period);
    EXPECT_GT(switches.size(), 40u);
    expect_exact_switches(2);
    // The last wheel ends at 33 rad/s, after 16 switches that put it where it was to 1e-12 s.
    EXPECT_NEAR(x.phi()[3], 2 + 0.5 * 2 + 16, 33 * 16 * 1e-12);
    EXPECT_EQ(record->statistics.switches, switches.size());
  }
}

TEST_F(EventLocatingStepperTest, LocatesSwitchesAtTheSameTime) {
  // Wheels 0, 1 and 3 alike but for the direction and for whole rollers, wheel 2 behind by as much as is given.
  for (const double lag : {0.0, 1e-15, 3e-12, 3e-9, 3e-6}) {  // rad, at 5 rad/s and more
    wheels.c_0 = {0.2, -0.2, 0.2 - lag, 0.2 + kPi / 3};
    wheels.c_1 = {5, -5, 5, 5};
    wheels.c_3 = {1, -1, 1, 1};
    run(1);
    EXPECT_EQ(switches.size(), 24u);
    expect_exact_switches(1);
  }
}

TEST_F(EventLocatingStepperTest, LocatesTheFirstOfTwoSwitchesInOneStep) {
  // Wheel 3 turns steadily and reaches its edge at t = 0.3 s; wheel 0 does so earlier or later by `lag` (s), at a rate
  // that varies so much that the cubics through a step's ends may well have it the other way round.
  for (const double lag : {-1e-2, -1e-3, -1e-4, -1e-6, -1e-8, 1e-8, 1e-6, 1e-4, 1e-3, 1e-2}) {
    for (const double c_4 : {-20.0, 20.0}) {
      const double t_0 = 0.3 + lag;
      wheels.c_0 = {kPi / 6 - 4 * t_0 - c_4 * std::pow(t_0, 4), 0, 0, kPi / 6 - 5 * 0.3};
      wheels.c_1 = {4, 0, 0, 5};
      wheels.c_4[0] = c_4;
      run(0.4);
      expect_exact_switches(0.4);
    }
  }
}

TEST_F(EventLocatingStepperTest, GrazesWithoutSwitching) {
  for (const int side : {+1, -1}) {
    for (const double beyond : {-1e-3, -1e-9, 0.0, 1e-9, 1e-3}) {  // rad that wheel 1 gets past its edge, at t = 0.5 s
      wheels.c_0[1] = side * (kPi / 6 + beyond - 0.25);
      wheels.c_1[1] = side * 1.0;
      wheels.c_2[1] = side * -1.0;
      run(1);
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
      EXPECT_EQ(wheels.modes().roller(1), 0);
      EXPECT_LT(work(), 300u);
    }
  }
}

// Over the edge at 0.7 s, back at 1.2 s and over it again at 2.2 s, in one step from 0.5 s: to before or after that.
TEST_F(EventLocatingStepperTest, LocatesThereAndBackWhereAWheelReversesTwiceInAStep) {
  wheels.c_0[2] = kPi / 6 - 0.2 * 1.848;
  wheels.c_1[2] = 0.2 * 5.02;
  wheels.c_2[2] = -0.2 * 4.1;
  wheels.c_3[2] = 0.2;
  run(2);
  EXPECT_EQ(switches.size(), 2u);
  expect_exact_switches(2);
  run(2.4);
  EXPECT_EQ(switches.size(), 3u);
  expect_exact_switches(2.4);
}

TEST_F(EventLocatingStepperTest, StartsOnAnEdge) {
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
      run(0.1, 0.01);
      ASSERT_EQ(switches.size(), start.leaves ? 1u : 0u);
      if (start.leaves) {
        EXPECT_EQ(switches[0].t, 0);
        EXPECT_EQ(switches[0].direction, -1);
        EXPECT_LT(switches[0].phi, wheels.geometry.upper_edge(k));
      }
      EXPECT_EQ(wheels.modes().roller(2), start.leaves ? k : k + 1);
      const double moved = 0.1 * start.rate + 0.005 * start.acceleration;
      EXPECT_NEAR(x.phi()[2], wheels.geometry.upper_edge(k) + moved, 1e-13);
      EXPECT_LT(work(), 300u);
    }
  }
}

TEST_F(EventLocatingStepperTest, RocksOverAnEdgeForAsLongAsItDoes) {
  // Thrown up at 1 rad/s from the edge against 10 rad/s^2 on either side: back after 0.2 s, over and over.
  wheels.pull = 10;
  wheels.c_0 = {kPi / 6 - 0.05, 0, 0, 0};  // at rest here a tenth of a second before
  wheels.c_2 = {0, -5, -5, -5};            // the others stay where they are
  run(3);
  ASSERT_EQ(switches.size(), 15u);
  for (int k = 0; k < 15; ++k) {
    EXPECT_EQ(switches[k].wheel, 0);
    EXPECT_EQ(switches[k].direction, k % 2 == 0 ? 1 : -1);
    // Each time is off by 1e-12 s at the most, and so is the next one's start.
    EXPECT_NEAR(switches[k].t, 0.1 + 0.2 * k, 1.1e-12 * (k + 1));
  }
}

TEST_F(EventLocatingStepperTest, ComesToRestOnTwoRollersWhereSwitchesHaveNoEnd) {
  // The same with damping: amplitudes shrink, and the switches' number grows exponentially.
  tolerance = {2e-8, 2e-8};
  wheels.pull = 10;
  wheels.damping = 1000;
  wheels.c_0[0] = kPi / 6 - 1e-6;
  wheels.c_2 = {0.5, -5, -5, -5};
  run(1);
  EXPECT_EQ(record->statistics.shared_contacts, 1u);
  EXPECT_TRUE(wheels.modes().shared(0));
  EXPECT_EQ(wheels.modes().lower_roller(0), 0);
  EXPECT_EQ(x.phi()[0], wheels.geometry.upper_edge(0));
  EXPECT_EQ(x.dphi()[0], 0);
  EXPECT_GT(switches.size(), 8u);
  EXPECT_LT(work(), 2000u);
}

TEST_F(EventLocatingStepperTest, GoesOnFromTwoRollersWhenOneOfThemBearsItAlone) {
  // A push that grows and is as strong as the pull at t = 0.5 s, upwards or downwards.
  for (const int side : {+1, -1}) {
    wheels.pull = 10;
    wheels.c_0[0] = wheels.geometry.upper_edge(0);
    wheels.c_3[0] = side * 10 / 3.0;
    run(0.5 - 1e-5);
    EXPECT_EQ(record->statistics.shared_contacts, 1u);
    ASSERT_TRUE(wheels.modes().shared(0));
    EXPECT_EQ(x.phi()[0], wheels.geometry.upper_edge(0));
    go_on(0.6);
    EXPECT_FALSE(wheels.modes().shared(0));
    EXPECT_EQ(wheels.modes().roller(0), side > 0 ? 1 : 0);
    // From there, ddphi = 20 (t - 0.5).
    EXPECT_NEAR(x.phi()[0] - wheels.geometry.upper_edge(0), side * 10 / 3.0 * std::pow(0.1, 3), 1e-6);
    EXPECT_EQ(rollers_passed(0), side > 0 ? 0 : -1);  // it starts on roller 1, which (2.1) names
  }
}

// Bisection towards it would never end by the width of what is left, and steps of no length cost most.
TEST_F(EventLocatingStepperTest, ReleasesAtOnceWhereSharingEndsAtTheStart) {
  wheels.pull = 10;
  wheels.c_0[0] = wheels.geometry.upper_edge(0);
  wheels.c_2[0] = wheels.pull / 2;  // the push is as strong as the pull at t = 0
  wheels.c_3[0] = 1;
  restart();
  wheels.enter_sliding(0, 0, x, 0);
  ASSERT_EQ(wheels.sharing(0, x, 0).alpha, 1);
  go_on(0.1);
  EXPECT_EQ(wheels.modes().roller(0), 1);
  EXPECT_FALSE(wheels.modes().shared(0));
  EXPECT_NEAR(x.phi()[0] - wheels.geometry.upper_edge(0), std::pow(0.1, 3), 1e-9);
  EXPECT_LE(record->statistics.location_steps, 40u);
}

TEST_F(EventLocatingStepperTest, LocatesEverySwitchThoughStepsFail) {
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  for (const int nth : {7, 5, 4, 3, 2}) {
    wheels.every_nth_step_fails = nth;
    run(2);
    EXPECT_GT(switches.size(), 40u);
    expect_exact_switches(2);
  }
}

TEST_F(EventLocatingStepperTest, FailsWithoutATraceWhereNoStepSucceeds) {
  wheels.c_3[1] = std::numeric_limits<double>::quiet_NaN();
  restart();
  double length = stepper->dt();
  for (int tries = 0; tries < 400; ++tries) {
    double now = 0, dt = 1;
    ASSERT_EQ(stepper->try_step(wheels, x, now, dt), odeint::fail);
    EXPECT_EQ(now, 0);
    EXPECT_EQ(dt, stepper->dt());
    EXPECT_TRUE((x.values == wheels.start().values).all());
    EXPECT_LT(stepper->dt(), length);
    length = stepper->dt();
  }
  EXPECT_EQ(record->statistics.rejected_steps, 400u);
  EXPECT_EQ(record->statistics.steps, 0u);
}

// The effects of a switch at the start are not the caller's business until a step succeeds.
TEST_F(EventLocatingStepperTest, LeavesTheStateAloneThoughASwitchIsDueWhereNoStepSucceeds) {
  wheels.robot.roller_rate_at_switch = RollerRateAtSwitch::kAtRest;
  wheels.c_0[2] = wheels.geometry.upper_edge(0);
  wheels.c_1 = {0, 0, -1, 40};
  const auto begin = [this] {
    restart();
    x.dgamma()[2] = 5;
  };
  begin();
  go_on(0.1);
  const State unimpeded = x;
  const std::vector<RollerSwitch> due = switches;
  ASSERT_EQ(due.front().wheel, 2);
  ASSERT_EQ(due.front().t, 0);

  begin();
  const State start = x;
  wheels.every_nth_step_fails = 1;
  for (int tries = 0; tries < 5; ++tries) {
    double now = 0, dt = 0.1;
    ASSERT_EQ(stepper->try_step(wheels, x, now, dt), odeint::fail);
    EXPECT_TRUE((x.values == start.values).all());
    EXPECT_EQ(now, 0);
    EXPECT_LT(dt, 0.1);
  }
  wheels.every_nth_step_fails = 0;
  go_on(0.1);
  EXPECT_EQ(x.dgamma()[2], 0);
  EXPECT_LT((x.values - unimpeded.values).abs().maxCoeff(), 1e-10);
  ASSERT_EQ(switches.size(), due.size());
  for (std::size_t k = 0; k < due.size(); ++k) EXPECT_NEAR(switches[k].t, due[k].t, 1e-11);
}

// odeint's loops and iterators for Controlled Steppers, and one by the letter of its concept, over the same motion.
TEST_F(EventLocatingStepperTest, WorksInEveryLoopOfOdeint) {
  constexpr double kEnd = 2, kPeriod = 0.25;
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  wheels.every_nth_step_fails = 5;
  std::vector<double> times;
  for (int k = 0; k <= 8; ++k) times.push_back(k * kPeriod);
  const auto nothing = [](const State&, double) {};
  const auto system = [this] { return std::ref(wheels); };
  const auto located_stepper = [this] { return std::ref(*stepper); };
  const auto by_concept = [&] {
    for (double dt = kEnd; t < kEnd;) {
      dt = std::min(dt, kEnd - t);
      const State before = x;
      const double t_before = t, tried = dt;
      if (stepper->try_step(wheels, x, t, dt) == odeint::success) continue;
      EXPECT_TRUE((x.values == before.values).all());
      EXPECT_EQ(t, t_before);
      EXPECT_LT(dt, tried);
    }
  };
  const auto iterate = [](auto begin, auto end) {
    while (begin != end) ++begin;
  };
  const std::vector<std::pair<const char*, std::function<void()>>> loops = {
      {"concept", by_concept},
      {"adaptive", [&] { odeint::integrate_adaptive(located_stepper(), system(), x, 0.0, kEnd, kEnd, nothing); }},
      {"const", [&] { odeint::integrate_const(located_stepper(), system(), x, 0.0, kEnd, kPeriod, nothing); }},
      {"n_steps", [&] { odeint::integrate_n_steps(located_stepper(), system(), x, 0.0, kPeriod, 8, nothing); }},
      {"times", [&] { odeint::integrate_times(located_stepper(), system(), x, times, kPeriod, nothing); }},
      {"adaptive iterator",
       [&] {
         iterate(odeint::make_adaptive_time_iterator_begin(located_stepper(), system(), x, 0.0, kEnd, kEnd),
                 odeint::make_adaptive_time_iterator_end(located_stepper(), system(), x));
       }},
      {"times iterator",
       [&] {
         iterate(odeint::make_times_time_iterator_begin(located_stepper(), system(), x, times.begin(), times.end(),
                                                        kPeriod),
                 odeint::make_times_time_iterator_end<std::vector<double>::iterator>(located_stepper(), system(), x));
       }},
  };
  for (const auto& [name, loop] : loops) {
    SCOPED_TRACE(name);
    restart();
    loop();
    switches = record->take_switches();
    EXPECT_GT(switches.size(), 40u);
    EXPECT_GT(record->statistics.rejected_steps, 5u);
    expect_exact_switches(kEnd);
    for (int i = 0; i < kWheels; ++i) {
      const double phi = wheels.c_0[i] + kEnd * (wheels.c_1[i] + kEnd * (wheels.c_2[i] + kEnd * kEnd * wheels.c_4[i]));
      EXPECT_NEAR(x.phi()[i], phi, 1e-9) << "wheel " << i;
    }
  }
}

TEST_F(EventLocatingStepperTest, LetsTheSystemChangeVelocitiesAtASwitch) {
  wheels.c_1 = {3, -3, 0, 0};
  wheels.robot.roller_rate_at_switch = RollerRateAtSwitch::kAtRest;
  restart();
  x.dgamma() << 1, 2, 3, 4;
  go_on(0.25);
  EXPECT_TRUE((x.dgamma() == Wheels{0, 0, 3, 4}).all());
}

// odeint clips dt at the end of each period. Steps that are longer than a period end with it; others are cut by it once
// at most. Neither makes later ones shorter.
TEST_F(EventLocatingStepperTest, RemembersTheLengthThatABoundCutsShort) {
  wheels.c_1 = {0.1, 0, 0, 0};  // no edge is reached
  wheels.c_4 = {1e-3, 0, 0, 0};
  constexpr double kPeriod = 1e-3;
  run(1);
  const std::uint64_t uncut = record->statistics.steps;
  EXPECT_LT(uncut, 20u);
  const double worth_trying = stepper->dt();
  EXPECT_GT(worth_trying, 0.5);
  go_on(2, kPeriod);
  EXPECT_EQ(record->statistics.steps, uncut + 1000);
  EXPECT_GE(stepper->dt(), worth_trying);
  // And after that, without periods, it goes on by long steps at once.
  go_on(3);
  EXPECT_LE(record->statistics.steps, uncut + 1000 + 5);
  EXPECT_EQ(record->statistics.rejected_steps, 0u);

  // Steps of about a fifth of a period.
  tolerance = {1e-18, 1e-18};
  run(0.5);
  const std::uint64_t short_uncut = record->statistics.steps;
  EXPECT_GT(short_uncut, 2 * 500u);
  run(0.5, kPeriod);
  EXPECT_LE(record->statistics.steps, short_uncut + 500 + 20);
  EXPECT_EQ(record->statistics.rejected_steps, 0u);
}

// The end of a period costs no more than the cut itself where switches come in between.
TEST_F(EventLocatingStepperTest, PeriodsCostNoMoreThanTheirCuts) {
  wheels.c_0 = {0.1, -0.2, 0.3, 2};
  wheels.c_1 = {6, -4, 5, 0.5};
  wheels.c_2 = {1, -1, -3, 0};
  wheels.c_4 = {0.2, 0, -0.2, 1};
  run(2);
  const std::uint64_t uncut = work();
  const std::size_t passed = switches.size();
  run(2, 1e-3);
  EXPECT_EQ(switches.size(), passed);
  EXPECT_LE(work(), uncut + 2000);
}

// A step of the bound's length ends exactly where the bound does, and after success odeint may clip dt again.
TEST_F(EventLocatingStepperTest, EndsExactlyAtTheBound) {
  wheels.c_1 = {0.1, 0, 0, 0};
  restart();
  t = 0.1;
  for (int k = 0; k < 100; ++k) {
    const double start = t;
    double dt = 1e-7;  // less than the first step
    ASSERT_EQ(stepper->try_step(wheels, x, t, dt), odeint::success);
    EXPECT_EQ(t, start + 1e-7);
    EXPECT_EQ(dt, std::numeric_limits<double>::infinity());
  }
}

// Wheel 2 speeds up to 6 rad/s and slows down again; above 3 rad/s its contact is averaged, and one record a period
// tells how many rollers it has passed. The other wheels' switches are located meanwhile.
TEST_F(EventLocatingStepperTest, CountsTheRollersOfAnAveragedContact) {
  for (const int side : {+1, -1}) {
    wheels.c_0 = {0.1, 0, 0.2, 0};
    wheels.c_1 = {side * 2.5, 0, 0, 0};
    wheels.c_2[2] = side * 6.0;  // dphi = 12 t - 6 t^2
    wheels.c_3[2] = side * -2.0;
    wheels.max_located_dphi = 3;
    const std::int64_t first = wheels.geometry.roller_at(0.2);
    run(2, 0.25);
    EXPECT_EQ(record->statistics.averaged_contacts, 1u);
    EXPECT_FALSE(wheels.modes().averaged(2));  // slow again
    EXPECT_NEAR(x.phi()[2], 0.2 + side * 8, 1e-12);
    EXPECT_EQ(wheels.modes().roller(2), wheels.geometry.roller_at(x.phi()[2]));
    EXPECT_EQ(rollers_passed(2), wheels.modes().roller(2) - first);
    EXPECT_EQ(rollers_passed(0), wheels.modes().roller(0));
    EXPECT_EQ(record->statistics.switches,
              static_cast<std::uint64_t>(std::abs(rollers_passed(0)) + std::abs(rollers_passed(2))));

    const std::vector<RollerSwitch> due = exact_switches(wheels, 2);
    // Where its rate crosses 3 rad/s, and 0.8 times that on the way back, no later than a period after.
    const double fast = 1 - std::sqrt(0.5), slow = 1 + std::sqrt(1 - 0.4);
    std::int64_t in_one_record = 0;
    double last = 0;
    for (const RollerSwitch& event : switches) {
      EXPECT_GE(event.t, last);  // in order of time
      last = event.t;
      if (event.wheel != 2) {
        EXPECT_EQ(event.count, 1);
        EXPECT_TRUE(std::any_of(due.begin(), due.end(), [&](const RollerSwitch& other) {
          return other.wheel == event.wheel && std::abs(other.t - event.t) < 1e-11;
        })) << event.t;
        continue;
      }
      EXPECT_EQ(event.direction, side);
      EXPECT_EQ(event.roller_to, wrapped(wheels.geometry.roller_at(event.phi), kRollers));
      EXPECT_EQ(wrapped(event.roller_from + event.direction * event.count, kRollers), event.roller_to);
      if (event.count == 1) continue;
      in_one_record += event.count;
      EXPECT_GT(event.t, fast);
      EXPECT_LE(event.t, slow + 0.25);
      // As many as the wheel really passed in that period.
      const double begin = std::max(fast, std::ceil(event.t / 0.25 - 1) * 0.25);
      const auto passed = std::count_if(due.begin(), due.end(), [&](const RollerSwitch& other) {
        return other.wheel == 2 && other.t > begin - 1e-12 && other.t <= event.t + 1e-12;
      });
      EXPECT_LE(event.count, passed + 1);
      EXPECT_GE(event.count, passed);
    }
    EXPECT_GE(in_one_record, 2);
  }
}

// An event whose effect does not end its condition: found where that begins, and never again.
struct FastWheel : Bisected {
  static constexpr int kConditions = kWheels;
  static bool possible(const ContactSystem&, const Step&) { return true; }
  static Witness witness(const ContactSystem&, const State& x, double, int i) { return {x.dphi()[i] - 1}; }
};

TEST_F(EventLocatingStepperTest, FindsNoEventThatIsTrueAtTheStart) {
  State slow, fast;
  fast.dphi()[2] = 2;
  EXPECT_EQ(first_crossing(FastWheel(), wheels, {slow, 0, fast, 0.1}).condition, 2);
  EXPECT_FALSE(first_crossing(FastWheel(), wheels, {fast, 0, fast, 0.1}));
}

// A GuardedStepper around it, as a run uses it.
class GuardedStepperTest : public EventLocatingStepperTest {
 protected:
  // Runs to t_end without cuts, from the start.
  void run_guarded(double t_end, std::uint64_t max_evaluations) {
    restart();
    GuardedStepper guarded(located(), fly_on, max_evaluations, *record);
    exhausted_at = -1;
    work_until_exhausted = 0;
    odeint::integrate_adaptive(std::ref(guarded), std::ref(wheels), x, 0.0, t_end, t_end,
                               [&](const State& state, double now) {
                                 EXPECT_TRUE(state.values.allFinite());
                                 if (record->statistics.fallback_steps == 0) {
                                   exhausted_at = now;
                                   before_fallback = state;
                                   work_until_exhausted = work();
                                 }
                               });
    switches = record->take_switches();
    for (std::size_t k = 1; k < switches.size(); ++k) EXPECT_GE(switches[k].t, switches[k - 1].t) << k;
    for (int i = 0; i < kWheels; ++i) {
      EXPECT_EQ(rollers_passed(i), wheels.geometry.roller_at(x.phi()[i]) - wheels.geometry.roller_at(wheels.c_0[i]));
    }
  }

  double exhausted_at = -1;  // s, the start of the first fallback step
  State before_fallback;
  std::uint64_t work_until_exhausted = 0;
};

TEST_F(GuardedStepperTest, GivesUpWhereNoStepSucceeds) {
  wheels.c_1[0] = 3;
  wheels.c_3[1] = std::numeric_limits<double>::quiet_NaN();
  run_guarded(1e-3, 100000);
  EXPECT_EQ(exhausted_at, 0);
  EXPECT_TRUE((before_fallback.values == wheels.start().values).all());
  EXPECT_EQ(record->statistics.exhausted, 1u);
  EXPECT_EQ(record->statistics.fallback_steps, 50u);  // of 2e-5 s
  EXPECT_EQ(record->statistics.steps, 0u);
  EXPECT_LT(work(), 1000u);
  EXPECT_NEAR(x.phi()[0], 3e-3, 1e-15);
}

// As odeint's concept allows a Controlled Stepper that tries again itself.
TEST_F(GuardedStepperTest, NeverFails) {
  wheels.c_1[0] = 3;
  wheels.every_nth_step_fails = 1;
  restart();
  GuardedStepper guarded(located(), fly_on, 100000, *record);
  double now = 0;
  while (now < 1e-3) {
    const double before = now;
    double dt = 1e-3 - now;
    ASSERT_EQ(guarded.try_step(wheels, x, now, dt), odeint::success);
    ASSERT_GT(now, before);
  }
  EXPECT_GE(record->statistics.fallback_steps, 50u);
  EXPECT_NEAR(x.phi()[0], 3e-3, 1e-15);
}

TEST_F(GuardedStepperTest, EventsHaveTheirEffectsAfterFallbackSteps) {
  wheels.every_nth_step_fails = 1;
  wheels.max_located_dphi = 3;
  wheels.c_0 = {0.1, 0.2, 0.3, 2};
  wheels.c_1 = {10, 10, 0, 0};
  restart();
  wheels.modes().enter_averaging(0);
  wheels.modes().enter_averaging(1);
  const auto brake = [](State& state, double, double dt) {
    state.phi() += 1e3 * dt * state.dphi();
    state.dphi()[1] = 1;
  };
  GuardedStepper guarded(located(), brake, 100000, *record);
  double now = 0, dt = 1;
  ASSERT_EQ(guarded.try_step(wheels, x, now, dt), odeint::success);
  EXPECT_EQ(record->statistics.fallback_steps, 1u);
  EXPECT_TRUE(wheels.modes().averaged(0));
  EXPECT_FALSE(wheels.modes().averaged(1));
  EXPECT_EQ(wheels.modes().roller(1), wheels.geometry.roller_at(x.phi()[1]));
}

TEST_F(GuardedStepperTest, GivesUpWhereSwitchesAreMoreThanItsBoundOfWork) {
  wheels.c_1[3] = 1e9;  // a roller every nanosecond, and no averaging
  constexpr std::uint64_t kBound = 2200;
  run_guarded(1e-3, kBound);
  EXPECT_GT(exhausted_at, 1e-6);
  // The bound, 0.8 times as much to get through the rest of the millisecond more easily, and the last locations.
  EXPECT_LE(work_until_exhausted, 1.8 * kBound + 100);
  EXPECT_EQ(record->statistics.exhausted, 1u);
  EXPECT_EQ(record->statistics.eased_periods, 1u);
  EXPECT_EQ(record->statistics.switches, static_cast<std::uint64_t>(rollers_passed(3)));
}

// Chatter that would spend the bound many times over: the wheel comes to rest on both rollers, and no fallback follows.
TEST_F(GuardedStepperTest, WheelsThatChatterRestBeforeItGivesUp) {
  wheels.c_0[1] = wheels.geometry.upper_edge(0);
  wheels.c_1[1] = 0.01;  // a switch every 20 us
  tolerance = {1e-6, 1e-6};
  wheels.pull = 1000;
  restart();
  GuardedStepper guarded(located(), fly_on, 40, *record);
  odeint::integrate_adaptive(std::ref(guarded), std::ref(wheels), x, 0.0, 0.01, 0.01);
  EXPECT_EQ(record->statistics.exhausted, 1u);
  EXPECT_EQ(record->statistics.fallback_steps, 0u);
  EXPECT_EQ(record->statistics.shared_contacts, 1u);
  EXPECT_TRUE(wheels.modes().shared(1));
  EXPECT_LT(record->statistics.switches, 30u);
}

// Reactions are looked at after each step, fallback steps too, once.
TEST_F(GuardedStepperTest, LooksAtReactionsAfterEachStep) {
  wheels.reactions_matter = true;
  wheels.c_1 = {3, -3, 40, 0};
  for (const int nth : {0, 1}) {  // steps that succeed, and fallback steps
    wheels.every_nth_step_fails = nth;
    wheels.looked_at = 0;
    wheels.looks = 0;
    restart();
    record->ends_tipping = false;  // so that nothing else looks at them
    GuardedStepper guarded(located(), fly_on, 100000, *record);
    odeint::integrate_adaptive(std::ref(guarded), std::ref(wheels), x, 0.0, 0.1, 0.1);
    EXPECT_EQ(record->statistics.fallback_steps > 0, nth == 1);
    EXPECT_EQ(wheels.looks, record->statistics.steps + record->statistics.fallback_steps);
    EXPECT_NEAR(wheels.looked_at, 0.1, 1e-12);
    EXPECT_LT((record->reactions.time_off_floor - 0.1).abs().maxCoeff(), 1e-12);  // without a gap
  }
}

// Tries that fail all the time for a while: it goes on after that as before.
TEST_F(GuardedStepperTest, GoesOnAccuratelyAfterTheFallback) {
  wheels.every_nth_step_fails = 1;
  wheels.c_1 = {3, -3, 40, 0};
  restart();
  GuardedStepper guarded(located(), fly_on, 100000, *record);
  double now = 0;
  odeint::integrate_adaptive(std::ref(guarded), std::ref(wheels), x, now, 0.1, 0.1);
  EXPECT_GT(record->statistics.fallback_steps, 1000u);
  EXPECT_EQ(record->statistics.steps, 0u);
  // Stretches of fallback steps double up to 64 ms: 1, 3, 7, ... 127 ms.
  EXPECT_EQ(record->statistics.exhausted, 7u);
  wheels.every_nth_step_fails = 0;
  const std::uint64_t fallback_steps = record->statistics.fallback_steps;
  odeint::integrate_adaptive(std::ref(guarded), std::ref(wheels), x, 0.1, 1.0, 0.9);
  EXPECT_LE(record->statistics.fallback_steps - fallback_steps, 64u * 50u);
  EXPECT_EQ(record->statistics.exhausted, 7u);
  EXPECT_GT(record->statistics.steps, 0u);
  switches = record->take_switches();
  for (std::size_t k = 1; k < switches.size(); ++k) EXPECT_GE(switches[k].t, switches[k - 1].t) << k;
  // Wheels that turn steadily: interpolated times are exact but for rounding, in fallback steps too.
  std::vector<RollerSwitch> due = exact_switches(wheels, 1);
  ASSERT_EQ(switches.size(), due.size());
  for (const RollerSwitch& event : switches) {
    EXPECT_TRUE(std::any_of(due.begin(), due.end(),
                            [&](const RollerSwitch& other) {
                              return other.wheel == event.wheel && other.direction == event.direction &&
                                     other.roller_from == event.roller_from && std::abs(other.t - event.t) < 2e-11;
                            }))
        << "wheel " << event.wheel << " at " << event.t;
  }
}

TEST(MotionRecordTest, EndsTheMotionAtTheTippingLimit) {
  MotionRecord record;
  record.record_reactions({{10, 20, 30, 0}, Side::kNone}, 0.1, 0.1);
  try {
    record.record_reactions({{0, 60, 0, 0}, Side::kRight}, 0.3, 0.2);
    FAIL() << "nothing was thrown";
  } catch (const TippedOver& tipped) {
    EXPECT_EQ(tipped.time(), 0.3);
    EXPECT_EQ(tipped.side(), Side::kRight);
  }
  EXPECT_TRUE((record.reactions.min_N == Wheels{0, 20, 0, 0}).all());
  EXPECT_TRUE((record.reactions.time_off_floor == Wheels{0.2, 0, 0.2, 0.1 + 0.2}).all());
}

TEST(MotionRecordTest, RecordsWhenTheLimitWasReachedAndForHowLong) {
  MotionRecord record;
  record.ends_tipping = false;
  const Wheels N = {10, 10, 10, 10};
  const Side sides[] = {Side::kNone, Side::kLeft, Side::kFront, Side::kNone, Side::kRear, Side::kNone};
  for (int k = 0; k < 6; ++k) record.record_reactions({N, sides[k]}, k, 1);
  EXPECT_EQ(record.reactions.tipping, Side::kNone);
  EXPECT_EQ(record.reactions.tipped, Side::kRear);
  EXPECT_EQ(record.reactions.tipped_at, 4.0);  // the last time
  EXPECT_EQ(record.reactions.time_at_limit, 3);
}

}  // namespace
}  // namespace youbot_base_sim
