// Wheels that follow a table of angles: the base moves as it did when the angles were written, and the torques that
// come out, put in again, give the same motion.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <string>

#include "temporary_folder.h"
#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

// The spline.

WheelTable table_of(double interval, int rows, const std::function<double(double)>& angle) {
  WheelTable table;
  for (int k = 0; k < rows; ++k) {
    table.t.push_back(interval * k);
    table.values.push_back(Wheels::Constant(angle(interval * k)) * Wheels(1, -1, 2, 0.5));
  }
  return table;
}

double sine(double t) { return 3 * std::sin(2 * t); }

TEST(WheelSplineTest, PassesThroughItsRows) {
  const WheelTable table = table_of(0.02, 100, sine);
  const WheelSpline spline(table);
  for (std::size_t k = 0; k < table.t.size(); ++k) {
    EXPECT_TRUE(spline.angle(table.t[k]).isApprox(table.values[k], 1e-12) || table.values[k].abs().maxCoeff() < 1e-12);
  }
}

// Errors between the rows: of fourth order in the angle, third in the rate and second in the acceleration (de Boor).
TEST(WheelSplineTest, ConvergesWithItsOrder) {
  const auto errors = [](double interval) {
    const WheelSpline spline(table_of(interval, static_cast<int>(4 / interval) + 1, sine));
    Eigen::Array3d largest = Eigen::Array3d::Zero();
    for (double t = 1; t < 3; t += 0.0137) {  // far from the ends, whose accelerations it takes to be zero
      const Eigen::Array3d error(spline.angle(t)[0] - sine(t), spline.rate(t)[0] - 6 * std::cos(2 * t),
                                 spline.acceleration(t)[0] + 12 * std::sin(2 * t));
      largest = largest.max(error.abs());
    }
    return largest;
  };
  const Eigen::Array3d ratio = errors(0.1) / errors(0.05);
  EXPECT_GT(ratio[0], 14);
  EXPECT_GT(ratio[1], 7);
  EXPECT_GT(ratio[2], 3.5);
}

TEST(WheelSplineTest, RatesAndAccelerationsAreItsDerivatives) {
  const WheelSpline spline(table_of(0.1, 30, sine));
  constexpr double kStep = 1e-6;
  for (const double t : {-0.5, 0.03, 0.77, 1.501, 2.88, 4.0}) {
    const Wheels rate = (spline.angle(t + kStep) - spline.angle(t - kStep)) / (2 * kStep),
                 acceleration = (spline.rate(t + kStep) - spline.rate(t - kStep)) / (2 * kStep);
    EXPECT_LT((spline.rate(t) - rate).abs().maxCoeff(), 1e-7) << t;
    EXPECT_LT((spline.acceleration(t) - acceleration).abs().maxCoeff(), 1e-6) << t;
  }
}

// Encoders that round: the spline departs from their readings by the error that they have, and its rates are far better
// than differences.
TEST(WheelSplineTest, SmoothsWhatEncodersRounded) {
  constexpr double kResolution = 0.01, kInterval = 0.02;
  const WheelTable table =
      table_of(kInterval, 500, [&](double t) { return kResolution * std::round(sine(0.2 * t) / kResolution); });
  const WheelSpline smooth(table, kResolution), rough(table);
  double departure = 0, smooth_error = 0, rough_error = 0, angle_error = 0;
  for (std::size_t k = 0; k < table.t.size(); ++k) {
    const double t = table.t[k], rate = 0.2 * 6 * std::cos(0.4 * t);
    departure += std::pow(smooth.angle(t)[0] - table.values[k][0], 2) / 500;
    angle_error = std::max(angle_error, std::abs(smooth.angle(t)[0] - sine(0.2 * t)));
    smooth_error += std::pow(smooth.rate(t)[0] - rate, 2) / 500;
    rough_error += std::pow(rough.rate(t)[0] - rate, 2) / 500;
  }
  EXPECT_NEAR(std::sqrt(departure) / (kResolution / std::sqrt(12)), 1, 0.01);
  EXPECT_LT(angle_error, kResolution);
  EXPECT_LT(std::sqrt(smooth_error), 0.1 * std::sqrt(rough_error));
}

TEST(WheelSplineTest, OfAStraightLineIsTheLine) {
  for (const double resolution : {0.0, 0.01}) {
    const WheelSpline spline(table_of(0.1, 20, [](double t) { return 5 * t; }), resolution);
    EXPECT_NEAR(spline.rate(0.55)[0], 5, 1e-9);
    EXPECT_NEAR(spline.angle(7)[0], 35, 1e-9) << "beyond the last row";
  }
  const WheelSpline two(table_of(0.1, 2, [](double t) { return 5 * t; }));
  EXPECT_NEAR(two.rate(0.05)[0], 5, 1e-9);
}

// Replay.

class Replay : public testing::Test {
 protected:
  Scene load(const std::string& text) { return load_scene(folder_.write("scene.yaml", text)); }

  /// Runs the scene with this drive and writes its wheel angles every `interval` (s) to angles.csv. Returns its states.
  std::vector<State> record(const std::string& scene, const std::string& drive, double interval) {
    Simulation simulation(load(scene + drive));
    std::vector<State> states;
    std::string csv = "t,fl,fr,bl,br\n";
    for (int k = 0; k * interval <= simulation.scene().duration + 1e-9; ++k) {
      simulation.advance_to(k * interval);
      const Wheels phi = simulation.state().phi();
      csv += fmt::format("{},{},{},{},{}\n", k * interval, phi[0], phi[1], phi[2], phi[3]);
      states.push_back(simulation.state());
    }
    folder_.write("angles.csv", csv);
    return states;
  }

  /// The largest distance of a replay's poses from these states (m, rad); checks its wheels and its energy.
  double largest_distance(const std::string& scene, const std::vector<State>& states, double interval) {
    const Scene replayed = load(scene + "drive: {wheel_angle_table: angles.csv}\n");
    Simulation simulation(replayed);
    double largest = 0;
    for (std::size_t k = 0; k < states.size(); ++k) {
      simulation.advance_to(static_cast<double>(k) * interval);
      const State& x = simulation.state();
      EXPECT_LT((x.phi() - states[k].phi()).abs().maxCoeff(), 3e-7) << "more than the tolerance";
      largest = std::max(largest, std::hypot(x.x() - states[k].x(), x.y() - states[k].y(), x.psi() - states[k].psi()));
    }
    EXPECT_LT(simulation.energy_balance_error(), 5e-4) << "a thousandth of what the drives do";
    EXPECT_EQ(simulation.statistics().fallback_steps, 0u);
    return largest;
  }

  TemporaryFolder folder_;
};

const std::string kDrive =
    "drive: {torque: [{start: 0, constant: [-1.4, 1.6, 1.5, -1.3], cos: [0.5, 0.2, 0, 0.3], period: 0.8}]}\n";
const std::string kPaper = "duration: 2\n", kBeyond =
                                                "duration: 2\nrobot: {profile: measured, com_height: 0.1, "
                                                "normal_reactions: dynamic}\nfloor: {spin_radius: 0.002, slope: "
                                                "{angle: 0.05}}\nloads: [{mass: 5, position: [0.1, 0, 0.2]}]\n";

TEST_F(Replay, MovesTheBaseAsWhenTheAnglesWereWritten) {
  for (const std::string& scene :
       {kPaper, "model: viscous\n" + kPaper, kBeyond, kPaper + "solver: {method: rosenbrock4}\n"}) {
    // Shocks at the switches are shorter than the rows are apart.
    EXPECT_LT(largest_distance(scene, record(scene, kDrive, 0.004), 0.004), 4e-4) << scene;
    EXPECT_LT(largest_distance(scene, record(scene, kDrive, 0.001), 0.001), 2e-5) << scene;
  }
}

// An independent path through the equations: the same wheels under the torques that the replay says the drives exert.
// Not with a holding speed: many torques hold a wheel at rest, so that they do not tell when it starts.
TEST_F(Replay, ItsTorquesGiveTheSameMotion) {
  const std::string smooth = std::regex_replace(kBeyond, std::regex("floor: \\{"), "floor: {holding_speed: 0, ");
  for (const std::string& scene : {kPaper, smooth}) {
    record(scene, kDrive, 0.001);
    const auto difference = [&](double period) {
      const Scene replayed = load(scene + "drive: {wheel_angle_table: angles.csv}\n");
      Simulation replay(replayed), middle(replayed);
      Scene free = load(fmt::format("{}solver: {{control_period: {}}}\n", scene, period));
      free.initial = replayed.initial;
      Simulation driven(free);
      replay.advance_to(1);
      advance_to(driven, 1, [&](double t, const State&) {
        middle.advance_to(t + 0.5 * period);
        return middle.torque();
      });
      const State &a = replay.state(), &b = driven.state();
      return std::hypot(a.x() - b.x(), a.y() - b.y(), a.psi() - b.psi());
    };
    const double coarse = difference(4e-4), fine = difference(2.5e-5);
    EXPECT_LT(fine, 1e-5) << scene;
    EXPECT_LT(fine, 0.2 * coarse) << scene;
  }
}

// All that the floor pulls shows in the torques: wheels at rest hold the base on a slope.
TEST_F(Replay, TorquesOfWheelsAtRestHoldTheBase) {
  folder_.write("angles.csv", "t,fl,fr,bl,br\n0,0.1,0.1,0.1,0.1\n9,0.1,0.1,0.1,0.1\n");
  Simulation simulation(
      load("duration: 2\nrobot: {com: [0, 0], roller_damping: 10}\nfloor: {slope: {angle: 0.1}}\n"
           "drive: {wheel_angle_table: angles.csv}\n"));
  simulation.advance_to(2);
  const RobotParameters& robot = simulation.scene().robot;
  const double weight = robot.m_s() * simulation.scene().floor.g * std::sin(0.1);
  EXPECT_NEAR(simulation.torque().sum() / (weight * robot.R), 1, 1e-3);
  EXPECT_TRUE((simulation.state().phi() - 0.1).abs().maxCoeff() < 1e-12);
}

// Over whole rollers the mean of located contacts, at rates at which friction is at its limit in neither.
TEST_F(Replay, AveragedContactsMoveTheBaseAsLocatedOnesDoOnTheWhole) {
  const auto path = [&](const std::string& contacts, const Wheels& rates) {
    const Wheels end = 10 * rates;
    folder_.write("angles.csv",
                  fmt::format("t,fl,fr,bl,br\n0,0,0,0,0\n10,{},{},{},{}\n", end[0], end[1], end[2], end[3]));
    Simulation simulation(load("duration: 10\nrobot: {roller_damping: 1.0e-4, com: [0, 0], contacts: " + contacts +
                               "}\ndrive: {wheel_angle_table: angles.csv}\n"));
    simulation.advance_to(10);
    const bool averaged = contacts == "averaged";
    EXPECT_EQ(simulation.take_switches().size(), averaged ? 4u : 4u * 30u) << "counted together, or located";
    return State(simulation.state());
  };
  constexpr double kRate = M_PI;  // 30 rollers in 10 s
  const State forward = path("located", Wheels::Constant(kRate)), mean = path("averaged", Wheels::Constant(kRate));
  EXPECT_NEAR(mean.x() / (0.05 * 10 * kRate), 1, 1e-4);
  EXPECT_NEAR(forward.x() / mean.x(), 1, 0.002);
  const Wheels sideways = kRate * Wheels(-1, 1, 1, -1);
  EXPECT_NEAR(path("located", sideways).y() / path("averaged", sideways).y(), 1, 0.05);
}

// Wheels that work against each other at a small regularization speed: an error of a contact's slip, within the
// tolerance, is a large one of its friction, and of the drives' work. Rounding alone leaves a slip 1e-15 m/s off, so a
// millionth of the work. The audit allows twenty times as much.
TEST_F(Replay, EnergyAgreesWithTheWorkOfTheWheels) {
  folder_.write("angles.csv",
                "t,fl,fr,bl,br\n0,1.40,-1.50,3.59,0.56\n0.29,1.63,-1.62,3.71,0.85\n0.57,2.09,-1.48,3.58,0.96\n"
                "0.86,2.64,-1.60,3.61,1.16\n1.14,3.17,-1.50,3.63,1.32\n1.43,3.80,-1.56,3.88,1.19\n");
  constexpr double kByRounding = 1e-6 * 6;  // J, of the 6 J that the wheels exchange
  for (const double tolerance : {3e-7, 1e-9}) {
    Simulation simulation(
        load(fmt::format("{{duration: 1.4, floor: {{slip_regularization: 1.0e-9}}, "
                         "solver: {{relative_tolerance: {}}}, drive: {{wheel_angle_table: angles.csv}}}}",
                         tolerance)));
    for (int row = 1; row <= 140; ++row) {
      simulation.advance_to(0.01 * row);
      ASSERT_LT(simulation.energy_balance_error(), std::max(1000 * tolerance, kByRounding))
          << "at " << simulation.time() << " s";
    }
  }
}

TEST_F(Replay, BeginsWithTheTableOrElsewhereOnTheRollers) {
  folder_.write("angles.csv", "t,fl,fr,bl,br\n0,1,2,3,4\n0.5,2,3,4,5\n1,3,4,5,6\n");
  const std::string drive = "duration: 1\ndrive: {wheel_angle_table: angles.csv}\n";
  const Scene scene = load(drive);
  EXPECT_TRUE(scene.initial.phi().isApprox(Wheels(1, 2, 3, 4)));
  EXPECT_TRUE(scene.initial.dphi().isApprox(Wheels(2, 2, 2, 2)));
  EXPECT_NEAR(scene.initial.V_X(), 0.1, 1e-12);  // R times the rates: as it would roll
  Simulation turned(load(drive + "initial: {wheel_angles: [0.3, 0, 0, 0]}\n"));
  turned.advance_to(1);
  EXPECT_TRUE(turned.state().phi().isApprox(Wheels(2.3, 2, 2, 2), 1e-9));
}

TEST_F(Replay, RefusesWhatDoesNotGoWithIt) {
  folder_.write("angles.csv", "t,fl,fr,bl,br\n0,1,2,3,4\n1,2,3,4,5\n");
  const auto refusal = [&](const std::string& text, const std::string& drive = "wheel_angle_table: angles.csv") {
    try {
      load("duration: 1\ndrive: {" + drive + "}\n" + text);
    } catch (const SceneError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refusal(""), "accepted");
  for (const auto& [text, key] :
       std::map<std::string, std::string>{{"model: no_slip", "drive.wheel_angle_table"},
                                          {"motors: {}", "drive.wheel_angle_table"},
                                          {"solver: {control_period: 0.001}", "solver.control_period = 0.001"},
                                          {"solver: {method: dopri5}", "solver.method = dopri5"},
                                          {"initial: {wheel_rates: [0, 0, 0, 0]}", "initial.wheel_rates"}}) {
    EXPECT_NE(refusal(text).find(key), std::string::npos) << refusal(text);
  }
  EXPECT_NE(refusal("", "velocity_table: angles.csv, resolution: 0.01").find("drive.resolution = 0.01"),
            std::string::npos);
  folder_.write("angles.csv", "t,fl,fr,bl,br\n0.1,1,2,3,4\n1,2,3,4,5\n");
  EXPECT_NE(refusal("").find("it has 0.1 to 1 s"), std::string::npos) << refusal("");
}

}  // namespace
}  // namespace youbot_base_sim
