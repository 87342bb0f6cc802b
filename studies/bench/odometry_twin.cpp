// How far odometry drifts on a simulated base whose pose is known: the driver's, calibrated kinematics and
// SlipOdometry, each fitted to one drive and tried on another, longer one. See scripts/study odometry_twin.

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cstdlib>
#include <ctime>
#include <random>
#include <thread>
#include <vector>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/identify/encoder_fit.h"
#include "youbot_base_sim/simulation.h"
#include "youbot_base_sim/slip_odometry/slip_odometry.h"

namespace {

using namespace youbot_base_sim;

constexpr double kInterval = 0.02;                             // s, of readings
constexpr double kTraining = 120, kTest = 600, kDrift = 20;    // s
constexpr double kPositionNoise = 3e-4, kHeadingNoise = 5e-4;  // m, rad: of a tracking system
constexpr double kEffortNoise = 5e-3;                          // N m
constexpr double kOff = 0.9;                                   // of the parameters from which fits start

using Poses = std::vector<Eigen::Vector3d>;

Scene measured_base() {
  Scene scene;
  scene.robot = measured_robot();
  scene.solver.relative_tolerance = 1e-5;
  scene.solver.absolute_tolerance = 1e-8;
  return scene;
}

Scene guessed_base() {
  Scene scene = measured_base();
  RobotParameters& robot = scene.robot;
  for (double* size : {&robot.R, &robot.R_d, &robot.l, &robot.a_X, &robot.a_Y}) *size *= kOff;
  robot.roller_dry_friction *= kOff;
  return scene;
}

/// What encoders read, in ticks and rpm, and the pose, while random velocities are commanded for 2 to 5 s each. The
/// wheels stand at `phi` (rad) at first: encoders that count on between two drives read their true angles in both.
DriveRecord drive(unsigned seed, double duration, const Wheels& phi) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(-1, 1), length(2, 5);
  std::normal_distribution<double> normal;
  Scene scene = measured_base();
  scene.solver.control_period = 1e-3;
  scene.initial.phi() = phi;
  BaseDriver driver({});
  double next = 0.1;
  Wheels torque = Wheels::Zero();
  const auto drive = [&](double t, const State& x) {
    if (t >= next) {
      const Eigen::Vector3d velocity(0.4 * share(random), 0.3 * share(random), 0.8 * share(random));
      driver.command(t, drive_command(DriveMode::kVelocity, DriverKinematics().wheel_rates(velocity)));
      next = t + length(random);
    }
    return torque = driver.sample(t, x.dphi());
  };
  Simulation simulation(scene);
  const Motor motor;
  DriveRecord record;
  record.name = "twin";
  record.max_truth_step = 5 * kInterval;
  for (int k = 0; k * kInterval <= duration; ++k) {
    advance_to(simulation, k * kInterval, drive);
    const State& x = simulation.state();
    record.t.push_back(k * kInterval);
    record.phi.push_back(motor.tick() * (x.phi() / motor.tick()).floor());
    record.dphi.push_back(motor.rpm() * (x.dphi() / motor.rpm()).round());
    Wheels effort;
    for (int i = 0; i < kWheels; ++i)
      effort[i] = motor.milliampere() * std::round((torque[i] + kEffortNoise * normal(random)) / motor.milliampere());
    record.torque.push_back(effort);
    record.truth_t.push_back(k * kInterval);
    record.truth.emplace_back(x.x() + kPositionNoise * normal(random), x.y() + kPositionNoise * normal(random),
                              x.psi() + kHeadingNoise * normal(random));
  }
  simulation.take_switches();
  return record;
}

/// Kinematics with a lateral factor.
struct Kinematics {
  DriverKinematics lengths;
  double lateral = 1;

  Poses poses(const DriveRecord& record) const {
    Poses poses = {Eigen::Vector3d::Zero()};
    for (std::size_t k = 1; k < record.t.size(); ++k) {
      Eigen::Vector3d moved = lengths.velocity(record.phi[k] - record.phi[k - 1]);
      moved[1] *= lateral;
      const Eigen::Vector3d& before = poses.back();
      poses.push_back(before + turned(moved, before[2] + moved[2] / 2));
    }
    return poses;
  }
};

/// How far poses are off after each of these times (s), in the frame where it begins: columns of x, y (m), heading
/// (rad).
Eigen::Matrix3Xd drifts(const DriveRecord& record, const Poses& poses, double time) {
  const auto length = static_cast<std::size_t>(time / kInterval);
  const std::size_t count = (record.t.size() - 1) / length;
  Eigen::Matrix3Xd off(3, count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t a = k * length, b = a + length;
    off.col(static_cast<Eigen::Index>(k)) =
        displacement(record.truth[a], record.truth[b]) - displacement(poses[a], poses[b]);
  }
  return off;
}

/// Radius, half lengths and lateral factor that fit best over 2 s, by Gauss and Newton's method.
Kinematics calibrated(const DriveRecord& record) {
  constexpr double kStep = 1e-5;
  Kinematics best{{0.05, 0.385}, 0.95};
  const auto off = [&](const Kinematics& kinematics) -> Eigen::VectorXd {
    Eigen::Matrix3Xd values = drifts(record, kinematics.poses(record), 2);
    values.row(2) *= best.lengths.half_lengths;
    return values.reshaped();
  };
  for (int k = 0; k < 6; ++k) {
    const Eigen::VectorXd here = off(best);
    Eigen::MatrixXd slopes(here.size(), 3);
    for (int c = 0; c < 3; ++c) {
      Kinematics there = best;
      (c == 0 ? there.lengths.wheel_radius : c == 1 ? there.lengths.half_lengths : there.lateral) += kStep;
      slopes.col(c) = (off(there) - here) / kStep;
    }
    const Eigen::Vector3d change = slopes.colPivHouseholderQr().solve(here);
    best.lengths.wheel_radius -= change[0];
    best.lengths.half_lengths -= change[1];
    best.lateral -= change[2];
  }
  return best;
}

Poses followed(const DriveRecord& record, const Scene& scene, const SlipOdometry::Settings& settings, bool rates,
               bool efforts = false) {
  SlipOdometry odometry(scene, settings);
  Poses poses;
  for (std::size_t k = 0; k < record.t.size(); ++k) {
    odometry.update(record.t[k], record.phi[k], efforts ? std::optional<Wheels>(record.torque[k]) : std::nullopt,
                    rates ? std::optional<Wheels>(record.dphi[k]) : std::nullopt);
    poses.push_back(odometry.pose());
  }
  return poses;
}

struct Row {
  const char* name;
  double square_position = 0, square_heading = 0, time = 0;
  int count = 0;

  void add(const DriveRecord& test, const Poses& poses, double seconds) {
    const Eigen::Matrix3Xd off = drifts(test, poses, kDrift);
    square_position += off.topRows<2>().squaredNorm();
    square_heading += off.row(2).squaredNorm();
    count += static_cast<int>(off.cols());
    time += seconds;
  }
};

/// Adds what each odometry does on one pair of drives.
void compare(unsigned seed, std::vector<Row>& rows) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> anywhere(0, 2 * M_PI);
  Wheels phi;
  for (int i = 0; i < kWheels; ++i) phi[i] = anywhere(random);
  DriveRecord training = drive(2 * seed, kTraining, phi);
  const DriveRecord test = drive(2 * seed + 1, kTest, phi);
  EncoderFitSettings settings;
  settings.workers.threads = static_cast<int>(std::thread::hardware_concurrency());
  const EncoderFit with_rates = fit_encoders(guessed_base(), {training}, settings);
  settings.find_angles = false;
  const EncoderFit unknown = fit_encoders(guessed_base(), {training}, settings);
  SlipOdometry::Settings known;
  known.angles_at_zero = with_rates.drives.front().angles_at_zero;
  std::size_t row = 0;
  const auto add = [&](const auto& make) {
    const std::clock_t begin = std::clock();
    const Poses poses = make();
    rows[row++].add(test, poses, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  };
  add([&] { return Kinematics().poses(test); });
  add([&] { return calibrated(training).poses(test); });
  add([&] { return followed(test, guessed_base(), {}, true); });
  add([&] { return followed(test, unknown.best.scene, {}, true); });
  add([&] { return followed(test, with_rates.best.scene, {}, true, true); });
  add([&] { return followed(test, with_rates.best.scene, known, false); });
  add([&] { return followed(test, with_rates.best.scene, known, true); });
}

}  // namespace

int main(int argc, char** argv) {
  const unsigned first = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 1;
  const unsigned count = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 3;
  std::vector<Row> rows = {{"the driver's odometry"},
                           {"kinematics: radius, track and lateral factor fitted"},
                           {"slip odometry, parameters 10 % off, unknown angles"},
                           {"slip odometry, fitted for unknown angles"},
                           {"slip odometry, fitted with angles, which efforts then tell"},
                           {"slip odometry, fitted with angles, without velocities"},
                           {"slip odometry, fitted with angles"}};
  for (unsigned seed = first; seed < first + count; ++seed) compare(seed, rows);
  fmt::print("| odometry | off after {:g} s, mm | mrad | of a core, % |\n|---|---|---|---|\n", kDrift);
  for (const Row& row : rows) {
    fmt::print("| {} | {:.1f} | {:.1f} | {:.2f} |\n", row.name, 1e3 * std::sqrt(row.square_position / row.count),
               1e3 * std::sqrt(row.square_heading / row.count), 100 * row.time / (count * kTest));
  }
}
