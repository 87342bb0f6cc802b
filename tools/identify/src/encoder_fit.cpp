#include "youbot_base_sim/identify/encoder_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <utility>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/identify/least_squares.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/sensors/wheel_odometry.h"
#include "youbot_base_sim/slip_odometry/replay.h"
#include "youbot_base_sim/slip_odometry/wheel_cubic.h"

namespace youbot_base_sim {

namespace {

// s, between compared poses: no multiple of their intervals. Interpolated truth is less noisy and would draw the clock.
constexpr double kWindow = 0.2427;
constexpr double kBlock = 4;         // s: stretches that are held out, and whose errors count as independent
constexpr int kHeldOut = 3;          // every such one is held out
constexpr double kMargin = 0.3;      // s, by which the clock may still change
constexpr int kUnknownOfRecord = 2;  // offset and stretch of its clock; beside them four angles
constexpr double kOffsetStep = 2e-3, kStretchStep = 2e-4, kAngleStep = 0.04;  // s, 1 and rad
constexpr int kReplicas = 4;                                                  // where angles are unknown
constexpr double kPrior = 20;            // steps: sigma of the start's parameters, which records hardly leave as it is
constexpr double kMaxUnexplained = 0.3;  // share of a record's squared motion
constexpr double kMinScatter = 2e-5;     // m and rad: with less, twins would count rounding

using Poses = std::vector<Eigen::Vector3d>;
using Window = std::pair<std::size_t, std::size_t>;  // instants of its ends

/// Wheels between readings of angles (rad) and rates (rad/s): cubics.
class WheelCubics : public WheelMotion {
 public:
  WheelCubics(const std::vector<double>& t, const std::vector<Wheels>& phi, const std::vector<Wheels>& dphi)
      : t_(t), phi_(phi), dphi_(dphi) {}

  Wheels angle(double t) const override { return piece(t).angle(t); }
  Wheels rate(double t) const override { return piece(t).rate(t); }
  Wheels acceleration(double t) const override { return piece(t).acceleration(t); }

 private:
  WheelCubic piece(double t) const {
    const auto next = std::min(std::upper_bound(t_.begin() + 1, t_.end(), t), t_.end() - 1);
    const auto k = static_cast<std::size_t>(next - t_.begin()) - 1;
    WheelCubic piece;
    piece.start = t_[k];
    piece.length = t_[k + 1] - t_[k];
    piece.phi = phi_[k];
    piece.dphi = dphi_[k];
    piece.moved = phi_[k + 1] - phi_[k];
    piece.end_dphi = dphi_[k + 1];
    return piece;
  }

  const std::vector<double>& t_;
  const std::vector<Wheels>&phi_, &dphi_;
};

/// A record's wheels, and the instants at which poses are compared.
struct Track {
  const DriveRecord* record;
  std::vector<double> t;  // the instants, s
  std::vector<Window> windows;
};

Poses rolled_poses(const DriveRecord& record, const RobotParameters& robot) {
  WheelOdometry odometry(DriverKinematics::of(robot), record.phi.front());
  Poses poses;
  for (const Wheels& phi : record.phi) {
    odometry.update(phi);
    poses.push_back(odometry.pose());
  }
  return poses;
}

Track track_of(const DriveRecord& record) {
  Track track{&record, {}, {}};
  const auto is_measured = [&](double t) {
    return record.is_tracked(t) && record.is_tracked(t - kMargin) && record.is_tracked(t + kMargin) &&
           !record.is_excluded(t);
  };
  for (int i = 0; i * kWindow < record.duration(); ++i) {
    const double t = i * kWindow;
    if (is_measured(t) && is_measured(t - kWindow)) track.windows.emplace_back(track.t.size() - 1, track.t.size());
    track.t.push_back(t);
  }
  return track;
}

// ---- Candidates.

/// Poses at the track's instants of a base with wheels at the readings plus `ahead` (rad).
Poses follow(Scene scene, const Track& track, const Wheels& ahead, bool softly, double resolution,
             const std::atomic<bool>* stop) {
  const DriveRecord& record = *track.record;
  std::shared_ptr<const WheelMotion> motion;
  if (record.rates_from_angles) {
    motion = std::make_shared<WheelSpline>(WheelTable{record.t, record.phi}, resolution);
  } else {
    motion = std::make_shared<WheelCubics>(record.t, record.phi, record.dphi);
  }
  scene.solver.relative_tolerance = 1e-5;
  scene.solver.absolute_tolerance = 1e-8;
  Replay replay(std::move(scene), motion, ahead, softly);
  if (stop) replay.stop_on(*stop);
  Poses poses;
  for (const double t : track.t) {
    replay.advance_to(t);
    const State& x = replay.simulation().state();
    poses.emplace_back(x.x(), x.y(), x.psi());
    replay.drop_switches();
  }
  return poses;
}

/// A fit in progress. Unknowns, in steps: free parameters; a clock's offset and stretch and four angles a record.
struct Trial {
  Scene scene;
  std::vector<std::size_t> free;
  std::vector<ClockMap> clocks;
  std::vector<Wheels> ahead;  // empty: unknown

  const Parameter& parameter(std::size_t k) const { return encoder_parameters()[free[k]]; }
  std::size_t of_record() const { return kUnknownOfRecord + (ahead.empty() ? 0 : kWheels); }
  std::size_t size() const { return free.size() + of_record() * clocks.size(); }

  Eigen::VectorXd unknowns() const {
    Eigen::VectorXd x(size());
    for (std::size_t k = 0; k < free.size(); ++k) {
      const Parameter& p = parameter(k);
      x[k] = std::clamp(p.get(scene), p.min, p.max) / p.step;
    }
    for (std::size_t r = 0; r < clocks.size(); ++r) {
      const std::size_t at = free.size() + r * of_record();
      x[at] = clocks[r].offset / kOffsetStep;
      x[at + 1] = clocks[r].stretch / kStretchStep;
      if (!ahead.empty()) x.segment<kWheels>(at + 2) = ahead[r] / kAngleStep;
    }
    return x;
  }

  Trial with(const Eigen::VectorXd& x) const {
    Trial other = *this;
    for (std::size_t k = 0; k < free.size(); ++k) parameter(k).set(other.scene, x[k] * parameter(k).step);
    for (std::size_t r = 0; r < clocks.size(); ++r) {
      const std::size_t at = free.size() + r * of_record();
      other.clocks[r] = {x[at] * kOffsetStep, x[at + 1] * kStretchStep};
      if (!ahead.empty()) other.ahead[r] = x.segment<kWheels>(at + 2).array() * kAngleStep;
    }
    return other;
  }

  /// The record that unknown k is of; -1: it is a parameter's, and of all.
  int record_of(std::size_t k) const {
    return k < free.size() ? -1 : static_cast<int>((k - free.size()) / of_record());
  }
  /// True if unknown k changes what a simulation does.
  bool moves(std::size_t k) const { return k < free.size() || (k - free.size()) % of_record() >= kUnknownOfRecord; }

  Eigen::VectorXd bounds(double Parameter::*bound, double of_others) const {
    Eigen::VectorXd bounds = Eigen::VectorXd::Constant(size(), of_others);
    for (std::size_t k = 0; k < free.size(); ++k) bounds[k] = parameter(k).*bound / parameter(k).step;
    return bounds;
  }
};

/// The motion of a trial's base in all windows of all records, as rows: X, Y, yaw of each.
class EncoderComparison {
 public:
  EncoderComparison(const std::vector<DriveRecord>& records, const EncoderFitSettings& settings)
      : records_(records), settings_(settings) {
    int blocks = 0;
    for (const DriveRecord& record : records) {
      tracks_.push_back(track_of(record));
      begin_.push_back(static_cast<Eigen::Index>(block_.size()));
      const Track& track = tracks_.back();
      for (const Window& window : track.windows) {
        const int block = static_cast<int>(track.t[window.first] / kBlock);
        for (int c = 0; c < 3; ++c) {
          (block % kHeldOut == kHeldOut - 1 ? held_out_ : training_).push_back(static_cast<int>(block_.size()));
          block_.push_back(blocks + block);
        }
      }
      blocks = block_.empty() ? 0 : block_.back() + 1;
    }
    constexpr std::size_t kMinRows = 3 * 40;
    if (training_.size() < kMinRows || held_out_.empty()) {
      throw UnusableRecord(fmt::format("{}: {:.1f} s of readings with ground truth; must be at least 15 s",
                                       records.front().name, kWindow * static_cast<double>(block_.size()) / 3));
    }
  }

  const std::vector<int>& training() const { return training_; }
  const std::vector<int>& held_out() const { return held_out_; }

  /// Sets what rows are expected to be off, m, m and rad.
  void expect(const Eigen::Array3d& scatter) { scatter_ = scatter; }

  /// The usual error of the rows of some record: by their medians, robustly.
  Eigen::Array3d scatter_of(const Eigen::VectorXd& off) const {
    Eigen::Array3d scatter;
    for (int c = 0; c < 3; ++c) {
      std::vector<double> sizes;
      for (Eigen::Index k = c; k < off.size(); k += 3) sizes.push_back(std::abs(off[k]));
      scatter[c] = std::max(kMinScatter, 1.4826 * median(sizes));
    }
    return scatter;
  }

  /// Ground truth less prediction, m, m and rad.
  Eigen::VectorXd off(const Trial& trial) const {
    std::vector<Moved> moved(records_.size());
    for (std::size_t r = 0; r < records_.size(); ++r) moved[r].resize(runs_of(trial));
    simulate({trial},
             [&](std::size_t, std::size_t r, std::size_t run, Poses poses) { moved[r][run] = std::move(poses); });
    Eigen::VectorXd all(block_.size());
    for (std::size_t r = 0; r < records_.size(); ++r) set_off(r, moved[r], trial.clocks[r], all);
    return all;
  }

  /// The errors over what is expected, robustly.
  Eigen::VectorXd residuals(const Trial& trial) const { return scaled(off(trial)); }

  /// Residuals with derivatives by differences.
  Eigen::VectorXd residuals(const Trial& trial, const Eigen::VectorXd& x, Eigen::MatrixXd& jacobian) const;

  /// Errors of factors forward, lateral and in yaw, m, m and rad. Throws UnusableRecord where these explain too little.
  Eigen::VectorXd off_by_kinematics(const Trial& trial) const;

  double held_out_error(const Eigen::VectorXd& residuals) const {
    return residuals(held_out_).norm() / std::sqrt(static_cast<double>(held_out_.size()));
  }

  Eigen::VectorXd scaled(Eigen::VectorXd off) const {
    for (Eigen::Index k = 0; k < off.size(); ++k) off[k] = robust(off[k] / scatter_[k % 3]);
    return off;
  }

  /// Finds the angles, one wheel after the other.
  void search_angles(Trial& trial) const;

  /// Of the unknowns, the first `free` of them parameters, in steps: errors within a block may be dependent.
  Eigen::VectorXd sigma(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& jacobian, Eigen::Index free) const;

 private:
  using Moved = std::vector<Poses>;  // of each run: one, or replicas

  static std::size_t runs_of(const Trial& trial) { return trial.ahead.empty() ? kReplicas : 1; }

  /// Simulates all runs of these trials, of one record each unless `of_record` is negative.
  template <class Take>
  void simulate(const std::vector<Trial>& trials, const Take& take, const std::vector<int>& of_record = {}) const {
    struct Job {
      std::size_t trial, record, run;
    };
    std::vector<Job> jobs;
    for (std::size_t k = 0; k < trials.size(); ++k) {
      for (std::size_t r = 0; r < records_.size(); ++r) {
        if (!of_record.empty() && of_record[k] >= 0 && of_record[k] != static_cast<int>(r)) continue;
        for (std::size_t run = 0; run < runs_of(trials[k]); ++run) jobs.push_back({k, r, run});
      }
    }
    settings_.workers.share(jobs.size(), [&](std::size_t j) {
      const auto [k, r, run] = jobs[j];
      const Trial& trial = trials[k];
      const Wheels ahead =
          trial.ahead.empty() ? spread_angles(static_cast<int>(run), trial.scene.robot.rollers) : trial.ahead[r];
      take(k, r, run,
           follow(trial.scene, tracks_[r], ahead, trial.ahead.empty(), settings_.resolution, settings_.workers.stop));
    });
  }

  /// Sets the rows of record r in `all`.
  void set_off(std::size_t r, const Moved& moved, const ClockMap& clock, Eigen::VectorXd& all) const {
    const DriveRecord& record = records_[r];
    const Track& track = tracks_[r];
    Eigen::Index row = begin_[r];
    for (const auto& [a, b] : track.windows) {
      const double from = clock(track.t[a]), to = clock(track.t[b]);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      for (const Poses& poses : moved) mean += displacement(poses[a], poses[b]) / static_cast<double>(moved.size());
      all.segment<3>(row) = displacement(record.truth_at(from), record.truth_at(to)) - mean;
      row += 3;
    }
  }

  const std::vector<DriveRecord>& records_;
  const EncoderFitSettings& settings_;
  std::vector<Track> tracks_;
  std::vector<Eigen::Index> begin_;  // row of each record
  std::vector<int> training_, held_out_, block_;
  Eigen::Array3d scatter_ = Eigen::Array3d::Constant(1e-3);
};

Eigen::VectorXd EncoderComparison::residuals(const Trial& trial, const Eigen::VectorXd& x,
                                             Eigen::MatrixXd& jacobian) const {
  const Eigen::VectorXd max = trial.bounds(&Parameter::max, HUGE_VAL);
  std::vector<Trial> trials = {trial.with(x)};
  std::vector<int> of_record = {-1};
  std::vector<std::size_t> simulated(trial.size(), 0);  // the trial whose motion it has
  Eigen::VectorXd steps(x.size());
  std::vector<Trial> stepped;
  for (std::size_t k = 0; k < trial.size(); ++k) {
    Eigen::VectorXd there = x;
    there[k] += steps[k] = x[k] + 1 <= max[k] ? 1 : -1;
    stepped.push_back(trial.with(there));
    if (!trial.moves(k)) continue;
    simulated[k] = trials.size();
    trials.push_back(stepped.back());
    of_record.push_back(trial.record_of(k));
  }
  std::vector<std::vector<Moved>> moved(trials.size(), std::vector<Moved>(records_.size(), Moved(runs_of(trial))));
  simulate(
      trials, [&](std::size_t k, std::size_t r, std::size_t run, Poses poses) { moved[k][r][run] = std::move(poses); },
      of_record);
  Eigen::VectorXd base(block_.size());
  for (std::size_t r = 0; r < records_.size(); ++r) set_off(r, moved[0][r], trials[0].clocks[r], base);
  jacobian.resize(base.size(), x.size());
  for (std::size_t k = 0; k < trial.size(); ++k) {
    Eigen::VectorXd there = base;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const int of = trial.record_of(k);
      if (of < 0 || of == static_cast<int>(r)) set_off(r, moved[simulated[k]][r], stepped[k].clocks[r], there);
    }
    jacobian.col(k) = (scaled(there) - scaled(base)) / steps[k];
  }
  return scaled(base);
}

Eigen::VectorXd EncoderComparison::off_by_kinematics(const Trial& trial) const {
  Eigen::VectorXd all(block_.size()), rolled(block_.size());
  for (std::size_t r = 0; r < records_.size(); ++r) {
    const Poses poses = rolled_poses(records_[r], trial.scene.robot);
    Poses at, still(tracks_[r].t.size(), Eigen::Vector3d::Zero());
    for (const double t : tracks_[r].t) at.push_back(interpolated(records_[r].t, poses, t));
    set_off(r, {still}, trial.clocks[r], all);
    set_off(r, {at}, trial.clocks[r], rolled);
  }
  rolled = all - rolled;
  const Eigen::VectorXd moved = all;
  for (int c = 0; c < 3; ++c) {
    double product = 0, square = 0;
    for (const int row : training_) {
      if (row % 3 != c) continue;
      product += all[row] * rolled[row];
      square += rolled[row] * rolled[row];
    }
    for (Eigen::Index row = c; row < all.size() && square > 0; row += 3) all[row] -= product / square * rolled[row];
  }
  for (std::size_t r = 0; r < records_.size(); ++r) {
    const auto rows = Eigen::seqN(begin_[r], 3 * static_cast<Eigen::Index>(tracks_[r].windows.size()));
    const double unexplained = all(rows).squaredNorm() / moved(rows).squaredNorm();
    if (unexplained <= kMaxUnexplained) continue;
    throw UnusableRecord(fmt::format(
        "{}: its ground truth does not fit the wheels' motion: {:.0f} % of it stays unexplained; must be at most "
        "{:.0f} %: are --joints, their signs and --scene those of this base?",
        records_[r].name, 100 * unexplained, 100 * kMaxUnexplained));
  }
  return all;
}

void EncoderComparison::search_angles(Trial& trial) const {
  constexpr int kRounds = 2, kTried = 8;
  const double step = 2 * M_PI / trial.scene.robot.rollers / kTried;
  for (int k = 0; k < kRounds * kWheels; ++k) {
    const int i = k % kWheels;
    std::vector<Trial> tried(kTried, trial);
    std::vector<std::vector<double>> errors(records_.size(), std::vector<double>(kTried));
    for (int j = 0; j < kTried; ++j) {
      for (Wheels& ahead : tried[j].ahead) ahead[i] += j * step;
    }
    simulate(tried, [&](std::size_t j, std::size_t r, std::size_t, Poses poses) {
      Eigen::VectorXd all = Eigen::VectorXd::Zero(block_.size());
      set_off(r, {std::move(poses)}, trial.clocks[r], all);
      errors[r][j] = scaled(all)(training_).squaredNorm();
    });
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const auto best = std::min_element(errors[r].begin(), errors[r].end()) - errors[r].begin();
      trial.ahead[r][i] += static_cast<double>(best) * step;
    }
  }
}

Eigen::VectorXd EncoderComparison::sigma(const Eigen::VectorXd& residuals, const Eigen::MatrixXd& jacobian,
                                         Eigen::Index free) const {
  const Eigen::MatrixXd J = jacobian(training_, Eigen::all);
  std::map<int, Eigen::VectorXd> pull;  // of each block
  for (const int row : training_) {
    Eigen::VectorXd& sum = pull.try_emplace(block_[row], Eigen::VectorXd::Zero(J.cols())).first->second;
    sum += residuals[row] * jacobian.row(row).transpose();
  }
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  for (const auto& [block, sum] : pull) scatter += sum * sum.transpose();
  const double n = static_cast<double>(pull.size()), spare = std::max(1.0, n - static_cast<double>(J.cols()));
  Eigen::MatrixXd with_prior = Eigen::MatrixXd::Zero(J.rows() + free, J.cols());
  with_prior.topRows(J.rows()) = J;
  with_prior.bottomRows(free).leftCols(free).diagonal().setConstant(1 / kPrior);
  const Eigen::MatrixXd unit = unit_covariance(with_prior);
  const Eigen::MatrixXd of_blocks = n / spare * unit * scatter * unit;
  const Eigen::MatrixXd independent = residuals(training_).squaredNorm() / static_cast<double>(J.rows()) * unit;
  // One of few blocks may happen to be small.
  return of_blocks.diagonal().cwiseMax(independent.diagonal()).cwiseSqrt();
}

/// Fits the trial's unknowns to the rows that are not held out, and to a weak prior of the start.
void minimize(const EncoderComparison& comparison, const Scene& start, Trial& trial) {
  const auto rows = static_cast<Eigen::Index>(comparison.training().size());
  const auto free = static_cast<Eigen::Index>(trial.free.size());
  Trial started = trial;
  started.scene = start;
  const Eigen::VectorXd expected = started.unknowns();
  const auto evaluate = [&](const Eigen::VectorXd& x, Eigen::VectorXd& values, Eigen::MatrixXd* jacobian) {
    values.tail(free) = (x - expected).head(free) / kPrior;
    if (!jacobian) {
      values.head(rows) = comparison.residuals(trial.with(x))(comparison.training());
      return;
    }
    Eigen::MatrixXd all;
    values.head(rows) = comparison.residuals(trial, x, all)(comparison.training());
    jacobian->setZero().topRows(rows) = all(comparison.training(), Eigen::all);
    jacobian->bottomRows(free).leftCols(free).diagonal().setConstant(1 / kPrior);
  };
  trial = trial.with(minimize_squares(evaluate, rows + free, trial.unknowns(), trial.bounds(&Parameter::min, -HUGE_VAL),
                                      trial.bounds(&Parameter::max, HUGE_VAL)));
}

/// All that is known of a trial where it is best.
struct Linearized {
  Eigen::VectorXd x, residuals;
  Eigen::MatrixXd jacobian;
};

Linearized linearized(const EncoderComparison& comparison, const Trial& trial) {
  Linearized at{trial.unknowns(), {}, {}};
  at.residuals = comparison.residuals(trial, at.x, at.jacobian);
  return at;
}

/// The trial with parameter k of the free ones at its start, to which the others adapt to first order.
Trial without(const EncoderComparison& comparison, const Trial& trial, const Linearized& at, std::size_t k,
              const Scene& start) {
  const Parameter& p = trial.parameter(k);
  const Eigen::MatrixXd normal = normal_matrix(at.jacobian(comparison.training(), Eigen::all));
  const auto fixed = static_cast<Eigen::Index>(k);
  const Eigen::VectorXd x = at.x + step_back(normal, fixed, p.get(start) / p.step - at.x[fixed]);
  Trial other = trial.with(
      x.cwiseMax(trial.bounds(&Parameter::min, -HUGE_VAL)).cwiseMin(trial.bounds(&Parameter::max, HUGE_VAL)));
  p.set(other.scene, p.get(start));
  return other;
}

/// Held-out errors without each free parameter; the number of the one that is missed least, and the trial without it.
struct LeastMissed {
  std::size_t number = 0;
  Trial trial;
};

LeastMissed find_least_missed(const EncoderComparison& comparison, const Scene& start, const Trial& trial,
                              const Linearized& at, EncoderFit& fit) {
  LeastMissed best{0, trial};
  fit.numbers.clear();
  for (std::size_t k = 0; k < trial.free.size(); ++k) {
    const Trial other = without(comparison, trial, at, k, start);
    const double error = comparison.held_out_error(comparison.residuals(other));
    fit.numbers.push_back({trial.free[k], trial.parameter(k).get(trial.scene), 0, error});
    if (error <= fit.numbers[best.number].error_without) best = {k, other};
  }
  return best;
}

/// Puts parameters back to their start: those that the rows do not show by these sigmas (steps), then, the least
/// missed first, those that held-out rows do not miss. Returns where the others are best.
Linearized eliminate(const EncoderComparison& comparison, const Scene& start, const Eigen::VectorXd& sigma,
                     Trial& trial, EncoderFit& fit) {
  constexpr double kWorth = 2e-3;  // share of the error that a parameter must take away
  const std::size_t all = trial.free.size();
  for (std::size_t k = all; k-- > 0;) {
    const Parameter& p = trial.parameter(k);
    if (sigma[k] < kPrior / 2) continue;
    fit.unidentifiable.push_back(fmt::format("{}: these drives do not show it (sigma {:.2g} {}); {}", p.name(),
                                             sigma[k] * p.step, p.unit, p.drive));
    p.set(trial.scene, p.get(start));
    trial.free.erase(trial.free.begin() + static_cast<std::ptrdiff_t>(k));
  }
  while (!trial.free.empty()) {
    const Linearized at = linearized(comparison, trial);
    const LeastMissed least = find_least_missed(comparison, start, trial, at, fit);
    const double error = comparison.held_out_error(at.residuals);
    const EncoderFit::Number& number = fit.numbers[least.number];
    if (number.error_without > (1 + kWorth) * error) break;
    const Parameter& p = encoder_parameters()[number.parameter];
    fit.unidentifiable.push_back(
        fmt::format("{}: fitted, {:.4g} {} does not lower the error on held-out stretches ({:.4g}; without {:.4g}); {}",
                    p.name(), number.value, p.unit, error, number.error_without, p.drive));
    trial = least.trial;
    trial.free.erase(trial.free.begin() + static_cast<std::ptrdiff_t>(least.number));
  }
  if (trial.free.size() < all) minimize(comparison, start, trial);
  const Linearized at = linearized(comparison, trial);
  find_least_missed(comparison, start, trial, at, fit);
  return at;
}

/// Values of clocks and angles; all sigmas.
void report_numbers(const std::vector<DriveRecord>& records, const Trial& trial, const Eigen::VectorXd& sigma,
                    EncoderFit& fit) {
  for (EncoderFit::Number& number : fit.numbers)
    number.sigma = sigma[number.parameter] * encoder_parameters()[number.parameter].step;
  const double pitch = 2 * M_PI / trial.scene.robot.rollers;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const std::size_t from = encoder_parameters().size() + r * trial.of_record();
    EncoderFit::Drive drive{trial.clocks[r], {sigma[from] * kOffsetStep, sigma[from + 1] * kStretchStep}, {}, {}};
    if (!trial.ahead.empty()) {
      const Wheels off = sigma.segment<kWheels>(from + 2).array() * kAngleStep;
      if ((off < pitch / std::sqrt(12)).all()) {  // of any angle within a roller
        drive.angles_at_zero = trial.ahead[r] - pitch * (trial.ahead[r] / pitch).round();
        drive.angles_sigma = off;
      } else {
        fit.unidentifiable.push_back(
            fmt::format("{}: which rollers touch the floor where the encoders read zero (sigma {:.2g} rad); drive "
                        "laterally and in yaw",
                        records[r].name, off.maxCoeff()));
      }
    }
    fit.drives.push_back(drive);
  }
}

}  // namespace

EncoderFit fit_encoders(const Scene& start, const std::vector<DriveRecord>& records,
                        const EncoderFitSettings& settings) {
  Trial trial{start, {}, std::vector<ClockMap>(records.size()), {}};
  EncoderComparison comparison(records, settings);
  EncoderFit fit;
  const Trial unfitted = trial;
  comparison.expect(comparison.scatter_of(comparison.off_by_kinematics(trial)));
  if (settings.find_angles) {
    trial.free = {0, 1};  // sizes
    minimize(comparison, start, trial);
    settings.progress(0.2);
    trial.ahead.assign(records.size(), spread_angles(0, start.robot.rollers));
    comparison.search_angles(trial);
    settings.progress(0.4);
  }
  trial.free.resize(encoder_parameters().size());
  std::iota(trial.free.begin(), trial.free.end(), 0);
  minimize(comparison, start, trial);
  comparison.expect(comparison.scatter_of(comparison.off(trial)));
  minimize(comparison, start, trial);
  settings.progress(0.7);
  const Linearized all = linearized(comparison, trial);  // one put back to its start later may be wrong
  const Eigen::VectorXd sigma = comparison.sigma(all.residuals, all.jacobian, encoder_parameters().size());
  const Linearized at = eliminate(comparison, start, sigma, trial, fit);
  report_numbers(records, trial, sigma, fit);
  const auto error = [&](const Eigen::VectorXd& off) { return comparison.held_out_error(comparison.scaled(off)); };
  fit.scene = trial.scene;
  fit.error_after = comparison.held_out_error(at.residuals);
  fit.error_before = error(comparison.off(unfitted));
  fit.error_kinematics = error(comparison.off_by_kinematics(trial));
  Trial unknown = trial;
  unknown.ahead.clear();
  fit.error_unknown = error(comparison.off(unknown));
  settings.progress(1);
  return fit;
}

}  // namespace youbot_base_sim
