#include "youbot_base_sim/identify/first_guess.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "youbot_base_sim/identify/forward_model.h"
#include "youbot_base_sim/identify/least_squares.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

// ---- The velocity loop: M = P (w - dphi) + I (integral of w - phi) + a constant of each wheel in each motion.

/// The commanded rates, and their integrals, at the samples' times less a delay.
struct CommandHistory {
  std::vector<Wheels> rate, angle;
  std::vector<bool> sure;  // no command has just changed, or is about to
};

CommandHistory delayed_commands(const DriveRecord& record, double delay, double apart) {
  CommandHistory commanded;
  Wheels rate = Wheels::Zero(), angle = Wheels::Zero();
  double t = -delay;
  std::size_t next = 0;
  for (const double sample : record.t) {
    const double now = sample - delay;
    while (next < record.commands.t.size() && record.commands.t[next] <= now) {
      angle += (record.commands.t[next] - t) * rate;
      t = record.commands.t[next];
      rate = record.commands.values[next++];
    }
    angle += (now - t) * rate;
    t = now;
    commanded.rate.push_back(rate);
    commanded.angle.push_back(angle);
    const auto& changes = record.commands.t;
    commanded.sure.push_back((next == 0 || now >= changes[next - 1] + apart) &&
                             (next == changes.size() || now <= changes[next] - apart));
  }
  return commanded;
}

/// Normal equations of a regression on two columns without mean.
struct Regression {
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moments = Eigen::Vector2d::Zero();
  double total = 0;

  void add(const Eigen::MatrixX2d& columns, const Eigen::VectorXd& values) {
    const Eigen::MatrixX2d A = columns.rowwise() - columns.colwise().mean();
    const Eigen::VectorXd b = values.array() - values.mean();
    squares += normal_matrix(A);
    moments += A.transpose() * b;
    total += b.squaredNorm();
  }
  Eigen::Vector2d solution() const { return squares.ldlt().solve(moments); }
  double error() const { return total - moments.dot(solution()); }
};

/// Adds the samples of a motion.
void add_motion(const DriveRecord& record, const CommandHistory& commanded, const Motion& motion,
                Regression& regression) {
  const double limit = 0.9 * Motor().max_torque();
  for (int i = 0; i < kWheels; ++i) {
    std::vector<std::array<double, 3>> rows;
    for (const std::size_t k : record.samples(motion.begin, motion.end)) {
      if (std::abs(record.torque[k][i]) > limit || !commanded.sure[k]) continue;
      rows.push_back(
          {commanded.rate[k][i] - record.dphi[k][i], commanded.angle[k][i] - record.phi[k][i], record.torque[k][i]});
    }
    if (rows.size() < 10) continue;
    const auto n = static_cast<Eigen::Index>(rows.size());
    const auto all = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>>(rows[0].data(), n, 3);
    regression.add(all.leftCols<2>(), all.col(2));
  }
}

/// Without the samples less than `apart` (s) from a change of the command.
Regression regress_loops(const std::vector<DriveRecord>& records, double delay, double apart) {
  Regression regression;
  for (const DriveRecord& record : records) {
    if (!record.has_torque()) continue;
    const CommandHistory commanded = delayed_commands(record, delay, apart);
    for (const Motion& motion : record.motions()) add_motion(record, commanded, motion, regression);
  }
  return regression;
}

/// True if it has found plausible values.
bool guess_loops(const std::vector<DriveRecord>& records, Scene& candidate) {
  constexpr int kDelays = 41;
  constexpr double kStep = 0.005, kUnsure = 0.05;  // s
  double min_error = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kDelays; ++k) {
    const double delay = k * kStep;
    const Regression regression = regress_loops(records, delay, 0);
    if (!(regression.error() < min_error)) continue;
    const Eigen::Vector2d gains = regression.solution();
    if (!(gains[0] > 0 && gains[1] >= 0)) continue;
    min_error = regression.error();
    candidate.motors->gains = {gains[0], gains[1]};
    candidate.motors->command_delay = delay;
  }
  if (!std::isfinite(min_error)) return false;
  // The delay is known to a sample or so. It must not be mended by the gains.
  const Eigen::Vector2d gains = regress_loops(records, candidate.motors->command_delay, kUnsure).solution();
  if (gains[0] > 0 && gains[1] >= 0) candidate.motors->gains = {gains[0], gains[1]};
  return true;
}

// ---- Friction: the torque that a steady motion takes is linear in the four coefficients.

constexpr int kFrictions = 4;
constexpr double kMinRate = 0.1;  // rad/s
using FrictionMatrix = Eigen::Matrix<double, Eigen::Dynamic, kFrictions>;
using Frictions = Eigen::Matrix<double, kFrictions, 1>;

/// Their numbers among `parameters()`.
const std::array<std::size_t, kFrictions>& frictions() {
  static const std::array<std::size_t, kFrictions> numbers = {parameter("dry_friction"),
                                                              parameter("roller_dry_friction"),
                                                              parameter("wheel_damping"), parameter("roller_damping")};
  return numbers;
}

/// A settled stretch of a motion: means of rates and torques.
struct Steady {
  Wheels dphi, torque;
};

std::vector<Steady> steady_stretches(const std::vector<DriveRecord>& records) {
  std::vector<Steady> stretches;
  for (const DriveRecord& record : records) {
    if (!record.has_torque()) continue;
    for (const Motion& motion : record.motions()) {
      if (!motion.held || !motion.moving) continue;
      const std::vector<std::size_t> samples = record.samples(motion.begin + kSettlingTime, motion.end);
      Steady sum{Wheels::Zero(), Wheels::Zero()};
      for (const std::size_t k : samples) {
        sum.dphi += record.dphi[k];
        sum.torque += record.torque[k];
      }
      const auto n = static_cast<double>(samples.size());
      if (n > 20) stretches.push_back({sum.dphi / n, sum.torque / n});
    }
  }
  return stretches;
}

/// Three rows a stretch, one a mode: the torque that a friction of size 1 takes; `measured`: without other torques.
FrictionMatrix friction_rows(Scene scene, const std::vector<Steady>& stretches, Eigen::VectorXd& measured) {
  const auto n = static_cast<Eigen::Index>(stretches.size());
  FrictionMatrix rows(kModes * n, kFrictions);
  measured.resize(kModes * n);
  for (const std::size_t number : frictions()) parameters()[number].set(scene, 0);
  const NoSlipModel smooth(scene.robot);
  for (Eigen::Index s = 0; s < n; ++s) {
    const Steady& steady = stretches[static_cast<std::size_t>(s)];
    // A mode that is not commanded leaves a small rate, whose smoothed friction is no measurement.
    const Eigen::Vector3d rates = modes(steady.dphi).unaryExpr([](double m) { return std::abs(m) < kMinRate ? 0 : m; });
    const Eigen::Vector3d v = Rolling(scene.robot).velocity(wheels_of(rates));
    const Wheels carrying = smooth.torque(v, Eigen::Vector3d::Zero());
    measured.segment<kModes>(kModes * s) = modes(steady.torque - carrying);
    for (int f = 0; f < kFrictions; ++f) {
      Scene one = scene;
      parameters()[frictions()[f]].set(one, 1);
      const Wheels torque = NoSlipModel(one.robot).torque(v, Eigen::Vector3d::Zero());
      rows.col(f).segment<kModes>(kModes * s) = modes(torque - carrying);
    }
  }
  return rows;
}

/// True if anything rotated against a friction: one of size 1 took a torque that is more than rounding.
bool took_torque(const FrictionMatrix& rows, int f) { return rows.col(f).norm() > 1e-9; }

/// The columns that are nearly independent of those before: each must keep this share of its length.
std::array<bool, kFrictions> independent(const FrictionMatrix& rows) {
  constexpr double kShare = 0.15;
  std::array<bool, kFrictions> chosen{};
  std::vector<Eigen::VectorXd> basis;
  for (int f = 0; f < kFrictions; ++f) {
    Eigen::VectorXd rest = rows.col(f);
    for (const Eigen::VectorXd& unit : basis) rest -= unit.dot(rest) * unit;
    chosen[f] = took_torque(rows, f) && rest.norm() > kShare * rows.col(f).norm();
    if (chosen[f]) basis.push_back(rest.normalized());
  }
  return chosen;
}

/// Non-negative least squares on the chosen columns, by trying all sets of columns that may be zero: there are sixteen.
Frictions nonnegative_least_squares(const FrictionMatrix& rows, const Eigen::VectorXd& measured,
                                    const std::array<bool, kFrictions>& chosen) {
  Frictions best = Frictions::Zero();
  double min_error = measured.squaredNorm();
  for (int set = 1; set < 1 << kFrictions; ++set) {
    std::vector<Eigen::Index> columns;
    for (int f = 0; f < kFrictions; ++f) {
      if (set >> f & 1 && chosen[f]) columns.push_back(f);
    }
    if (columns.empty()) continue;
    const Eigen::MatrixXd A = rows(Eigen::all, columns);
    const Eigen::VectorXd solution = solve_least_squares(A, measured);
    const double error = (A * solution - measured).squaredNorm();
    if (solution.minCoeff() < 0 || error >= min_error) continue;
    min_error = error;
    best.setZero();
    best(columns) = solution;
  }
  return best;
}

/// The records as `scene` would have made them.
std::vector<DriveRecord> predicted(const Scene& scene, std::vector<DriveRecord> records) {
  for (DriveRecord& record : records) {
    if (!record.has_torque()) continue;
    const Readings& readings = predict(scene, record);
    static_cast<Readings&>(record) = readings;
  }
  return records;
}

void guess_friction(const std::vector<DriveRecord>& records, bool simulated_too, FirstGuess& guess) {
  const std::vector<Steady> stretches = steady_stretches(records);
  Eigen::VectorXd measured;
  const FrictionMatrix rows = friction_rows(guess.scene, stretches, measured);
  // Contacts wander along the rollers: what the simulation takes beyond the linear estimate, the base does too.
  if (simulated_too) {
    Eigen::VectorXd simulated;
    friction_rows(guess.scene, steady_stretches(predicted(guess.scene, records)), simulated);
    Frictions now;
    for (int f = 0; f < kFrictions; ++f) now[f] = parameters()[frictions()[f]].get(guess.scene);
    measured -= simulated - rows * now;
  }
  const std::array<bool, kFrictions> chosen = independent(rows);
  // An unidentifiable friction keeps its start value; subtract its torque.
  for (int f = 0; f < kFrictions; ++f) {
    const Parameter& p = parameters()[frictions()[f]];
    guess.identifiable[frictions()[f]] = chosen[f];
    if (!chosen[f]) measured -= p.get(guess.scene) * rows.col(f);
  }
  const Frictions friction = nonnegative_least_squares(rows, measured, chosen);
  for (int f = 0; f < kFrictions; ++f) {
    const Parameter& p = parameters()[frictions()[f]];
    if (chosen[f]) {
      p.set(guess.scene, std::clamp(friction[f], p.min, p.max));
    } else {
      guess.unidentifiable.push_back(
          fmt::format("{}: {}; drive {}", p.name(),
                      took_torque(rows, f) ? "one speed or one direction alone cannot separate it from the others"
                                           : "nothing turned against it steadily for more than a second",
                      p.drive));
    }
  }
}

}  // namespace

FirstGuess guess(const Scene& start, const std::vector<DriveRecord>& records) {
  FirstGuess guess{start, std::vector<bool>(parameters().size()), false, {}};
  bool torque = false, truth = false;
  for (const DriveRecord& record : records) {
    torque = torque || record.has_torque();
    truth = truth || record.has_truth();
  }
  for (std::size_t k = 0; k < parameters().size(); ++k) {
    const Needs needs = parameters()[k].needs;
    guess.identifiable[k] =
        needs == Needs::kRates || (needs == Needs::kTorques && torque) || (needs == Needs::kTruth && truth);
  }
  if (!torque) return guess;
  guess.gains_identified = guess_loops(records, guess.scene);
  guess_friction(records, false, guess);
  guess.unidentifiable.clear();
  guess_friction(records, true, guess);
  return guess;
}

}  // namespace youbot_base_sim
