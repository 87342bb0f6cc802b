#include "youbot_base_sim/identify/ground_truth.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/identify/least_squares.h"

namespace youbot_base_sim {

namespace {

// The method is that of src/youbot_base_sim/ground_truth.py.
constexpr double kWindow = 0.1;                       // s, over which motions of marker and wheels are compared
constexpr double kMaxClock = 1.5;                     // s, offset that is searched, in steps of
constexpr double kClockStep = 0.02;                   // s
constexpr double kMinError = 1e-3;                    // m/s, that velocities are assumed to be off
constexpr double kSlip[] = {5e-3, 2e-3, 3e-3, 3e-3};  // what slip of hard starts adds to sigma: s, rad, m, m
constexpr double kMinShare = 0.7, kMaxShare = 1.4;    // of what the wheels roll that the base moves

constexpr int kUnknowns = 7;  // clock (s); yaw (rad), X and Y (m) of the marker; shares of the rolled velocity
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Velocities = Eigen::Matrix<double, Eigen::Dynamic, 3>;  // forward, left (m/s), in yaw times half_lengths (m/s)

double longest_step(const std::vector<double>& t) { return 5 * usual_interval(t) + 1e-9; }

/// Why an offset cannot be determined.
struct Undetermined : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Velocities of the marker over windows, and what the wheels roll over the same windows at any offset of the clock.
class MarkerMotion {
 public:
  MarkerMotion(const DriveRecord& record, const RobotParameters& robot)
      : record_(record), kinematics_{robot.R, robot.h + robot.l}, max_step_(longest_step(record.t)) {
    const std::vector<double>& t = record.truth_t;
    const double length = std::max(kWindow, 0.6 * record.max_truth_step);  // three samples
    std::vector<Eigen::Vector3d> seen;
    for (std::size_t a = 0, b = 1; b < t.size(); ++b) {
      if (std::floor(t[b] / length) == std::floor(t[a] / length)) continue;
      if (t[b] - t[a] < 1.5 * length && t[b] - t[a] > 0.5 * length) {
        const Eigen::Vector3d step = (record.truth[b] - record.truth[a]) / (t[b] - t[a]);
        const double heading = (record.truth[a][2] + record.truth[b][2]) / 2;
        const double c = std::cos(heading), s = std::sin(heading);
        seen.emplace_back(c * step[0] + s * step[1], c * step[1] - s * step[0], kinematics_.half_lengths * step[2]);
        windows_.push_back({t[a], t[b]});
      }
      a = b;
    }
    seen_.resize(static_cast<Eigen::Index>(seen.size()), 3);
    for (std::size_t k = 0; k < seen.size(); ++k) seen_.row(static_cast<Eigen::Index>(k)) = seen[k];
  }

  const Velocities& seen() const { return seen_; }
  double half_lengths() const { return kinematics_.half_lengths; }

  /// NaN where the wheels' readings have a gap.
  Velocities rolled(double clock) const {
    Velocities rolled(seen_.rows(), 3);
    for (std::size_t k = 0; k < windows_.size(); ++k) {
      const auto [begin, end] = windows_[k];
      Eigen::Vector3d v = kinematics_.velocity((phi(end + clock) - phi(begin + clock)) / (end - begin));
      v[2] *= kinematics_.half_lengths;
      rolled.row(static_cast<Eigen::Index>(k)) = v;
    }
    return rolled;
  }

  /// What a marker sees.
  Velocities expected(const Unknowns& x) const {
    const Velocities base = rolled(x[0]) * x.tail<3>().asDiagonal();
    const Eigen::ArrayXd turn = base.col(2).array() / kinematics_.half_lengths;
    const Eigen::ArrayXd forward = base.col(0).array() - x[3] * turn, left = base.col(1).array() + x[2] * turn;
    const double c = std::cos(x[1]), s = std::sin(x[1]);
    Velocities seen(base.rows(), 3);
    seen << c * forward + s * left, c * left - s * forward, base.col(2);
    return seen;
  }

 private:
  Wheels phi(double t) const {
    const std::vector<double>& times = record_.t;
    const auto next = std::lower_bound(times.begin(), times.end(), t);
    if (next == times.begin() || next == times.end() || *next - *(next - 1) > max_step_)
      return Wheels::Constant(std::nan(""));
    return interpolated(times, record_.phi, t);
  }

  const DriveRecord& record_;
  DriverKinematics kinematics_;
  double max_step_;
  std::vector<std::pair<double, double>> windows_;  // begin and end, s
  Velocities seen_;
};

/// The offset at which the wheels' motion explains the marker's best by any linear map, and the yaw of this map.
Unknowns search_clock(const MarkerMotion& motion) {
  const int steps = static_cast<int>(std::lround(kMaxClock / kClockStep));
  std::vector<double> unexplained;
  std::vector<Eigen::Matrix3d> maps;
  for (int k = -steps; k <= steps; ++k) {
    const Velocities rolled = motion.rolled(k * kClockStep);
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero(), products = Eigen::Matrix3d::Zero();
    double sum = 0;
    for (Eigen::Index i = 0; i < rolled.rows(); ++i) {
      if (!rolled.row(i).allFinite()) continue;
      squares += rolled.row(i).transpose() * rolled.row(i);
      products += rolled.row(i).transpose() * motion.seen().row(i);
      sum += motion.seen().row(i).squaredNorm();
    }
    Eigen::Matrix3d map;
    for (int c = 0; c < 3; ++c) map.col(c) = solve_least_squares(squares, products.col(c), 1e-9);
    unexplained.push_back(sum > 0 ? 1 - (map.array() * products.array()).sum() / sum : 1);
    maps.push_back(map);
  }
  const auto best = std::min_element(unexplained.begin(), unexplained.end()) - unexplained.begin();
  const int last = 2 * steps;
  if (unexplained[best] > 0.3 || best == 0 || best == last) {
    throw Undetermined(
        fmt::format("its motion does not fit the wheels' with any clock within {:g} s: {:.0f} % of it "
                    "stays unexplained",
                    kMaxClock, 100 * unexplained[best]));
  }
  for (int k = 1; k < last; ++k) {
    const bool low = unexplained[k] <= unexplained[k - 1] && unexplained[k] <= unexplained[k + 1];
    if (!low || std::abs(k - best) <= 5 || unexplained[k] >= 2 * unexplained[best] + 0.02) continue;
    throw Undetermined(fmt::format("its clock cannot be determined: {:.2f} s and {:.2f} s fit alike",
                                   static_cast<double>(best - steps) * kClockStep, (k - steps) * kClockStep));
  }
  Unknowns x = Unknowns::Ones();
  const Eigen::Matrix3d& map = maps[best];
  x.head<4>() << static_cast<double>(best - steps) * kClockStep,
      std::atan2(map(1, 0) - map(0, 1), map(0, 0) + map(1, 1)), 0, 0;
  return x;
}

/// How far off velocities usually are, by their medians: forward, left and in yaw.
Eigen::Array3d usual_errors(const Velocities& off, const std::vector<Eigen::Index>& known) {
  Eigen::Array3d usual;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> sizes;
    for (const Eigen::Index i : known) sizes.push_back(std::abs(off(i, c)));
    usual[c] = std::max(kMinError, 1.4826 * median(sizes));
  }
  return usual;
}

/// The rows of a step of Gauss and Newton with Huber's weights, since wheels slip in hard starts, and of the prior.
struct Linearized {
  Eigen::MatrixXd slopes;
  Eigen::VectorXd residuals;
  double scatter = 1;  ///< variance of the residuals
};

Linearized linearized(const MarkerMotion& motion, const Unknowns& x) {
  constexpr double kStep = 1e-4;
  const Unknowns prior = (Unknowns() << 1, 10, 0.5, 0.5, 0.3, 0.3, 0.3).finished();
  const Velocities off = motion.seen() - motion.expected(x);
  std::array<Velocities, kUnknowns> slopes;
  for (int u = 0; u < kUnknowns; ++u) {
    const Unknowns step = kStep * Unknowns::Unit(u);
    slopes[u] = (motion.expected(x + step) - motion.expected(x - step)) / (2 * kStep);
  }
  std::vector<Eigen::Index> known;
  for (Eigen::Index i = 0; i < off.rows(); ++i) {
    if (off.row(i).allFinite() && slopes[0].row(i).allFinite()) known.push_back(i);
  }
  const Eigen::Array3d usual = usual_errors(off, known);
  const auto n = static_cast<Eigen::Index>(3 * known.size());
  Linearized rows{Eigen::MatrixXd(n + kUnknowns, kUnknowns), Eigen::VectorXd::Zero(n + kUnknowns)};
  double weights = 0;
  for (std::size_t k = 0; k < known.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(3 * k);
    const Eigen::Array3d scaled = off.row(known[k]).transpose().array() / usual;
    const double weight = std::min(1.0, std::pow(scaled.square().sum() + 1e-9, -0.25));
    weights += weight;
    rows.residuals.segment<3>(row) = weight * scaled;
    for (int u = 0; u < kUnknowns; ++u)
      rows.slopes.block<3, 1>(row, u) = weight * slopes[u].row(known[k]).transpose().array() / usual;
  }
  rows.slopes.bottomRows<kUnknowns>() = prior.cwiseInverse().asDiagonal();
  rows.scatter = std::max(0.1, 2 * rows.residuals.squaredNorm() / (3 * weights));  // 2: neighbours are alike
  return rows;
}

struct Offsets {
  Unknowns value, sigma;
};

Offsets find_offsets(const MarkerMotion& motion) {
  constexpr int kSteps = 40;
  constexpr double kConverged = 1e-7;
  Unknowns x = search_clock(motion);
  Linearized rows;
  for (int k = 0; k < kSteps; ++k) {
    rows = linearized(motion, x);
    const Unknowns step = solve_least_squares(normal_matrix(rows.slopes), rows.slopes.transpose() * rows.residuals);
    x += step;
    if ((step.array().abs() < kConverged).all()) break;
  }
  return {x, (rows.scatter * unit_covariance(rows.slopes).diagonal()).cwiseSqrt()};
}

/// Throws UnusableRecord where a base of other sizes drove.
void check_sizes(const DriveRecord& record, const Offsets& offsets) {
  constexpr double kKnown = 0.05;
  constexpr const char* kDirections[] = {"forward", "lateral", "in yaw"};
  for (int m = 0; m < 3; ++m) {
    const double share = offsets.value[4 + m];
    if (offsets.sigma[4 + m] > kKnown || (share > kMinShare && share < kMaxShare)) continue;
    throw UnusableRecord(fmt::format(
        "{}: {} the base moves {:.2f} times as far as wheels of the scene's sizes roll; must be {:g} to {:g} times: "
        "start from a scene of this base, with --scene",
        record.name, kDirections[m], share, kMinShare, kMaxShare));
  }
}

void check_odometry(const DriveRecord& record, const RobotParameters& robot) {
  constexpr double kMaxApart = 1.25;
  const auto check = [&](const char* what, double of_odometry, double of_scene) {
    const double ratio = of_odometry / of_scene;
    if (of_odometry == 0 || (ratio < kMaxApart && ratio > 1 / kMaxApart)) return;
    throw UnusableRecord(fmt::format(
        "{}: its odometry has a {} of {:.4g} m, where the scene has {:.4g} m; must be within 25 %: start from a scene "
        "of this base, with --scene",
        record.name, what, of_odometry, of_scene));
  };
  check("wheel radius", record.odometry_radius, robot.R);
  check("half wheelbase plus half track", record.odometry_lengths, robot.h + robot.l);
}

/// Moves the marker's poses onto the base and to the clock of the wheels.
void move_onto_base(DriveRecord& record, const Offsets& offsets) {
  const double clock = offsets.value[0], yaw = offsets.value[1], X = offsets.value[2], Y = offsets.value[3];
  for (double& t : record.truth_t) t += clock;
  for (Eigen::Vector3d& pose : record.truth) {
    pose[2] -= yaw;
    const double c = std::cos(pose[2]), s = std::sin(pose[2]);
    pose.head<2>() -= Eigen::Vector2d(c * X - s * Y, s * X + c * Y);
  }
}

}  // namespace

std::vector<std::string> prepare_ground_truth(DriveRecord& record, const RobotParameters& robot) {
  std::vector<std::string> findings;
  check_odometry(record, robot);
  if (!record.has_truth()) return findings;
  record.max_truth_step = longest_step(record.truth_t);
  for (std::size_t k = 1; k < record.truth_t.size(); ++k) {
    const double step = record.truth_t[k] - record.truth_t[k - 1];
    if (step < record.max_truth_step) continue;
    findings.push_back(fmt::format("{}: a gap in ground truth of {:.2f} s at {:.2f} s: left out", record.name, step,
                                   record.truth_t[k - 1]));
  }
  try {
    const Offsets found = find_offsets(MarkerMotion(record, robot));
    check_sizes(record, found);
    if (!record.truth_of_marker) return findings;
    if (found.sigma[0] > kClockStep) throw Undetermined("its clock cannot be determined: drive with starts and stops");
    if (found.sigma[1] > 0.1)
      throw Undetermined("the marker's yaw on the base cannot be determined: drive forward and lateral too");
    move_onto_base(record, found);
    const auto sigma = [&](int k) { return std::hypot(found.sigma[k], kSlip[k]); };
    findings.push_back(fmt::format(
        "{}: ground truth is of a marker at X = {:.4f} m, Y = {:.4f} m (sigma {:.4f} m), yaw {:.4f} rad (sigma {:.4f} "
        "rad) on the base; {:+.4f} s (sigma {:.4f} s) are added to its stamps",
        record.name, found.value[2], found.value[3], std::max(sigma(2), sigma(3)), found.value[1], sigma(1),
        found.value[0], sigma(0)));
  } catch (const Undetermined& reason) {
    if (!record.truth_of_marker) return findings;
    record.truth.clear();
    record.truth_t.clear();
    findings.push_back(fmt::format("{}: ground truth is not used: {}", record.name, reason.what()));
  }
  return findings;
}

}  // namespace youbot_base_sim
