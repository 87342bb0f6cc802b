// Every method of the table on the same motions: order, location of switches, the paper's cases, sliding mode,
// fallback, restart.

#include "youbot_base_sim/integration/methods.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "explicit_solution.h"
#include "physics/random_states.h"
#include "reference_rows.h"
#include "youbot_base_sim/drive/torque_profiles.h"
#include "youbot_base_sim/integration/difference_jacobian.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

const std::string kRoot = YOUBOT_BASE_SIM_SOURCE_DIR;

// What is known about a method from the literature.
struct Known {
  double order;         // of the error over a motion by the number of steps
  double coarse, fine;  // tolerances between which it shows
};
const std::map<std::string, Known> kKnown = {
    // Hairer and Wanner, Solving Ordinary Differential Equations II, sections IV.5 and IV.7
    {"radau", {5, 1e-5, 1e-9}},
    {"rosenbrock4", {4, 1e-5, 1e-9}},
    // Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.5
    {"dopri5", {5, 1e-9, 1e-12}},
};

class MethodTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_EQ(kKnown.count(GetParam()), 1u) << "a new method: tell its order here"; }

  const Method& method() const { return *find_method(GetParam()); }
  const Known& known() const { return kKnown.at(GetParam()); }
  IntegrationSettings settings(double tolerance) const { return {GetParam(), tolerance, tolerance}; }
};

// The error over a gentle motion, with rates of 100/s, that a tolerance allows.
double allowed_error(double tolerance) { return 10 * tolerance; }

double distance(const State& a, const State& b) {
  return (a.values.leftCols<5>() - b.values.leftCols<5>()).abs().maxCoeff();  // all but gamma
}

// A robot in gentle terms, rates of up to 100/s, so that explicit methods are as good as others: its friction turns
// over 1 m/s, and its rollers are heavy.
struct GentleRobot {
  GentleRobot() {
    robot.J_2 = 1e-3;
    floor.nu = 1;
  }
  std::unique_ptr<MotionIntegrator> integration(const State& start, const TorqueProfile& torque,
                                                const IntegrationSettings& settings) const {
    return make_integrator({Model::kCoulomb, robot, floor, start, torque, settings});
  }
  RobotParameters robot;
  FloorParameters floor;
};

// Under torques that vary 20 times a second, so that all methods need many steps, without a switch for 0.3 s.
struct SmoothMotion : GentleRobot {
  SmoothMotion() {
    torque.begin_segment(0);
    start.V_X() = 0.05;
    start.Omega() = 0.1;
    start.dphi() << 1, -0.5, 0.7, 0.2;
    start.dgamma() << -2, 3, 0, 1;
    start.phi() << 0.1, -0.1, 0.05, 0;
  }
  static constexpr double kEnd = 0.3;  // s

  State exact() const {
    return explicit_solution(SlipSystem<PaperModel<CoulombLaw>>(PaperModel<CoulombLaw>(robot, floor), torque, start),
                             start, 0, kEnd);
  }

  PiecewiseTorque torque{{TorqueSegment{0, {0.1, -0.1, 0.05, 0}, {0.3, 0, 0.2, 0.1}, {0, 0.3, -0.2, 0.3}, 0.05}}};
  State start;
};

TEST_P(MethodTest, HasItsOrderOnSmoothMotion) {
  const SmoothMotion motion;
  const State exact = motion.exact();
  const auto run = [&](double tolerance, std::uint64_t& steps) {
    const auto integration = motion.integration(motion.start, motion.torque, settings(tolerance));
    State x = motion.start;
    integration->advance(x, 0, motion.kEnd, motion.kEnd);
    steps = integration->statistics().steps;
    EXPECT_EQ(integration->statistics().switches, 0u);
    EXPECT_EQ(integration->statistics().fallback_steps, 0u);
    return distance(x, exact);
  };
  std::uint64_t few = 0, many = 0;
  const double coarse = run(known().coarse, few), fine = run(known().fine, many);
  EXPECT_GT(fine, 1e-14);  // not lost in rounding
  EXPECT_GT(many, few);
  const double order = std::log(coarse / fine) / std::log(static_cast<double>(many) / static_cast<double>(few));
  EXPECT_NEAR(order, known().order, 0.15 * known().order + 0.1) << coarse << " and " << fine;
  // Errors of the velocities add up over the time that they take to die out, a hundredth of a second.
  EXPECT_LT(coarse, 100 * known().coarse);
  EXPECT_LT(fine, 100 * known().fine);
}

// Switches by the equations alone: one millisecond after another by an explicit method of order 8, and bisection in
// those where a wheel leaves its roller.
template <class Model>
struct Bisection {
  Bisection(const Model& model, const TorqueProfile& torque, const State& start)
      : system(model, torque, start), x(start), pitch(2 * kPi / model.robot().rollers) {
    for (int i = 0; i < kWheels; ++i) rollers[i] = std::floor(x.phi()[i] / pitch + 0.5);
  }

  void run(double t_end) {
    double t = 0;
    while (t < t_end - 1e-12) {
      const double chunk = std::min(1e-3, t_end - t);
      if (left(step(t, chunk)) < 0) {
        x = step(t, chunk);
        t += chunk;
        continue;
      }
      double low = 0, high = chunk;
      while (high - low > 2e-15) {
        const double middle = 0.5 * (low + high);
        (left(step(t, middle)) < 0 ? low : high) = middle;
      }
      x = step(t, high);
      const int i = left(x);
      t += high;
      const int direction = x.phi()[i] > rollers[i] * pitch ? 1 : -1;
      rollers[i] += direction;
      system.modes().set_roller(i, static_cast<std::int64_t>(rollers[i]));
      switches.push_back({t, i, 0, 0, (rollers[i] - 0.5 * direction) * pitch, direction});
    }
  }

  SlipSystem<Model> system;
  State x;
  std::vector<RollerSwitch> switches;

 private:
  State step(double t, double dt) const { return explicit_solution(system, x, t, t + dt); }
  // A wheel that is no longer on its roller; -1 if there is none.
  int left(const State& state) const {
    for (int i = 0; i < kWheels; ++i) {
      if (std::abs(state.phi()[i] - rollers[i] * pitch) > 0.5 * pitch) return i;
    }
    return -1;
  }

  double pitch;
  std::array<double, kWheels> rollers{};
};

struct SwitchingMotion : GentleRobot {
  SwitchingMotion() {
    torque.begin_segment(0);
    start.V_X() = 0.3;
    start.V_Y() = -0.2;
    start.Omega() = 1;
    start.dphi() << 20, -25, 30, 8;
    start.phi() << 0.1, -0.2, 0.3, 0.45;
  }
  static constexpr double kEnd = 0.4;  // s
  PiecewiseTorque torque{{TorqueSegment{0, {1, -2, 1, 0}, {1, 0, 2, 1}, {0, 1, -1, 2}, 0.3}}};
  State start;
};

// The reference is computed once for all methods.
const Bisection<PaperModel<CoulombLaw>>& switching_reference() {
  static const Bisection<PaperModel<CoulombLaw>> kReference = [] {
    const SwitchingMotion motion;
    Bisection<PaperModel<CoulombLaw>> bisection(PaperModel<CoulombLaw>(motion.robot, motion.floor), motion.torque,
                                                motion.start);
    bisection.run(motion.kEnd);
    return bisection;
  }();
  return kReference;
}

TEST_P(MethodTest, LocatesSwitches) {
  const SwitchingMotion motion;
  const auto& due = switching_reference().switches;
  ASSERT_GE(due.size(), 12u);
  for (const double tolerance : {1e-6, 1e-9}) {
    const auto integration = motion.integration(motion.start, motion.torque, settings(tolerance));
    State x = motion.start;
    integration->advance(x, 0, motion.kEnd, motion.kEnd);
    const std::vector<RollerSwitch> switches = integration->take_switches();
    ASSERT_EQ(switches.size(), due.size());
    EXPECT_EQ(integration->statistics().switches, due.size());
    // Times are as good as the motion is at wheel rates of about 10 rad/s.
    const double allowed = allowed_error(tolerance);
    for (std::size_t k = 0; k < due.size(); ++k) {
      EXPECT_NEAR(switches[k].t, due[k].t, allowed) << "switch " << k;
      EXPECT_EQ(switches[k].wheel, due[k].wheel) << "switch " << k;
      EXPECT_EQ(switches[k].direction, due[k].direction) << "switch " << k;
      EXPECT_NEAR(switches[k].phi, due[k].phi, 1e-14) << "switch " << k;
      EXPECT_EQ(switches[k].count, 1) << "switch " << k;
    }
    EXPECT_LT(distance(x, switching_reference().x), 100 * allowed);
  }
}

// The simulation of a paper's case by this method.
class PaperCaseTest : public MethodTest {
 protected:
  Simulation simulation(const std::string& scene, const std::string& model, double tolerance) const {
    return Simulation(load(scene, model, GetParam(), tolerance));
  }
  static Scene load(const std::string& scene, const std::string& model, const std::string& method, double tolerance) {
    return load_scene(kRoot + "/config/scenes/" + scene + ".yaml",
                      {{"model", model}, {"solver.method", method}, {"solver.relative_tolerance", tolerance}});
  }
};

TEST_P(PaperCaseTest, EndsWithinItsToleranceOfTheReference) {
  for (const std::string scene : {"case1_counter_clockwise", "case2"}) {
    for (const std::string model : {"coulomb", "viscous"}) {
      SCOPED_TRACE(scene + " " + model);
      const double tolerance = method().is_explicit ? 1e-7 : 1e-8;
      const double end = method().is_explicit ? 0.05 : 1;  // s: explicit methods take some 10^5 steps for 0.05 s
      const double allowed = 10 * tolerance, allowed_rate = 100 * allowed;  // rates of rollers are up to 100 rad/s

      // The reference's row at 1 s. Short runs go by Radau's at a tolerance of 1e-11, which is compared with all rows
      // elsewhere, and by the reference's first switch. An explicit method at its limit of stability lets the rates of
      // the stiffest contacts tremble, at single instants some hundred times its tolerance: one instant tells nothing.
      const auto reference = reference_rows("reference/" + scene + "_" + model);
      Simulation simulation = this->simulation(scene, model, tolerance), tight(load(scene, model, "radau", 1e-11));
      std::vector<double> rate_errors;
      constexpr int kInstants = 25;
      for (int k = 1; k <= kInstants; ++k) {
        const double t = end * k / kInstants;
        simulation.advance_to(t);
        tight.advance_to(t);
        const auto error = (simulation.state().values - tight.state().values).abs().eval();
        EXPECT_LT((error.topLeftCorner<3, 1>().maxCoeff()), allowed) << t << " s";
        EXPECT_LT((error.topRows<3>().col(1).maxCoeff()), allowed) << t << " s";
        rate_errors.push_back(error.middleCols<3>(2).maxCoeff());
      }
      std::sort(rate_errors.begin(), rate_errors.end());
      EXPECT_LT(rate_errors[kInstants / 2], allowed_rate);
      EXPECT_LT(rate_errors.back(), method().is_explicit ? 20 * allowed_rate : allowed_rate);
      EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
      const State& x = simulation.state();
      if (end == 1) {
        const auto& row = reference.at(1);
        ASSERT_EQ(row[0], "1");
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(x.values(k, 0), std::stod(row[1 + k]), allowed) << "column " << 1 + k;
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(x.values(k, 1), std::stod(row[4 + k]), allowed) << "column " << 4 + k;
        for (int i = 0; i < kWheels; ++i) {
          EXPECT_NEAR(x.phi()[i], std::stod(row[7 + i]), 100 * allowed);
          EXPECT_NEAR(x.dphi()[i], std::stod(row[11 + i]), allowed_rate);
          EXPECT_NEAR(x.dgamma()[i], std::stod(row[15 + i]), allowed_rate);
        }
      }

      const std::vector<RollerSwitch> switches = simulation.take_switches(), due = tight.take_switches();
      ASSERT_EQ(switches.size(), due.size());
      EXPECT_GE(due.size(), 2u);
      for (std::size_t k = 0; k < due.size(); ++k) {
        EXPECT_NEAR(switches[k].t, due[k].t, 10 * allowed) << "switch " << k;
        EXPECT_EQ(switches[k].wheel, due[k].wheel) << "switch " << k;
        EXPECT_EQ(switches[k].roller_from, due[k].roller_from) << "switch " << k;
        EXPECT_EQ(switches[k].roller_to, due[k].roller_to) << "switch " << k;
        EXPECT_EQ(switches[k].direction, due[k].direction) << "switch " << k;
      }
      for (const auto& row : reference_rows("reference/" + scene + "_" + model + "_switches")) {
        const std::size_t number = std::stoul(row[0]);
        if (number >= switches.size()) break;
        EXPECT_NEAR(switches[number].t, std::stod(row[1]), 10 * allowed) << "switch " << number;
        EXPECT_EQ(kWheelNames[static_cast<std::size_t>(switches[number].wheel)], row[2]) << "switch " << number;
        EXPECT_EQ(switches[number].roller_to, std::stoi(row[4])) << "switch " << number;
      }
    }
  }
}

// The paper's robot turns about wheel fl, which stands still a micrometre's turn below the edge of its roller. Either
// roller drives it back over the edge, and it comes to rest on both. A small torque on it varies meanwhile, which is to
// change only how they share its load.
TEST_P(PaperCaseTest, HoldsAWheelBetweenTwoRollers) {
  const auto run = [](const std::string& method, double tolerance) {
    Scene scene;
    scene.duration = 1;
    scene.solver.method = method;
    scene.solver.relative_tolerance = tolerance;
    scene.solver.absolute_tolerance = 1e-3 * tolerance;
    scene.drive = TorqueSegments{TorqueSegment{0, {0.1, 0, 0, 0}, {0, 0, 0, 0}, {0.3, 0.1, 0, 0}, 0.02}};
    scene.initial.Omega() = 0.5;
    scene.initial.V_X() = scene.robot.l * scene.initial.Omega();
    scene.initial.V_Y() = -scene.robot.h * scene.initial.Omega();
    NoSlipModel(scene.robot).constrain(scene.initial);
    scene.initial.phi()[0] = kPi / 6 - 2e-6;
    scene.initial.dphi()[0] = scene.initial.dgamma()[0] = 0;
    auto simulation = std::make_unique<Simulation>(scene);
    for (int k = 1; k <= 4; ++k) {
      simulation->advance_to(3e-3 * k);
      if (k < 3) continue;
      EXPECT_EQ(simulation->statistics().shared_contacts, 1u) << method;
      EXPECT_TRUE(simulation->other_rollers()[0].has_value()) << method << " at " << simulation->time();
      EXPECT_NEAR(simulation->state().phi()[0], kPi / 6, 1e-14) << method;
      EXPECT_NEAR(simulation->state().dphi()[0], 0, 1e-12) << method;
    }
    EXPECT_EQ(simulation->statistics().fallback_steps, 0u) << method;
    EXPECT_LT(simulation->energy_balance_error(), 1e-4) << method;
    return simulation;
  };
  const auto tight = run("dopri5", 1e-10), other = run(GetParam(), 1e-6);
  const State& x = other->state();
  const State& exact = tight->state();
  // What momentum the wheel has when it is caught is less than the tolerance.
  constexpr double kAllowed = 1e-5;
  EXPECT_LT((x.values.topLeftCorner<3, 2>() - exact.values.topLeftCorner<3, 2>()).abs().maxCoeff(), kAllowed);
  for (int i = 1; i < kWheels; ++i) EXPECT_NEAR(x.phi()[i], exact.phi()[i], 10 * kAllowed);
}

// A torque that becomes no number for 10 us from 3 ms on: no step of a method leads out of that, but a step of the
// fallback does, which asks only for the torque at its end.
class TorqueWithAHole : public HeldTorque {
 public:
  using HeldTorque::HeldTorque;
  Wheels value(double t) const override {
    if (open && t < 3.01e-3) return Wheels::Constant(std::numeric_limits<double>::quiet_NaN());
    return HeldTorque::value(t);
  }
  bool open = false;
};

TEST_P(MethodTest, FallsBackWhereItCannotStepAndGoesOn) {
  const GentleRobot gentle;
  State start;
  start.dphi() << 40, -30, 10, 5;
  const auto run = [&](bool with_hole, std::unique_ptr<MotionIntegrator>& integration) {
    TorqueWithAHole torque(Wheels{1, -1, 0.5, 0});
    integration = gentle.integration(start, torque, settings(1e-7));
    State x = start;
    integration->advance(x, 0, 3e-3, 3e-3);
    torque.open = with_hole;
    integration->torque_jumped();
    integration->advance(x, 3e-3, 0.1, 0.1);
    return x;
  };
  std::unique_ptr<MotionIntegrator> interrupted, uninterrupted;
  const State x = run(true, interrupted), exact = run(false, uninterrupted);
  ASSERT_TRUE(x.values.allFinite());
  EXPECT_EQ(uninterrupted->statistics().exhausted, 0u);
  EXPECT_EQ(uninterrupted->statistics().fallback_steps, 0u);
  EXPECT_EQ(interrupted->statistics().exhausted, 1u);
  EXPECT_EQ(interrupted->statistics().fallback_steps, 50u);  // of 20 us: a millisecond's worth
  // Steps of first order and 20 us, at rates of 100/s and 40 rad/s.
  EXPECT_LT(distance(x, exact), 0.5 * 2e-5 * 100 * 40);
  const auto switches = interrupted->take_switches(), due = uninterrupted->take_switches();
  EXPECT_GT(due.size(), 2u);
  ASSERT_EQ(switches.size(), due.size());
  for (std::size_t k = 0; k < due.size(); ++k) {
    EXPECT_EQ(switches[k].wheel, due[k].wheel);
    EXPECT_NEAR(switches[k].t, due[k].t, 1e-4);
  }
}

// The torque jumps each 2 ms; how the run is cut into calls does not matter.
TEST_P(MethodTest, ResultsDoNotDependOnHowARunIsCut) {
  const GentleRobot gentle;
  State start;
  start.dphi() << 40, -30, 10, 5;
  constexpr double kPeriod = 2e-3;
  constexpr int kPeriods = 50;
  constexpr double kTolerance = 1e-8;
  const auto run = [&](int parts, bool foreseen, std::vector<RollerSwitch>& switches) {
    HeldTorque torque;
    const auto integration = gentle.integration(start, torque, settings(kTolerance));
    State x = start;
    for (int k = 0; k < kPeriods; ++k) {
      torque.set(k % 3 == 0 ? Wheels{2, -1, 0, 1} : Wheels{-1, 0.5, static_cast<double>(k % 5), 1});
      integration->torque_jumped();
      const double period_end = (k + 1) * kPeriod;
      double t = k * kPeriod;
      for (int part = 1; part <= parts; ++part) {
        const double end = part < parts ? (k + static_cast<double>(part) / parts) * kPeriod : period_end;
        integration->advance(x, t, end, foreseen ? period_end : end);
        t = end;
      }
    }
    switches = integration->take_switches();
    return x;
  };
  std::vector<RollerSwitch> due, switches;
  const State at_once = run(1, false, due);
  EXPECT_GT(due.size(), 2u);
  const auto expect_same_switches = [&](double allowed) {
    ASSERT_EQ(switches.size(), due.size());
    for (std::size_t k = 0; k < due.size(); ++k) {
      EXPECT_EQ(switches[k].wheel, due[k].wheel);
      EXPECT_NEAR(switches[k].t, due[k].t, allowed);
    }
  };
  // Steps that end elsewhere are as accurate as others; rows within steps, where Radau knows the states, change
  // nothing.
  const double allowed = 100 * allowed_error(kTolerance);
  for (const bool foreseen : {false, true}) {
    const bool same = foreseen && GetParam() == "radau";
    EXPECT_LT(distance(run(7, foreseen, switches), at_once), same ? 1e-15 : allowed);
    expect_same_switches(same ? 1e-15 : allowed);
  }
}

TEST_P(MethodTest, RefusesRollersWithoutInertiaUnlessItIsRadau) {
  RobotParameters robot;
  for (const Model model : {Model::kViscous, Model::kCoulomb}) EXPECT_EQ(refusal(method(), robot, model), "");
  robot.J_2 = 0;
  EXPECT_EQ(refusal(method(), robot, Model::kNoSlip), "");  // which needs none of them
  for (const Model model : {Model::kViscous, Model::kCoulomb}) {
    const std::string reason = refusal(method(), robot, model);
    EXPECT_EQ(reason.empty(), GetParam() == "radau");
    if (GetParam() != "radau") {
      EXPECT_NE(reason.find("roller_inertia"), std::string::npos) << reason;
    }
  }
}

TEST(Methods, TheTableNamesEachMethodOnce) {
  EXPECT_EQ(methods().front().name, IntegrationSettings().method);  // the default comes first
  const std::vector<std::string> names = method_names();
  EXPECT_EQ(methods().size(), names.size());
  EXPECT_EQ(methods().size(), kKnown.size());
  for (std::size_t k = 0; k < methods().size(); ++k) {
    EXPECT_EQ(methods()[k].name, names[k]);
    ASSERT_NE(find_method(methods()[k].name), nullptr);
    EXPECT_EQ(find_method(methods()[k].name)->name, methods()[k].name);
    EXPECT_FALSE(methods()[k].description.empty());
    EXPECT_EQ(std::count(names.begin(), names.end(), names[k]), 1);
  }
  EXPECT_EQ(find_method("euler"), nullptr);
  EXPECT_EQ(find_method(""), nullptr);
}

std::string name_of_test(const testing::TestParamInfo<std::string>& tested) { return tested.param; }
// Stages of a step that is far too long overflow: their error is no number, and neither is a step that it shortens.
TEST(Dopri5Test, TriesAShorterStepWhereItsErrorOverflows) {
  struct Explosion : SmoothSystem {
    void operator()(const State& x, State& dxdt, double) const override { dxdt.values = -1e60 * x.values; }
    double max_step(const State&, double) const override { return kInfinity; }
    State increments() const override { return {}; }
    Wheels middle() const override { return Wheels::Zero(); }
  };
  IntegrationStatistics statistics;
  const auto method = find_method("dopri5")->make({1e-6, 1e-9}, statistics);
  State x, end;
  x.values.setOnes();
  double t = 0, dt = 1;
  EXPECT_EQ(method->try_step(Explosion(), x, t, end, dt), boost::numeric::odeint::fail);
  EXPECT_EQ(t, 0);
  EXPECT_GT(dt, 0);
  EXPECT_LT(dt, 1);
}

// Each entry depends on itself, on the next one and on time; the last one has no effect.
struct Chain : SmoothSystem {
  State increments() const override {
    State steps;
    steps.values.setConstant(1e-6);
    steps.begin()[State::kSize - 1] = 0;
    return steps;
  }
  static double next(const State& x, int k) { return k + 2 < State::kSize ? x.begin()[k + 1] : 0; }
  double max_step(const State&, double) const override { return kInfinity; }
  Wheels middle() const override { return Wheels::Zero(); }
  void operator()(const State& x, State& dxdt, double t) const override {
    for (int k = 0; k < State::kSize - 1; ++k) dxdt.begin()[k] = std::sin(x.begin()[k]) * std::cos(next(x, k)) + t * t;
  }
};

// Errors of central differences: third derivatives times (1e-6)^2 / 6, and rounding of 1e-16 over 1e-6.
TEST(DifferenceJacobianTest, MeetsDerivativesInClosedForm) {
  Random random(41);
  State x;
  for (double& entry : x) entry = random.uniform(-2, 2);
  Eigen::Matrix<double, State::kSize, State::kSize> expected = decltype(expected)::Zero();
  for (int k = 0; k < State::kSize - 1; ++k) {
    const double here = x.begin()[k], next = Chain::next(x, k);
    expected(k, k) = std::cos(here) * std::cos(next);
    if (k + 2 < State::kSize) expected(k, k + 1) = -std::sin(here) * std::sin(next);
  }
  const DifferenceJacobian J = difference_jacobian(Chain(), x, 1.5);
  EXPECT_LT((J.by_state - expected).cwiseAbs().maxCoeff(), 1e-9);
  for (int k = 0; k < State::kSize - 1; ++k) EXPECT_NEAR(J.by_time.begin()[k], 3, 1e-8);
  EXPECT_EQ(J.by_time.begin()[State::kSize - 1], 0);
}

INSTANTIATE_TEST_SUITE_P(Table, MethodTest, testing::ValuesIn(method_names()), name_of_test);
INSTANTIATE_TEST_SUITE_P(Table, PaperCaseTest, testing::ValuesIn(method_names()), name_of_test);

}  // namespace
}  // namespace youbot_base_sim
