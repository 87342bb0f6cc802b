// Radau IIA on the robot, against explicit methods that share only the right-hand side.

#include "youbot_base_sim/integration/radau.h"

#include <gtest/gtest.h>

#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/integrate/integrate_n_steps.hpp>
#include <functional>
#include <limits>

#include "explicit_solution.h"
#include "physics/random_states.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/physics/model.h"

namespace youbot_base_sim {
namespace {

namespace odeint = boost::numeric::odeint;

const double kNaN = std::numeric_limits<double>::quiet_NaN();

// Accepts a step whatever its error.
constexpr Tolerance kAnything{1e3, 1e3};

// A robot under torques that vary; the rollers on the floor stay the same.
template <class Model>
struct Motion {
  Motion(const RobotParameters& robot, const FloorParameters& floor)
      : model(robot, floor), torque({TorqueSegment{0, {1, -2, 1, 0}, {1, 0, 2, 1}, {0, 1, -1, 2}, 0.3}}) {
    start.values.col(0) << 1, 2, 0.5, 0;
    start.V_X() = 0.2;
    start.Omega() = 1;
    start.dphi() << 4, -2, 6, 1;
    start.dgamma() << -10, 20, 0, 5;
    start.phi() << 0.1, -0.2, 0.3, 0;
    torque.begin_segment(0);
  }
  SlipSystem<Model> system() const { return {model, torque, start}; }

  Model model;
  PiecewiseTorque torque;
  State start;  // at t = 0
};

// In gentle terms: friction of some 40 N s/m at each contact and heavy rollers leave rates of up to 100/s.
template <class Model>
Motion<Model> gentle_motion() {
  RobotParameters robot;
  robot.J_2 = 1e-3;
  FloorParameters floor;
  floor.nu = 1;
  floor.viscous_friction = 40;
  return {robot, floor};
}

// The robot of the paper, its contacts between gripping and slipping, after what its start sets off has died down.
Motion<PaperModel<CoulombLaw>> stiff_motion() {
  Motion<PaperModel<CoulombLaw>> motion{RobotParameters(), FloorParameters()};
  motion.start.values.setZero();
  motion.start.V_X() = 0.4;
  motion.start.V_Y() = 0.1;
  motion.start.Omega() = 0.2;
  motion.start.phi() << 0.1, -0.1, 0.2, 0.05;
  motion.start.dphi().setConstant(8);
  motion.start = explicit_solution(motion.system(), motion.start, 0, 0.02, 1e-12);
  return motion;
}

// The end of a step of length dt from x at t, its stages solved to rounding and its error not judged: a Radau that
// accepts anything, asked for the same step over and over, takes each solution for the prediction of the next.
template <class Model>
State polished_step(Radau<Model>& radau, SlipSystem<Model>& system, const State& x, double t, double dt) {
  constexpr int kRepetitions = 4;
  State end;
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    double time = t, next = dt;
    EXPECT_EQ(radau.try_step(std::ref(system), x, time, end, next), odeint::success) << "from " << t << ", dt " << dt;
    EXPECT_EQ(time, t + dt);
  }
  return end;
}

// State after `steps` equal steps from t_0 to t_1, s.
template <class Model>
State stepped(SlipSystem<Model> system, State x, double t_0, double t_1, int steps) {
  IntegrationStatistics statistics;
  Radau<Model> radau(kAnything, statistics);
  const double dt = (t_1 - t_0) / steps;
  for (int k = 0; k < steps; ++k) x = polished_step(radau, system, x, t_0 + k * dt, dt);
  return x;
}

// A single try of a new Radau.
template <class Model>
struct Try {
  Try(const Tolerance& tolerance, SlipSystem<Model> system, const State& x, double t, double dt) : next(dt) {
    Radau<Model> radau(tolerance, statistics);
    accepted = radau.try_step(std::ref(system), x, t, end, next) == odeint::success;
  }
  IntegrationStatistics statistics;
  bool accepted;
  State end;    // if it was accepted
  double next;  // recommended length, s
};

// The error of a step in units of the tolerance, as the next length tells it: that for which a new controller
// recommends this length.
double error_told(double dt, double next) {
  double low = 1e-8, high = 1e8;  // the controller shortens steps the more, the larger the error
  while (high > low * (1 + 1e-14)) {
    const double middle = std::sqrt(low * high);
    (StepSizeController().next(dt, middle) > next ? low : high) = middle;
  }
  // Where the controller reaches a bound of its own, no message comes.
  EXPECT_GT(low, 1e-4) << "the recommended length, " << next << " s, is bounded from above";
  EXPECT_LT(high, 2e2) << "the recommended length, " << next << " s, is bounded from below";
  return low;
}

double distance(const State& a, const State& b) { return (a.values - b.values).abs().maxCoeff(); }

// The largest of |e_i| over what is allowed at x: the platform's velocities together, others each for itself, rollers
// `roller_weight` times as much.
double worst(const Velocities& e, const State& x, const Tolerance& tolerance, double roller_weight) {
  const auto allowed = [&](const Wheels& rate) -> Wheels {
    return tolerance.absolute + tolerance.relative * rate.abs();
  };
  const double platform = tolerance.absolute + tolerance.relative * x.velocity().norm();
  return std::max({e.v.abs().maxCoeff() / platform, (e.dphi / allowed(x.dphi())).abs().maxCoeff(),
                   (e.dgamma / allowed(x.dgamma())).abs().maxCoeff() / roller_weight});
}

template <class Model>
class RadauTest : public testing::Test {};
using Laws = testing::Types<PaperModel<ViscousLaw>, PaperModel<CoulombLaw>>;
TYPED_TEST_SUITE(RadauTest, Laws, );

// Pose, work and angles too, which follow from the velocities at the stages.
TYPED_TEST(RadauTest, HasOrderFiveOnSmoothMotion) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  const double end = 0.2;
  const State exact = explicit_solution(motion.system(), motion.start, 0, end);
  double last = 0;
  for (const int steps : {32, 64, 128, 256}) {
    const State x = stepped(motion.system(), motion.start, 0, end, steps);
    const double error = distance(x, exact);
    EXPECT_GT(error, 1e-12) << "rounding: " << steps << " steps are too many";
    if (last > 0) {
      EXPECT_NEAR(std::log2(last / error), 5, 0.3) << steps << " steps";
    }
    last = error;
  }
}

// Within a step as well: the polynomial's velocities have an error of dt^4 or less, and so has the work, which is that
// of their kinetic energy. Pose and angles, their integrals, have one of dt^5.
TYPED_TEST(RadauTest, KnowsTheStatesWithinAStep) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  SlipSystem<TypeParam> system = motion.system();
  IntegrationStatistics statistics;
  Radau<TypeParam> radau(kAnything, statistics);
  for (const double share : {0.1, 0.3, 0.5}) {
    const auto errors = [&](double dt) {
      State x;
      polished_step(radau, system, motion.start, 0, dt);
      radau.state_within(system, share, x);
      const State exact = explicit_solution(system, motion.start, 0, share * dt, 1e-15);
      const auto off = (x.values - exact.values).abs().eval();
      Eigen::Array<double, 7, 1> largest;
      largest << off.rightCols<5>().colwise().maxCoeff().transpose(), off(State::kWork),
          off.col(0).head<3>().maxCoeff();
      return largest;
    };
    const auto order = ((errors(8e-3) / errors(4e-3)).log() / std::log(2)).eval();
    for (const int velocities_and_work : {0, 2, 3, 5}) EXPECT_GT(order[velocities_and_work], 3.5) << share;
    for (const int integrals : {1, 4, 6}) EXPECT_NEAR(order[integrals], 5, 0.5) << share;
  }
  State x;
  const State end = polished_step(radau, system, motion.start, 0, 4e-3);
  radau.state_within(system, 1, x);
  x.work() = end.work();  // of the forces
  EXPECT_LT(distance(x, end), 1e-13);
}

// With rates of up to 5e6/s, and steps of 0.6 ms to 80 us, those of a tolerance of 1e-7 among them. What the stiff
// friction drives, the rollers and then the wheels, converges with the stage order, 3, at least (Hairer and Wanner,
// section VI.1), what they drive with an order near 5.
TEST(Radau, HasHighOrderOnStiffMotion) {
  const Motion<PaperModel<CoulombLaw>> motion = stiff_motion();
  const double begin = 0.02, end = 0.06;
  const State exact = explicit_solution(motion.system(), motion.start, begin, end, 1e-13);
  const auto errors = [&](int steps) {
    const State x = stepped(motion.system(), motion.start, begin, end, steps);
    return (x.values - exact.values).abs().colwise().maxCoeff().eval();
  };
  const auto coarse = errors(64), fine = errors(512);
  const auto order = ((coarse / fine).log() / std::log(8)).eval();
  constexpr int kPose = 0, kPlatform = 1, kPhi = 2, kDphi = 3, kDgamma = 4;
  for (const int column : {kPose, kPlatform, kPhi}) EXPECT_GT(order[column], 4) << "column " << column;
  for (const int column : {kDphi, kDgamma}) EXPECT_GT(order[column], 3) << "column " << column;
  EXPECT_LT(coarse[kPose], 1e-7);
  EXPECT_LT(coarse[kPlatform], 1e-6);
}

// The longest step from the motion's start, of lengths 0.1 s, 0.09 s, 0.081 s ..., that this tolerance accepts.
template <class Model>
double longest_accepted(const Motion<Model>& motion, const Tolerance& tolerance) {
  double h = 0.1;
  while (h > 1e-4 && !Try<Model>(tolerance, motion.system(), motion.start, 0, h).accepted) h *= 0.9;
  EXPECT_GT(h, 1e-4);
  return h;
}

// What is predicted only speeds up the iterations.
TYPED_TEST(RadauTest, PredictionsDoNotShow) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  SlipSystem<TypeParam> system = motion.system();
  for (const double accuracy : {1e-4, 1e-7, 1e-10}) {
    const Tolerance tolerance{accuracy, accuracy};
    // Short enough for the second step, of up to five times this length, to be accepted.
    const double dt = longest_accepted(motion, tolerance) / 6;
    for (const double factor : {0.1, 0.5, 1.0, 2.0, 5.0}) {
      SCOPED_TRACE(testing::Message() << "tolerance " << accuracy << ", second step " << factor << " times the first");
      IntegrationStatistics statistics;
      Radau<TypeParam> radau(tolerance, statistics);
      // Another try at the same step, after one that may well have been rejected.
      State first, second;
      double t = 0, next = dt / factor;
      radau.try_step(std::ref(system), motion.start, t, first, next);
      t = 0;
      next = dt;
      ASSERT_EQ(radau.try_step(std::ref(system), motion.start, t, first, next), odeint::success);
      const Try<TypeParam> anew(tolerance, system, motion.start, 0, dt);
      ASSERT_TRUE(anew.accepted);
      // Each leaves a thirtieth of what is allowed, by the mean of eleven squares.
      const double twice = 2 * 0.03 * std::sqrt(11);
      EXPECT_LT(worst(first.velocities() - anew.end.velocities(), first, tolerance, 30), twice);
      // The step after it.
      const std::uint64_t before = statistics.newton_iterations;
      next = factor * dt;
      ASSERT_EQ(radau.try_step(std::ref(system), first, t, second, next), odeint::success);
      const std::uint64_t iterations_with = statistics.newton_iterations - before;
      const Try<TypeParam> other(tolerance, system, first, dt, factor * dt);
      ASSERT_TRUE(other.accepted);
      EXPECT_LT(worst(second.velocities() - other.end.velocities(), first, tolerance, 30), twice);
      if (factor <= 1) {
        EXPECT_LE(iterations_with, anew.statistics.newton_iterations);
      }
    }
  }
}

// As a Controlled Stepper: x and t are those of the step's end, or as before if it fails; dt is what is worth trying
// next.
TYPED_TEST(RadauTest, StepsInPlaceAndOutOfPlaceAlike) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  SlipSystem<TypeParam> system = motion.system();
  IntegrationStatistics statistics;
  Radau<TypeParam> in_place({1e-7, 1e-7}, statistics), out_of_place({1e-7, 1e-7}, statistics);
  State x = motion.start, in = motion.start;
  double t = 0, dt = 0.1, t_out = 0, dt_out = 0.1;
  int failures = 0, successes = 0;
  while (successes < 20) {
    State out;
    const State before = x;
    const double tried = dt, t_before = t;
    const auto result = in_place.try_step(std::ref(system), x, t, dt);
    ASSERT_EQ(result, out_of_place.try_step(std::ref(system), in, t_out, out, dt_out));
    EXPECT_EQ(t, t_out);
    EXPECT_EQ(dt, dt_out);
    EXPECT_TRUE((in.values == before.values).all());  // never changes
    if (result == odeint::success) {
      ++successes;
      EXPECT_EQ(t, t_before + tried);
      EXPECT_TRUE((x.values == out.values).all());
      EXPECT_EQ(x.values(3, 1), 0);
      in = out;
    } else {
      ++failures;
      EXPECT_EQ(t, t_before);
      EXPECT_TRUE((x.values == before.values).all());
      EXPECT_LT(dt, tried);
    }
  }
  EXPECT_GT(failures, 0);
}

// A base that spins on a slope without friction falls along it as any body. The pose at the stages decides where
// "along" is: it has to be right in whatever step is accepted, up to a turn of 1 rad, and no longer step may be
// accepted.
TEST(BeyondRadauTest, TurnsInAStepAsFarAsItsSineIsRight) {
  RobotParameters robot;
  robot.a_X = robot.a_Y = 0;
  robot.mu_1 = robot.mu_2 = Wheels::Zero();
  FloorParameters floor;
  floor.f = Wheels::Zero();
  floor.slope = 0.3;
  floor.uphill = 0.7;
  const double dt = 0.01, way = -0.5 * floor.g * std::sin(floor.slope) * dt * dt;
  const auto try_turn = [&](double turn) {
    State x;
    x.values.setZero();
    x.Omega() = turn / dt;
    const HeldTorque none;
    return Try<ExtendedModel<CoulombLaw>>(kAnything, {ExtendedModel<CoulombLaw>(robot, floor), none, x}, x, 0, dt);
  };
  // What the method of order 5 is off, as a share of the way, goes with the fourth power of the turn.
  const auto off = [&](double turn) {
    const State end = try_turn(turn).end;
    EXPECT_NEAR(end.psi(), turn, 1e-12);
    const double x = way * std::cos(floor.uphill), y = way * std::sin(floor.uphill);
    return std::hypot(end.x() - x, end.y() - y) / std::abs(way) / std::pow(turn, 4);
  };
  const double at_small_turns = off(0.4);
  EXPECT_LT(at_small_turns, 5e-3);
  for (const double turn : {-0.99, 0.5, 0.7, 0.9, 0.99}) {
    EXPECT_TRUE(try_turn(turn).accepted) << turn;
    EXPECT_NEAR(off(turn) / at_small_turns, 1, 0.2) << turn;
  }
  for (const double turn : {-4.0, -1.01, 1.01, 1.2, 3.0, 6.2, 30.0, 1e3, 1e6})
    EXPECT_FALSE(try_turn(turn).accepted) << turn;
}

// Steps by odeint's own loops: the error over all of them stays near the tolerance.
TYPED_TEST(RadauTest, RunsInTheLoopsOfOdeint) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  const double end = 0.2;
  const State exact = explicit_solution(motion.system(), motion.start, 0, end);
  for (const double accuracy : {1e-5, 1e-7, 1e-9}) {
    SlipSystem<TypeParam> system = motion.system();
    IntegrationStatistics statistics;
    Radau<TypeParam> radau({accuracy, accuracy}, statistics);
    State x = motion.start;
    const std::size_t steps = odeint::integrate_adaptive(std::ref(radau), std::ref(system), x, 0.0, end, 1e-3);
    EXPECT_LT(worst(x.velocities() - exact.velocities(), exact, {accuracy, accuracy}, 10), static_cast<double>(steps));
    State by_periods = motion.start;
    radau.reset();
    int observed = 0;
    odeint::integrate_n_steps(std::ref(radau), std::ref(system), by_periods, 0.0, end / 10, 10,
                              [&](const State&, double) { ++observed; });
    EXPECT_EQ(observed, 11);
    EXPECT_LT(worst(by_periods.velocities() - exact.velocities(), exact, {accuracy, accuracy}, 10),
              static_cast<double>(steps + 10));
  }
}

// Fourth derivative of the velocities at the motion's start: that of the polynomial through nine points of the explicit
// solution. Points 2 ms apart, rates of 40/s: the ninth derivative spoils it by 1e-4, rounding by 1e-3.
template <class Model>
Velocities fourth_derivative(const Motion<Model>& motion) {
  constexpr int kPoints = 9;
  constexpr double kApart = 2e-3;
  Eigen::Matrix<double, kPoints, kPoints> powers;
  Eigen::Matrix<double, kPoints, 12> values;
  State x = motion.start;
  for (int k = 0; k < kPoints; ++k) {
    if (k > 0) x = explicit_solution(motion.system(), x, (k - 1) * kApart, k * kApart, 1e-15);
    for (int p = 0; p < kPoints; ++p) powers(k, p) = std::pow(k, p);
    values.row(k) << x.values.col(1).transpose().matrix(), x.values.col(3).transpose().matrix(),
        x.values.col(4).transpose().matrix();
  }
  const auto coefficients = (24 / std::pow(kApart, 4) * powers.fullPivLu().solve(values).row(4)).eval();
  return {coefficients.head<4>().array().transpose(), coefficients.segment<4>(4).array().transpose(),
          coefficients.tail<4>().array().transpose()};
}

// The estimate is what its quadrature, of order 3, is off: the leading term of it is
// h^4 y'''' (e^T A c^3 / 6) / gamma, with the e of (8.19) of Hairer and Wanner, section IV.8, and gamma the real
// eigenvalue of A^-1; the filter changes nothing where h times the rates is small. Rollers may count up to ten times
// less.
TYPED_TEST(RadauTest, ErrorIsThatOfTheEmbeddedFormula) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  const double root_6 = std::sqrt(6.0), gamma = 3.6378342527444957;
  const Eigen::Array3d c{(4 - root_6) / 10, (4 + root_6) / 10, 1},
      e{-(13 + 7 * root_6) / 3, (-13 + 7 * root_6) / 3, -1.0 / 3};
  Eigen::Matrix3d powers, integrals;  // A c^(k-1) = c^k / k
  powers << Eigen::Vector3d::Ones(), c.matrix(), c.square().matrix();
  integrals << c.matrix(), c.square().matrix() / 2, c.cube().matrix() / 3;
  const Eigen::Matrix3d A = integrals * powers.inverse();
  const double constant = e.matrix().dot(A * c.cube().matrix()) / 6 / gamma;
  const Velocities y = fourth_derivative(motion);
  const auto norm = [&](double roller_weight) {
    return std::sqrt((y.v.square() + y.dphi.square() + (y.dgamma / roller_weight).square()).sum() / 11);
  };
  double last = 0;
  for (const double h : {1e-3, 5e-4, 2.5e-4}) {
    // The error is 1 where the step is just accepted.
    double low = 1e-15, high = 1;
    while (high > 1.0001 * low) {
      const double allowed = std::sqrt(low * high);
      (Try<TypeParam>({0, allowed}, motion.system(), motion.start, 0, h).accepted ? high : low) = allowed;
    }
    const double reported = high, unit = std::abs(constant) * std::pow(h, 4);
    EXPECT_LT(reported, 1.1 * unit * norm(1)) << "h = " << h;
    EXPECT_GT(reported, 0.9 * unit * norm(10)) << "h = " << h;
    if (last > 0) {
      EXPECT_NEAR(last / reported, 16, 1.6);
    }
    last = reported;
  }
}

// Of two orders less, it is above the error that a step makes, wherever it asks for a step to be taken: steps whose
// estimate is what is allowed.
TYPED_TEST(RadauTest, ErrorIsAnUpperBound) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  for (const double accuracy : {1e-3, 1e-5, 1e-7, 1e-9}) {
    const Tolerance tolerance{accuracy, accuracy};
    const double h = longest_accepted(motion, tolerance);
    const Try<TypeParam> longest(tolerance, motion.system(), motion.start, 0, h);
    const State exact = explicit_solution(motion.system(), motion.start, 0, h);
    const double made = worst(longest.end.velocities() - exact.velocities(), motion.start, tolerance, 10);
    EXPECT_LT(made, 1) << "tolerance " << accuracy << ", h = " << h;
  }
}

// As the recommended length tells it.
TYPED_TEST(RadauTest, ErrorIsInUnitsOfTheTolerance) {
  const Motion<TypeParam> motion = gentle_motion<TypeParam>();
  const double h = 6e-4;  // such that the controller reaches no bound, and no step is given up before it converges
  const auto error = [&](const Tolerance& tolerance) {
    return error_told(h, Try<TypeParam>(tolerance, motion.system(), motion.start, 0, h).next);
  };
  const double unit = error({1e-9, 1e-9});
  EXPECT_NEAR(error({1e-7, 1e-7}), 0.01 * unit, 1e-4 * unit);
  EXPECT_GT(error({1e-9, 1e-11}), unit);
  EXPECT_GT(error({1e-11, 1e-9}), unit);
}

// Rollers without inertia: of index 1, the limit of ever less.
TEST(Radau, RollersWithoutInertiaAreTheLimitOfLight) {
  const auto at_end = [](double J_2) {
    const State start = stiff_motion().start;
    RobotParameters robot;
    robot.J_2 = J_2;
    Motion<PaperModel<CoulombLaw>> motion{robot, FloorParameters()};
    motion.start = start;
    const State x = stepped(motion.system(), start, 0.02, 0.06, 80);
    if (J_2 == 0) {
      // What is left of the rollers' equation is a balance, and holds.
      const Contacts c = contacts_of(motion.model, x.velocities(), x.phi());  // all wheels on roller 0
      const Wheels left = c.r_Y * c.F_Y - c.r_X * c.F_X - robot.mu_2 * x.dgamma();
      EXPECT_LT(left.abs().maxCoeff(), 1e-8 * (c.r_Y * c.F_Y).abs().maxCoeff());
      // It has an error estimate, of more than nothing.
      EXPECT_TRUE(Try<PaperModel<CoulombLaw>>({1e-7, 1e-7}, motion.system(), x, 0.06, 1e-4).accepted);
      EXPECT_FALSE(Try<PaperModel<CoulombLaw>>({1e-14, 1e-14}, motion.system(), x, 0.06, 1e-4).accepted);
    }
    return x;
  };
  const State limit = at_end(0);
  ASSERT_TRUE(limit.values.allFinite());
  const double light = distance(at_end(1e-8), limit), lighter = distance(at_end(1e-9), limit);
  EXPECT_NEAR(light / lighter, 10, 1);
}

// 1 N m on all wheels, but from a time on what is given.
class TurningTorque : public TorqueProfile {
 public:
  TurningTorque(double from, double value) : from_(from), value_(value) {}
  double begin_segment(double) override { return std::numeric_limits<double>::infinity(); }
  Wheels value(double t) const override { return Wheels::Constant(t < from_ ? 1 : value_); }

 private:
  double from_, value_;
};

TEST(Radau, FailsForWhatIsNoNumberAndRecovers) {
  const Motion<PaperModel<CoulombLaw>> motion = stiff_motion();
  constexpr Tolerance kTolerance{1e-7, 1e-7};
  for (const double value : {kNaN, std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::max()}) {
    // From the start on; at all stages, at the last two, at the last one of a step of 10 ms.
    for (const double from : {0.0, 1e-6, 5e-3, 8e-3}) {
      SCOPED_TRACE(testing::Message() << "torque " << value << " from " << from << " s on");
      const TurningTorque torque(from, value);
      SlipSystem<PaperModel<CoulombLaw>> system(motion.model, torque, motion.start);
      const HeldTorque sound(Wheels::Constant(1.0));
      SlipSystem<PaperModel<CoulombLaw>> sound_system(motion.model, sound, motion.start);
      for (const bool predicted : {false, true}) {
        IntegrationStatistics statistics;
        // Whatever the error: the number itself is why it fails.
        for (const Tolerance& tolerance : {kTolerance, kAnything}) {
          Radau<PaperModel<CoulombLaw>> radau(tolerance, statistics);
          State end;
          double t = 0, dt = 1e-3;
          if (predicted) {
            // The iterations converge, whether or not the step is accepted.
            radau.try_step(std::ref(sound_system), motion.start, t, end, dt);
          }
          State x = motion.start;
          t = 0;
          dt = 10e-3;
          ASSERT_NO_THROW(EXPECT_EQ(radau.try_step(std::ref(system), x, t, dt), odeint::fail));
          EXPECT_EQ(t, 0);
          EXPECT_TRUE((x.values == motion.start.values).all());
          EXPECT_GT(dt, 0);
          EXPECT_LT(dt, 10e-3);
          // A step that ends before that is like any other, and so is one under a sound torque.
          SlipSystem<PaperModel<CoulombLaw>>& sound_now = from == 0 ? sound_system : system;
          if (from == 0) radau.reset();  // the torque jumps
          if (tolerance.absolute < 1) {
            dt = 5e-7;
            const Try<PaperModel<CoulombLaw>> reference(tolerance, sound_system, motion.start, 0, dt);
            ASSERT_TRUE(reference.accepted);
            ASSERT_EQ(radau.try_step(std::ref(sound_now), motion.start, t, end, dt), odeint::success);
            EXPECT_LT(distance(end, reference.end), 1e-5);
          } else {
            Radau<PaperModel<CoulombLaw>> other(tolerance, statistics);
            const double length = from > 1e-3 ? 1e-3 : 5e-7;
            EXPECT_LT(distance(polished_step(radau, sound_now, motion.start, 0, length),
                               polished_step(other, sound_system, motion.start, 0, length)),
                      1e-5);
          }
        }
      }
    }
  }
}

// A torque that only the step's start sees makes the error overflow: shorter steps follow, until none advances t.
class TorqueOfAnInstant : public TorqueProfile {
 public:
  Wheels value(double t) const override { return Wheels::Constant(t == 1 ? 1e300 : 0); }
};

TEST(Radau, ShortensTheShortestStepWhoseErrorIsNoNumber) {
  const Motion<PaperModel<CoulombLaw>> motion = stiff_motion();
  const TorqueOfAnInstant torque;
  SlipSystem<PaperModel<CoulombLaw>> system(motion.model, torque, motion.start);
  IntegrationStatistics statistics;
  Radau<PaperModel<CoulombLaw>> radau({1e-7, 1e-7}, statistics);
  State end;
  double t = 1, dt = 1e-15;
  EXPECT_EQ(radau.try_step(std::ref(system), motion.start, t, end, dt), odeint::fail);
  EXPECT_LT(dt, 1e-15);
}

// Quadratic convergence is seen again after iterations that overflowed.
TEST(RadauConvergence, ForgetsWhatOverflowed) {
  RadauConvergence convergence;
  convergence.see_fresh(std::numeric_limits<double>::infinity(), 1);
  EXPECT_TRUE(convergence.leaves_little_afresh(0.1));
  convergence.see_fresh(100, 1);
  EXPECT_FALSE(convergence.leaves_little_afresh(0.1));
}

// Friction with a static peak, which falls with the slip: twice Coulomb's at rest, over slips of about 2 cm/s.
class FallingLaw {
 public:
  FallingLaw(const RobotParameters&, const FloorParameters&) {}
  static constexpr bool kLimited = true;
  SlipResistance at(const Wheels& s_squared, double nu_squared, const Wheels& limit) const {
    const Wheels inverse = s_squared.inverse(), e = (-s_squared / kSquare).exp(), fall = 2 / kSquare * e / (1 + e);
    return {limit * (1 + e) * inverse.sqrt(), (inverse + fall).sqrt(),
            nu_squared * inverse - fall * (s_squared - nu_squared)};
  }
  Wheels largest(const Wheels& limit) const { return 2 * limit; }

 private:
  static constexpr double kSquare = 4e-4;  // m^2/s^2
};

// Wheels that spin up slip through the speeds at which friction falls; those that brake pass them the other way.
TEST(Radau, FollowsFrictionThatFallsWithSlip) {
  using Model = PaperModel<FallingLaw>;
  RobotParameters robot;
  robot.J_2 = 1e-4;  // or the explicit method takes long
  FloorParameters floor;
  floor.nu = 2e-3;
  Motion<Model> motion{robot, floor};
  motion.start.values.setZero();
  motion.start.V_X() = 0.2;
  motion.start.phi() << 0.1, -0.1, 0.2, 0.05;
  motion.start.dphi() << 4, 4, 4, 4;
  const HeldTorque torque({8, -6, 0.5, 7});
  const double end = 0.015;
  const auto system = [&] { return SlipSystem<Model>(motion.model, torque, motion.start); };
  const State exact = explicit_solution(system(), motion.start, 0, end, 1e-12);
  SlipSystem<Model> within = system();
  const Contacts slipping = within.contacts(exact, end);
  ASSERT_GT((slipping.V_PX.square() + slipping.V_PY.square()).maxCoeff(), 4e-4);  // some have passed it
  for (const double accuracy : {1e-3, 1e-5, 1e-7}) {
    IntegrationStatistics statistics;
    Radau<Model> radau({accuracy, 1e-3 * accuracy}, statistics);
    State x = motion.start;
    SlipSystem<Model> moving = system();
    odeint::integrate_adaptive(std::ref(radau), std::ref(moving), x, 0.0, end, 1e-4);
    EXPECT_LT((x.velocity() - exact.velocity()).norm(), 20 * accuracy) << accuracy;
    EXPECT_LT((x.values.col(0) - exact.values.col(0)).head<3>().matrix().norm(), accuracy) << accuracy;
    EXPECT_LT(statistics.newton_iterations, 300u) << accuracy;
    // Friction of a slip where it falls belongs to a smaller slip, too, which must not show within a step.
    SlipSystem<Model> again = system();
    double t = 0, dt = 1e-5;
    State row;
    x = motion.start;
    while (radau.try_step(std::ref(again), x, t, dt) != odeint::success || t < 1e-3) {
    }
    radau.state_within(again, 0.999, row);
    EXPECT_LT((row.dphi() - x.dphi()).abs().maxCoeff(), 0.1) << accuracy;
  }
}

// The elimination without pivoting may meet a pivot that vanishes, if friction drives a wheel as strongly as its
// inertia resists at this length. Here a bearing drives it: to the last bit, nothing is left.
TEST(Radau, ShortensAStepWhosePivotVanishes) {
  const double dt = 1.0 / 128;
  RobotParameters robot;
  robot.J_1 = 1.0 / 128;
  robot.mu_1.setConstant(-(1 / dt * RadauTableau::A_inverse[0][0]) * robot.J_1);
  FloorParameters floor;
  floor.viscous_friction = 0;
  Motion<PaperModel<ViscousLaw>> motion{robot, floor};
  SlipSystem<PaperModel<ViscousLaw>> system = motion.system();
  IntegrationStatistics statistics;
  Radau<PaperModel<ViscousLaw>> radau(kAnything, statistics);
  State end;
  double t = 0, next = dt;
  EXPECT_EQ(radau.try_step(std::ref(system), motion.start, t, end, next), odeint::fail);
  EXPECT_LT(next, dt);
  EXPECT_GT(next, 0.1 * dt);
  ASSERT_EQ(radau.try_step(std::ref(system), motion.start, t, end, next), odeint::success);
  // The wheels' velocities grow by a factor of e in 2.4 ms.
  Radau<PaperModel<ViscousLaw>> accurate({1e-6, 1e-6}, statistics);
  State x = motion.start;
  odeint::integrate_adaptive(std::ref(accurate), std::ref(system), x, 0.0, dt, dt);
  const State exact = explicit_solution(system, motion.start, 0, dt);
  EXPECT_LT(distance(x, exact), 1e-4 * exact.dphi().abs().maxCoeff());
}

TEST(StepSizeController, ShrinksAndGrowsWithinBounds) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double norm : {kNaN, infinity, 1e300, 1e4}) {
    EXPECT_DOUBLE_EQ(StepSizeController().next(1, norm), 0.2) << norm;
  }
  EXPECT_DOUBLE_EQ(StepSizeController().next(1, 0), 8);
  // The safety factor is 0.8, and the exponent that of the error estimate, of order 3.
  EXPECT_DOUBLE_EQ(StepSizeController().next(1, 2), 0.8 * std::pow(2, -0.25));
  EXPECT_DOUBLE_EQ(StepSizeController().next(1, 0.5), 0.8 * std::pow(2, 0.25));
  StepSizeController control;
  control.next(1, 2);
  EXPECT_LE(control.next(0.5, 1e-6), 0.5);  // no growth right after a rejection
  EXPECT_GT(control.next(0.5, 1e-6), 0.5);
}

// Gustafsson's: 0.8 h_n (h_n / h_n-1) (err_n-1 / err_n^2)^(1/4), (8.25) of Hairer and Wanner, section IV.8, where that
// is less than what the last error alone says.
TEST(StepSizeController, FollowsTheTrendOfTheError) {
  StepSizeController control;
  control.next(1, 0.1);
  const double growing = control.next(1.2, 0.5);
  EXPECT_NEAR(growing, 0.8 * 1.2 * 1.2 * std::pow(0.1 / 0.25, 0.25), 1e-8);
  EXPECT_LT(growing, 0.8 * 1.2 * std::pow(0.5, -0.25));
  // And a new motion has none.
  control.restart();
  EXPECT_NEAR(control.next(1.2, 0.5), 0.8 * 1.2 * std::pow(0.5, -0.25), 1e-12);
}

}  // namespace
}  // namespace youbot_base_sim
