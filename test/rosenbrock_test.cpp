// The Rosenbrock methods and their use as odeint steppers.

#include "youbot_base_sim/integration/rosenbrock.h"

#include <gtest/gtest.h>

#include <boost/numeric/odeint.hpp>

#include "random_states.h"
#include "youbot_base_sim/drive/torque_programmes.h"
#include "youbot_base_sim/integration/rosenbrock_tableaus.h"
#include "youbot_base_sim/integration/slip_system.h"

namespace youbot_base_sim {
namespace {

namespace odeint = boost::numeric::odeint;

template <class Tableau>
class RosenbrockTest : public testing::Test {};
using Tableaus = testing::Types<Rodas4, Rodas5P>;
TYPED_TEST_SUITE(RosenbrockTest, Tableaus, );

// y' = g(y) - g(s(t)) + s'(t): nonlinear, coupled and dependent on time, with the solution y = s(t).
struct ToySystem {
  struct State {
    Eigen::Array2d values = Eigen::Array2d::Zero();
  };
  struct Linearization {
    Eigen::Matrix2d J, inverse;
    void factorize(double alpha) { inverse = (alpha * Eigen::Matrix2d::Identity() - J).inverse(); }
    void solve(const State& b, State& u) const { u.values = (inverse * b.values.matrix()).array(); }
  };
  static Eigen::Array2d s(double t) { return {2 + std::sin(t), std::cos(2 * t)}; }
  static Eigen::Array2d ds(double t) { return {std::cos(t), -2 * std::sin(2 * t)}; }
  static Eigen::Array2d dds(double t) { return {-std::sin(t), -4 * std::cos(2 * t)}; }
  static Eigen::Array2d g(const Eigen::Array2d& y) { return {-y[0] * y[1] - y[0], y[0] * y[0] - 2 * std::sin(y[1])}; }
  static Eigen::Matrix2d dg(const Eigen::Array2d& y) {
    Eigen::Matrix2d result;
    result << -y[1] - 1, -y[0], 2 * y[0], -2 * std::cos(y[1]);
    return result;
  }
  void operator()(const State& x, State& dxdt, double t) const { dxdt.values = g(x.values) - g(s(t)) + ds(t); }
  void linearize(const State& x, double t, Linearization& linearization, State& dfdt) const {
    linearization.J = dg(x.values);
    dfdt.values = dds(t) - (dg(s(t)) * ds(t).matrix()).array();
  }
  double error_norm(const State& x_old, const State& x_new, const State& error, double relative,
                    double absolute) const {
    return (error.values / (absolute + relative * x_old.values.abs().max(x_new.values.abs()))).matrix().norm();
  }
  static State exact(double t) {
    State x;
    x.values = s(t);
    return x;
  }
};

// A robot in motion under torques that vary, in gentle terms: nu = 1 m/s and heavy rollers leave rates of up to 100/s,
// so that explicit methods can tell what is right. The rollers on the floor stay the same.
class GentleMotion {
 public:
  GentleMotion()
      : model_(robot(), floor()), torque_({TorquePiece{0, {1, -2, 1, 0}, {1, 0, 2, 1}, {0, 1, -1, 2}, 0.3}}) {
    start.V_X() = 0.2;
    start.Omega() = 1;
    start.dphi() << 4, -2, 6, 1;
    start.dgamma() << -10, 20, 0, 5;
    start.phi() << 0.1, -0.2, 0.3, 0;
    torque_.enter(0);
  }
  SlipSystem<CoulombLaw> system() const { return {model_, torque_, start}; }

  // State at time t (s), by an explicit method of order 8 that shares only the right-hand side.
  State solution(double t) const {
    using Numbers = std::vector<double>;
    Numbers numbers(24);
    Eigen::Map<State::Values>(numbers.data()) = start.values;
    const auto right_hand_side = [system = system()](const Numbers& y, Numbers& dydt, double time) {
      State x, dxdt;
      x.values = Eigen::Map<const State::Values>(y.data());
      system(x, dxdt, time);
      Eigen::Map<State::Values>(dydt.data()) = dxdt.values;
    };
    odeint::integrate_adaptive(odeint::make_controlled<odeint::runge_kutta_fehlberg78<Numbers>>(1e-14, 1e-14),
                               right_hand_side, numbers, 0.0, t, 1e-4);
    State result;
    result.values = Eigen::Map<State::Values>(numbers.data());
    return result;
  }

  State start;

 private:
  static RobotParameters robot() {
    RobotParameters robot;
    robot.J_2 = 1e-3;
    return robot;
  }
  static FloorParameters floor() {
    FloorParameters floor;
    floor.nu = 1;
    return floor;
  }
  SlipModel<CoulombLaw> model_;
  PiecewiseTorque torque_;
};

// Lowest order that errors show from one number of steps to twice as many.
template <class Tableau, class System, class State>
double measured_order(const System& system, const State& start, const State& end, double duration, int fewest,
                      int most) {
  double lowest = 1e300, last = 0;
  for (int steps = fewest; steps <= most; steps *= 2) {
    Rosenbrock<Tableau, System> stepper;
    State x = start;
    for (int k = 0; k < steps; ++k) stepper.do_step(system, x, k * duration / steps, duration / steps);
    const double error = (x.values - end.values).abs().maxCoeff();
    EXPECT_GT(error, 3e-13) << "rounding: " << steps << " steps are too many";
    if (last > 0) lowest = std::min(lowest, std::log2(last / error));
    last = error;
  }
  return lowest;
}

TYPED_TEST(RosenbrockTest, TellsItsErrorAsAnErrorStepperOfOdeint) {
  Rosenbrock<TypeParam, ToySystem> stepper;
  const ToySystem system;
  ToySystem::State x = system.exact(0), same = x, error;
  stepper.do_step(system, x, 0, 0.01, error);
  stepper.do_step(system, same, 0, 0.01);
  EXPECT_TRUE((x.values == same.values).all());
  EXPECT_GT(error.values.abs().maxCoeff(), 0);
  EXPECT_LT(error.values.abs().maxCoeff(), 1e-4);
}

TYPED_TEST(RosenbrockTest, ConvergesOnANonlinearNonAutonomousSystem) {
  const double duration = 2;
  EXPECT_GT(
      (measured_order<TypeParam>(ToySystem{}, ToySystem::exact(0), ToySystem::exact(duration), duration, 16, 128)),
      TypeParam::order - 0.2);
}

TYPED_TEST(RosenbrockTest, ConvergesOnTheRobot) {
  const GentleMotion motion;
  const double duration = 0.05;
  EXPECT_GT((measured_order<TypeParam>(motion.system(), motion.start, motion.solution(duration), duration, 16, 128)),
            TypeParam::order - 0.2);
}

TYPED_TEST(RosenbrockTest, RunsInOdeintWithConstantSteps) {
  const double duration = 2;
  const int steps = 64;
  Rosenbrock<TypeParam, ToySystem> stepper;
  ToySystem::State by_hand = ToySystem::exact(0), by_odeint = by_hand, by_reference = by_hand;
  const ToySystem system;
  for (int k = 0; k < steps; ++k) stepper.do_step(system, by_hand, k * duration / steps, duration / steps);
  int observed = 0;
  const auto observer = [&](const ToySystem::State&, double t) { EXPECT_EQ(t, observed++ * duration / steps); };
  odeint::integrate_const(Rosenbrock<TypeParam, ToySystem>(), system, by_odeint, 0.0, duration, duration / steps,
                          observer);
  odeint::integrate_const(Rosenbrock<TypeParam, ToySystem>(), std::cref(system), by_reference, 0.0, duration,
                          duration / steps);
  EXPECT_EQ(observed, steps + 1);
  EXPECT_TRUE((by_odeint.values == by_hand.values).all());
  EXPECT_TRUE((by_reference.values == by_hand.values).all());
}

TYPED_TEST(RosenbrockTest, KeepsToItsTolerance) {
  std::size_t last_steps = 0;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    using Controlled = ControlledRosenbrock<TypeParam, ToySystem>;
    ToySystem::State adaptive = ToySystem::exact(0), constant = adaptive;
    const double duration = 2;
    const std::size_t steps =
        odeint::integrate_adaptive(Controlled({tolerance, tolerance}), ToySystem{}, adaptive, 0.0, duration, 1e-3);
    odeint::integrate_const(Controlled({tolerance, tolerance}), ToySystem{}, constant, 0.0, duration, 0.5);
    // The error of a step is that of the embedded method, of lower order: the solution is better than it has to be.
    EXPECT_LT((adaptive.values - ToySystem::exact(duration).values).abs().maxCoeff(), tolerance);
    EXPECT_LT((constant.values - ToySystem::exact(duration).values).abs().maxCoeff(), tolerance);
    EXPECT_GT(steps, last_steps);  // and no more is done than is asked for
    last_steps = steps;
  }
}

TYPED_TEST(RosenbrockTest, KeepsToItsToleranceOnTheRobot) {
  const GentleMotion motion;
  const double duration = 0.2;
  const State solution = motion.solution(duration);
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    using Controlled = ControlledRosenbrock<TypeParam, SlipSystem<CoulombLaw>>;
    State x = motion.start;
    odeint::integrate_adaptive(Controlled({tolerance, tolerance}), motion.system(), x, 0.0, duration, 1e-4);
    const double norm =
        motion.system().error_norm(x, solution, {(x.values - solution.values).eval()}, tolerance, tolerance);
    EXPECT_LT(norm, 1) << "tolerance " << tolerance;
  }
}

// x' = 1 up to x = 1, and nothing beyond; or nothing at all.
struct EndingSystem : ToySystem {
  explicit EndingSystem(double end) : end_(end) {}
  void operator()(const State& x, State& dxdt, double) const {
    dxdt.values = x.values[0] > end_ ? std::numeric_limits<double>::quiet_NaN() : 1.0;
  }
  void linearize(const State&, double, Linearization& linearization, State& dfdt) const {
    linearization.J.setZero();
    dfdt.values.setZero();
  }
  double end_;
};

TYPED_TEST(RosenbrockTest, RejectsWhatIsNotANumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  using Controlled = ControlledRosenbrock<TypeParam, EndingSystem>;
  for (const double bad_dt : {10.0, 0.0, nan, infinity}) {
    Controlled stepper({1e-6, 1e-6});
    EndingSystem::State x;
    double t = 0, dt = bad_dt;
    EXPECT_EQ(stepper.try_step(EndingSystem(1), x, t, dt), odeint::fail) << "dt = " << bad_dt;
    EXPECT_TRUE((x.values == 0).all());
    EXPECT_EQ(t, 0);
    if (bad_dt == 10) {
      // And goes on with shorter steps.
      while (stepper.try_step(EndingSystem(1), x, t, dt) == odeint::fail) ASSERT_GT(dt, 0.1);
      EXPECT_GT(t, 0);
      EXPECT_NEAR(x.values[0], t, 1e-14);  // rounding, by coefficients of up to 150
    } else {
      EXPECT_FALSE(dt > 0 && dt < infinity);  // never made into a length that nobody asked for
    }
  }
  // Where no step can be made odeint is told so, and gives up.
  EndingSystem::State x;
  EXPECT_THROW(odeint::integrate_adaptive(Controlled({1e-6, 1e-6}), EndingSystem(-1), x, 0.0, 1.0, 0.1),
               odeint::step_adjustment_error);
}

TEST(StepSizeController, ShrinksAndGrowsWithinBounds) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  for (const double norm : {nan, infinity, 1e300, 1e4}) {
    EXPECT_DOUBLE_EQ(StepSizeController(4).next(1, norm), 0.2) << norm;
  }
  EXPECT_DOUBLE_EQ(StepSizeController(4).next(1, 0), 6);
  // The safety factor is 0.9, and the exponent that of the error estimate.
  EXPECT_DOUBLE_EQ(StepSizeController(4).next(1, 2), 0.9 * std::pow(2, -0.2));
  EXPECT_DOUBLE_EQ(StepSizeController(3).next(1, 0.5), 0.9 * std::pow(2, 0.25));
  StepSizeController control(4);
  control.next(1, 2);
  EXPECT_LE(control.next(0.5, 1e-6), 0.5);  // no growth right after a rejection
  EXPECT_GT(control.next(0.5, 1e-6), 0.5);
}

TEST(SlipSystem, ErrorNormIsOneWhereEveryErrorIsJustAllowed) {
  const GentleMotion motion;
  Random random(31);
  State x_old, x_new, error;
  for (int column = 0; column < 6; ++column) {
    x_old.values.col(column) = random.wheels(-3, 3);
    x_new.values.col(column) = random.wheels(-3, 3);
  }
  const double relative = 1e-3, absolute = 1e-4;
  error.values = absolute + relative * x_old.values.abs().max(x_new.values.abs());
  error.values.col(0) = error.values.col(2) = absolute + relative;
  error.values(3, 1) = 0;                 // unused
  error.work() = error.gamma()[2] = 1e9;  // not controlled
  EXPECT_NEAR(motion.system().error_norm(x_old, x_new, error, relative, absolute), 1, 1e-15);
  error.values *= -2;
  EXPECT_NEAR(motion.system().error_norm(x_old, x_new, error, relative, absolute), 2, 1e-15);
}

}  // namespace
}  // namespace youbot_base_sim
