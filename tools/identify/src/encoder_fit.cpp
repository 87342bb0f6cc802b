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

constexpr double kWindow = 0.2427;       // s, between compared poses
constexpr double kBlock = 4;             // s: stretches that are held out
constexpr int kHeldOut = 3;              // every such one is held out
constexpr int kLong = 16;                // windows, over which the tracker's noise is separated from errors that grow
constexpr double kMinGrowth = 0.02;      // of the variance of a window: less is luck
constexpr double kJump = 4;              // usual errors: ground truth that is farther off jumps, unless wheels slip,
constexpr double kSlip = 0.2;            // by this share of how far they roll
constexpr double kGrid = 5e-3;           // s, of simulated poses
constexpr int kReplicas = 4;             // where angles are unknown
constexpr double kPrior = 20;            // steps: sigma of the start's parameters, which records hardly leave as it is
constexpr double kMaxUnexplained = 0.5;  // share of a record's motion
constexpr double kDriven = 0.05;         // share of the wheels' motion: a direction with less is not judged
constexpr double kMinScatter = 2e-5;     // m and rad: with less, twins would count rounding

using Displacements = std::vector<Eigen::Vector3d>;  // in the frame of the base, m, m and rad

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

/// A base's poses over time, s by the encoders' clock.
struct Path {
  std::vector<double> t;
  std::vector<Eigen::Vector3d> poses;
};

/// A record's wheels, and the windows at whose ends poses are compared, by the clock of ground truth: its noise must
/// not change with what is tried as the clock.
struct Track {
  std::vector<int> windows;  // their numbers; window i ends at end_of(i)
  int jumps = 0;             // windows that are left out, for ground truth jumps there
  bool all_driven = false;   // all directions: after forward motion alone, other angles of the rollers fit as well
};

double end_of(int window) { return window * kWindow; }

Track track_of(const DriveRecord& record) {
  Track track;
  for (int i = 1; end_of(i) < record.duration(); ++i) {
    if (record.is_tracked(end_of(i)) && record.is_tracked(end_of(i - 1))) track.windows.push_back(i);
  }
  return track;
}

/// How far a base comes in the track's windows.
template <class Pose>
Displacements displacements(const Track& track, const Pose& pose) {
  Displacements moved;
  for (const int window : track.windows) moved.push_back(displacement(pose(end_of(window - 1)), pose(end_of(window))));
  return moved;
}

Displacements displacements(const Track& track, const Path& path, const ClockMap& clock) {
  return displacements(track, [&](double t) { return interpolated(path.t, path.poses, clock.encoders(t)); });
}

/// Where wheels roll that turn as they are read.
Path rolled(const DriveRecord& record, const RobotParameters& robot) {
  WheelOdometry odometry(DriverKinematics::of(robot), record.phi.front());
  Path path{record.t, {}};
  for (const Wheels& phi : record.phi) {
    odometry.update(phi);
    path.poses.push_back(odometry.pose());
  }
  return path;
}

/// Where a base goes with wheels at the readings plus `ahead` (rad).
Path simulated(Scene scene, const DriveRecord& record, const Wheels& ahead, bool softly, double resolution,
               const std::atomic<bool>* stop) {
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
  Path path;
  for (int k = 0; (k - 1) * kGrid < record.duration(); ++k) {
    path.t.push_back(k * kGrid);
    replay.advance_to(path.t.back());
    replay.drop_switches();
    const State& x = replay.simulation().state();
    path.poses.emplace_back(x.x(), x.y(), x.psi());
  }
  return path;
}

/// The motion of a candidate's base in all windows of all records, as rows: X, Y, yaw of each. What a tracker adds to
/// one displacement it takes from the next, while what the model lacks gathers: rows are uncorrelated combinations.
class EncoderComparison : public Comparison {
 public:
  EncoderComparison(const std::vector<DriveRecord>& records, const EncoderFitSettings& settings,
                    const Candidate& start);

  Eigen::MatrixXd residuals(const std::vector<Candidate>& candidates) const override;

  /// Sets what is expected of rows, which are off by so much now, m, m and rad.
  void expect(const Eigen::VectorXd& off);

  /// Ground truth less prediction, m, m and rad; a column a candidate.
  Eigen::MatrixXd off(const std::vector<Candidate>& candidates) const;

  /// Errors of factors forward, lateral and in yaw, m, m and rad.
  Eigen::VectorXd off_by_kinematics(const Candidate& candidate) const;

  /// The held-out error of rows that are off by so much.
  double error_of(const Eigen::VectorXd& off) const { return held_out_error(errors(off)); }

  /// The relative error of wheels' paths, WheelOdometry's, that leads as far off in kLong windows.
  double wheel_error(const Candidate& candidate) const;

  /// Finds the angles, one wheel after the other.
  void search_angles(Candidate& candidate) const;

  const Track& track(std::size_t record) const { return tracks_[record]; }

 private:
  void leave_out_jumps(const Candidate& candidate);
  void check(const Candidate& candidate);
  double spread(const Eigen::VectorXd& off, int mode, int count) const;
  Eigen::VectorXd truth() const;
  Eigen::VectorXd by_wheels(const Candidate& candidate) const;
  Eigen::VectorXd uncorrelated(Eigen::VectorXd off, double limit = HUGE_VAL) const;
  Eigen::VectorXd errors(const Eigen::VectorXd& off) const { return uncorrelated(off, kJump).unaryExpr(&robust); }
  /// Rows of displacements_of(record) for all records.
  template <class Of>
  Eigen::VectorXd all_rows(const Of& displacements_of) const {
    std::vector<double> rows;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      for (const Eigen::Vector3d& moved : displacements_of(r)) rows.insert(rows.end(), moved.begin(), moved.end());
    }
    return Eigen::Map<Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
  }

  const std::vector<DriveRecord>& records_;
  const EncoderFitSettings& settings_;
  std::vector<Track> tracks_;
  Eigen::VectorXd expected_, taken_;  // of each row: its error, and its share of the uncorrelated one before
};

EncoderComparison::EncoderComparison(const std::vector<DriveRecord>& records, const EncoderFitSettings& settings,
                                     const Candidate& start)
    : records_(records), settings_(settings) {
  for (const DriveRecord& record : records) tracks_.push_back(track_of(record));
  leave_out_jumps(start);
  constexpr Eigen::Index kMinRows = 180;
  for (const Track& track : tracks_) {
    int last = -1;
    for (const int window : track.windows) {
      const bool held_out = static_cast<int>(end_of(window - 1) / kBlock) % kHeldOut == kHeldOut - 1;
      for (int c = 0; c < 3; ++c) add_row(held_out, last == window - 1 ? rows() - 3 : -1);
      last = window;
    }
  }
  if (rows() < kMinRows || held_out().empty()) {
    const auto windows = rows() / 3;
    throw UnusableRecord(fmt::format("{}: {:.1f} s of readings with ground truth; must be at least 15 s",
                                     records.front().name, kWindow * static_cast<double>(windows)));
  }
  for (int k = 0; k < 2; ++k) expect(off_by_kinematics(start));
  check(start);
}

Eigen::VectorXd EncoderComparison::truth() const {
  return all_rows(
      [&](std::size_t r) { return displacements(tracks_[r], [&](double t) { return records_[r].truth_at(t); }); });
}

Eigen::VectorXd EncoderComparison::by_wheels(const Candidate& candidate) const {
  return all_rows([&](std::size_t r) {
    return displacements(tracks_[r], rolled(records_[r], candidate.scene.robot), candidate.clocks[r]);
  });
}

Eigen::MatrixXd EncoderComparison::off(const std::vector<Candidate>& candidates) const {
  using Key = std::vector<double>;  // what a run depends on: clocks change none
  struct Run {
    const Candidate* candidate;
    std::size_t record;
    std::vector<Path> paths;  // one, or replicas
  };
  const auto key_of = [](const Candidate& candidate, std::size_t record) {
    Key key = {static_cast<double>(record)};
    for (const Parameter& p : encoder_parameters()) key.push_back(p.get(candidate.scene));
    if (!candidate.phi.empty()) key.insert(key.end(), candidate.phi[record].begin(), candidate.phi[record].end());
    return key;
  };
  std::map<Key, Run> runs;
  for (const Candidate& candidate : candidates) {
    for (std::size_t r = 0; r < records_.size(); ++r) runs.try_emplace(key_of(candidate, r), Run{&candidate, r, {}});
  }
  settings_.workers.share(runs.size(), [&](std::size_t k) {
    Run& run = std::next(runs.begin(), static_cast<std::ptrdiff_t>(k))->second;
    const Candidate& candidate = *run.candidate;
    const bool softly = candidate.phi.empty();
    for (int i = 0; i < (softly ? kReplicas : 1); ++i) {
      const Wheels ahead = softly ? spread_angles(i, candidate.scene.robot.rollers) : candidate.phi[run.record];
      run.paths.push_back(simulated(candidate.scene, records_[run.record], ahead, softly, settings_.resolution,
                                    settings_.workers.stop));
    }
  });
  Eigen::MatrixXd off = truth().replicate(1, static_cast<Eigen::Index>(candidates.size()));
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const auto moved = [&](std::size_t r) {
      const std::vector<Path>& paths = runs.at(key_of(candidates[k], r)).paths;
      Displacements mean(tracks_[r].windows.size(), Eigen::Vector3d::Zero());
      for (const Path& path : paths) {
        const Displacements one = displacements(tracks_[r], path, candidates[k].clocks[r]);
        for (std::size_t w = 0; w < one.size(); ++w) mean[w] += one[w] / static_cast<double>(paths.size());
      }
      return mean;
    };
    off.col(static_cast<Eigen::Index>(k)) -= all_rows(moved);
  }
  return off;
}

Eigen::MatrixXd EncoderComparison::residuals(const std::vector<Candidate>& candidates) const {
  Eigen::MatrixXd all = off(candidates);
  for (auto column : all.colwise()) column = errors(column);
  return all;
}

/// The median of ratios, weighted by the size of their denominators: the least sum of absolute errors.
double median_ratio(std::vector<std::pair<double, double>> ratios) {
  std::sort(ratios.begin(), ratios.end());
  double weight = 0;
  for (const auto& ratio : ratios) weight += ratio.second / 2;
  for (const auto& [ratio, size] : ratios) {
    weight -= size;
    if (weight <= 0) return ratio;
  }
  return 1;
}

Eigen::VectorXd EncoderComparison::off_by_kinematics(const Candidate& candidate) const {
  const Eigen::VectorXd moved = truth();
  Eigen::VectorXd rolled = by_wheels(candidate);
  const Eigen::VectorXd x = uncorrelated(moved), y = uncorrelated(rolled);
  for (int c = 0; c < 3; ++c) {
    std::vector<std::pair<double, double>> ratios;
    for (Eigen::Index row = c; row < y.size(); row += 3) {
      if (y[row] != 0) ratios.emplace_back(x[row] / y[row], std::abs(y[row]));
    }
    rolled(Eigen::seq(c, Eigen::last, 3)) *= median_ratio(std::move(ratios));
  }
  return moved - rolled;
}

void EncoderComparison::leave_out_jumps(const Candidate& candidate) {
  const Eigen::VectorXd off = off_by_kinematics(candidate), rolled = by_wheels(candidate);
  const double lever = Rolling(candidate.scene.robot).lever();
  Eigen::Array3d usual;
  for (int c = 0; c < 3; ++c) usual[c] = std::sqrt(spread(off, c, 1));
  Eigen::Index row = 0;
  for (Track& track : tracks_) {
    std::vector<int> windows;
    for (const int window : track.windows) {
      const Eigen::Array3d arms(1, 1, lever), way = rolled.segment<3>(row).array() * arms;
      if ((off.segment<3>(row).array().abs() <= kJump * usual + kSlip * way.matrix().norm() / arms).all())
        windows.push_back(window);
      row += 3;
    }
    track.jumps = static_cast<int>(track.windows.size() - windows.size());
    track.windows = std::move(windows);
  }
}

/// The variance of the sums of this many successive errors of a mode, by their median.
double EncoderComparison::spread(const Eigen::VectorXd& off, int mode, int count) const {
  std::vector<double> sizes;
  int length = 0;
  for (Eigen::Index row = mode; row < off.size(); row += 3) {
    length = before(row) < 0 ? 1 : length + 1;
    if (length >= count) sizes.push_back(std::abs(off(Eigen::seqN(row - 3 * (count - 1), count, 3)).sum()));
  }
  return std::pow(std::max(kMinScatter, 1.4826 * median(sizes)), 2);
}

void EncoderComparison::expect(const Eigen::VectorXd& off) {
  expected_.resize(off.size());
  taken_.resize(off.size());
  for (int c = 0; c < 3; ++c) {
    const double window = spread(off, c, 1), many = spread(off, c, kLong);
    const double growth = std::clamp((many - window) / (kLong - 1), kMinGrowth * window, window);
    const double noise = (window - growth) / 2;  // of a pose
    double variance = 0;
    for (Eigen::Index row = c; row < off.size(); row += 3) {
      taken_[row] = before(row) < 0 ? 0 : noise / variance;
      variance = growth + 2 * noise - taken_[row] * noise;
      expected_[row] = std::sqrt(variance);
    }
  }
}

Eigen::VectorXd EncoderComparison::uncorrelated(Eigen::VectorXd off, double limit) const {
  if (expected_.size() == 0) return off;
  for (Eigen::Index row = 0; row < off.size(); ++row) {
    if (taken_[row] > 0) off[row] += taken_[row] * expected_[row - 3] * std::clamp(off[row - 3], -limit, limit);
    off[row] /= expected_[row];
  }
  return off;
}

double EncoderComparison::wheel_error(const Candidate& candidate) const {
  const Eigen::VectorXd off = this->off({candidate}).col(0);
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();  // m^2, m^2, rad^2
  double turns = 0;                                   // of the wheels, where the error is one, rad^2
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < records_.size(); ++r) {
    const auto phi = [&](int window) {
      return interpolated(records_[r].t, records_[r].phi, candidate.clocks[r].encoders(end_of(window)));
    };
    const std::vector<int>& windows = tracks_[r].windows;
    for (std::size_t k = 0; k + kLong <= windows.size(); k += kLong, row += 3 * kLong) {
      Wheels moved = Wheels::Zero();
      for (std::size_t i = k; i < k + kLong; ++i) {
        const Wheels one = phi(windows[i]) - phi(windows[i] - 1);
        moved += one;
        turns += 2 * M_PI * sum(one.abs());
      }
      turns += sum(moved.square());
      squares += off.segment<3 * kLong>(row).reshaped(3, kLong).rowwise().sum().cwiseAbs2();
    }
    row += 3 * static_cast<Eigen::Index>(windows.size() % kLong);
  }
  const auto J = DriverKinematics::of(candidate.scene.robot).jacobian();
  return std::sqrt(kWheels * squares.cwiseQuotient(J.rowwise().squaredNorm()).mean() / std::max(turns, 1e-9));
}

void EncoderComparison::check(const Candidate& candidate) {
  const double lever = Rolling(candidate.scene.robot).lever();
  const Eigen::VectorXd moved = uncorrelated(truth()), off = uncorrelated(off_by_kinematics(candidate));
  const Eigen::VectorXd rolled = by_wheels(candidate);
  Eigen::Index begin = 0;
  for (std::size_t r = 0; r < records_.size(); ++r) {
    Eigen::Array3d way, unexplained;
    for (int c = 0; c < 3; ++c) {
      const auto rows = Eigen::seqN(begin + c, tracks_[r].windows.size(), 3);
      way[c] = rolled(rows).lpNorm<1>() * (c == 2 ? lever : 1);
      unexplained[c] = off(rows).lpNorm<1>() / moved(rows).lpNorm<1>();
    }
    tracks_[r].all_driven = (way >= kDriven * way.sum()).all();
    for (int c = 0; c < 3; ++c) {
      if (way[c] < kDriven * way.sum() || unexplained[c] <= kMaxUnexplained) continue;
      throw UnusableRecord(fmt::format(
          "{}: its ground truth does not fit the wheels' motion: {:.0f} % of it ({}) stays unexplained; must be at "
          "most {:.0f} %: are --joints, their signs and --scene those of this base?",
          records_[r].name, 100 * unexplained[c], kDirections[c], 100 * kMaxUnexplained));
    }
    begin += 3 * static_cast<Eigen::Index>(tracks_[r].windows.size());
  }
}

void EncoderComparison::search_angles(Candidate& candidate) const {
  constexpr int kRounds = 2, kTried = 8;
  const double step = 2 * M_PI / candidate.scene.robot.rollers / kTried;
  for (int k = 0; k < kRounds * kWheels; ++k) {
    const int i = k % kWheels;
    std::vector<Candidate> tried(kTried, candidate);
    for (int j = 0; j < kTried; ++j) {
      for (Wheels& ahead : tried[j].phi) ahead[i] += j * step;
    }
    Eigen::MatrixXd squares = residuals(tried).cwiseAbs2();
    for (const int row : held_out()) squares.row(row).setZero();
    Eigen::Index begin = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const auto rows = static_cast<Eigen::Index>(3 * tracks_[r].windows.size());
      Eigen::Index best = 0;
      squares.middleRows(begin, rows).colwise().sum().minCoeff(&best);
      candidate.phi[r][i] += static_cast<double>(best) * step;
      begin += rows;
    }
    settings_.progress(0.2 + 0.2 * (k + 1) / (kRounds * kWheels));
  }
}

/// Values and sigmas of clocks and angles; `all`: the trial before any parameter was put back.
void report_records(const std::vector<DriveRecord>& records, const EncoderComparison& comparison, const Trial& all,
                    EncoderFit& fit) {
  const double pitch = 2 * M_PI / fit.best.scene.robot.rollers;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const auto sigma = fit.sigma.segment<2>(static_cast<Eigen::Index>(all.clock_of(r)));
    EncoderFit::Drive drive{fit.best.clocks[r], {sigma[0] * kOffsetStep, sigma[1] * kStretchStep}, {}, {}};
    drive.jumps = comparison.track(r).jumps;
    if (!fit.best.phi.empty()) {
      const Wheels off = fit.sigma.segment<kWheels>(static_cast<Eigen::Index>(all.angles_of(r))).array() * kAngleStep;
      // A roller's angle that is anywhere has this sigma.
      if (comparison.track(r).all_driven && (off < pitch / std::sqrt(12)).all()) {
        drive.angles_at_zero = fit.best.phi[r] - pitch * (fit.best.phi[r] / pitch).round();
        drive.angles_sigma = off;
      } else {
        fit.unidentifiable.push_back(
            fmt::format("{}: which rollers touch the floor where the encoders read zero; drive laterally and in yaw",
                        records[r].name));
      }
    }
    fit.drives.push_back(drive);
  }
}

/// Fits the first `count` parameters, clocks and angles.
void minimize_first(const EncoderComparison& comparison, std::size_t count, Trial& trial) {
  trial.free.resize(count);
  std::iota(trial.free.begin(), trial.free.end(), 0);
  linearize(comparison, trial, trial.start());
  minimize(comparison, trial);
}

}  // namespace

EncoderFit fit_encoders(const Scene& start, const std::vector<DriveRecord>& records,
                        const EncoderFitSettings& settings) {
  constexpr std::size_t kSizes = 2;  // parameters
  const std::size_t parameters = encoder_parameters().size();
  Trial trial = trial_of(encoder_parameters(), {start, {}, std::vector<ClockMap>(records.size())});
  trial.weight.setConstant(1 / kPrior);
  trial.weight[0] = 0;  // any drive shows the wheels' radius, and the start's may be far off
  for (std::size_t k = 0; k < parameters; ++k)
    trial.expected[k] = encoder_parameters()[k].get(start) / encoder_parameters()[k].step;
  EncoderComparison comparison(records, settings, trial.candidate);
  const Candidate unfitted = trial.candidate;
  if (settings.find_angles) {
    minimize_first(comparison, kSizes, trial);
    settings.progress(0.2);
    trial.candidate.phi.assign(records.size(), spread_angles(0, start.robot.rollers));
    comparison.search_angles(trial.candidate);
  }
  minimize_first(comparison, parameters, trial);
  comparison.expect(comparison.off({trial.candidate}).col(0));
  minimize_first(comparison, parameters, trial);
  settings.progress(0.7);
  const Trial all = trial;
  EncoderFit fit;
  fit.resolution = settings.resolution;
  finish(comparison, start, trial, fit);
  report_records(records, comparison, all, fit);
  Candidate unknown = trial.candidate;
  unknown.phi.clear();
  fit.error_before = comparison.error_of(comparison.off({unfitted}).col(0));
  fit.error_kinematics = comparison.error_of(comparison.off_by_kinematics(trial.candidate));
  fit.error_unknown = comparison.error_of(comparison.off({unknown}).col(0));
  fit.wheel_error = comparison.wheel_error(trial.candidate);
  settings.progress(1);
  return fit;
}

}  // namespace youbot_base_sim
