#include "youbot_base_sim/identify/comparison.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

constexpr double kInterval = 0.1;   // s, of the samples that are compared
constexpr double kWindow = 0.5;     // s, over which ground truth is compared
constexpr double kRate = 0.02;      // rad/s that rates may be off,
constexpr double kTorque = 0.02;    // N m, torques,
constexpr double kPose = 2e-3;      // m and rad, poses
constexpr double kJumping = 0.012;  // s: what a first guess of the delay may be off
constexpr double kOutlier = 3;      // residuals beyond it count linearly

/// A residual whose square is the robust cost: quadratic at first, linear beyond kOutlier. Ceres has it as
/// SoftLOneLoss, but applies a loss to a block as a whole, and one block has all rows, since one simulation yields
/// them.
double robust(double r) {
  const double s = r * r / (kOutlier * kOutlier);
  return std::copysign(kOutlier * std::sqrt(2 * (std::sqrt(1 + s) - 1)), r);
}

/// For each sample, whether a command comes to act about then.
std::vector<bool> jumping(const DriveRecord& record, double delay) {
  std::vector<bool> jumping(record.t.size(), false);
  for (const double change : record.commands.t) {
    const auto first = std::lower_bound(record.t.begin(), record.t.end(), change + delay - kJumping);
    for (auto t = first; t != record.t.end() && *t <= change + delay + kJumping; ++t) {
      jumping[static_cast<std::size_t>(t - record.t.begin())] = true;
    }
  }
  return jumping;
}

/// From pose a to pose b, in the frame of a.
Eigen::Vector3d moved(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double c = std::cos(a[2]), s = std::sin(a[2]);
  return {c * d[0] + s * d[1], -s * d[0] + c * d[1], d[2]};
}

Eigen::Vector3d truth_at(const DriveRecord& record, double t) {
  const auto next = std::lower_bound(record.truth_t.begin(), record.truth_t.end(), t);
  const auto k = std::clamp<std::ptrdiff_t>(next - record.truth_t.begin(), 1,
                                            static_cast<std::ptrdiff_t>(record.truth_t.size()) - 1);
  const auto j = static_cast<std::size_t>(k);
  const double share = (t - record.truth_t[j - 1]) / (record.truth_t[j] - record.truth_t[j - 1]);
  return record.truth[j - 1] + share * (record.truth[j] - record.truth[j - 1]);
}

/// The record as a prediction would have it.
Prediction recorded(const DriveRecord& record) {
  const Readings& readings = record;
  Prediction motion{readings, {}};
  if (record.truth_t.size() < 2) return motion;
  for (const double t : record.t) motion.pose.push_back(truth_at(record, t));
  return motion;
}

std::vector<std::size_t> compared_samples(const DriveRecord& record) {
  std::vector<std::size_t> samples;
  double next = 0;
  for (const std::size_t k : record.samples()) {
    if (record.t[k] < next) continue;
    samples.push_back(k);
    next = record.t[k] + kInterval;
  }
  return samples;
}

std::vector<std::pair<std::size_t, std::size_t>> compared_windows(const DriveRecord& record) {
  std::vector<std::pair<std::size_t, std::size_t>> windows;
  if (!record.has_truth()) return windows;
  for (std::size_t first = 0, last = 1; last < record.t.size(); ++last) {
    const double begin = record.t[first], end = record.t[last];
    if (end < begin + kWindow) continue;
    if (begin >= record.truth_t.front() && end <= record.truth_t.back() && !record.is_excluded(begin) &&
        !record.is_excluded(end)) {
      windows.emplace_back(first, last);
    }
    first = last;
  }
  return windows;
}

}  // namespace

Comparison::Comparison(const std::vector<DriveRecord>& records, double delay, const Workers& workers)
    : records_(records), workers_(workers) {
  for (const DriveRecord& record : records) {
    Part part{jumping(record, delay), compared_samples(record), compared_windows(record), {}, {}};
    add_rows(record, part);
    part.recorded = values(record, part, recorded(record));
    parts_.push_back(std::move(part));
  }
}

void Comparison::add_rows(const DriveRecord& record, Part& part) {
  const std::vector<Motion> motions = record.motions();
  const auto add = [&](double t, bool first, const std::vector<double>& expected) {
    const bool is_held_out = motion_at(motions, t).held_out;
    for (std::size_t k = 0; k < kModes * expected.size(); ++k) {
      const int row = static_cast<int>(predecessors_.size());
      (is_held_out ? held_out_ : training_).push_back(row);
      predecessors_.push_back(first ? -1 : row - static_cast<int>(kModes * expected.size()));
      part.expected.push_back(expected[k / kModes]);
    }
  };
  const std::vector<double> of_sample =
      record.has_torque() ? std::vector<double>{kRate, kTorque} : std::vector<double>{kRate};
  for (const std::size_t k : part.samples) add(record.t[k], k == part.samples.front(), of_sample);
  for (const auto& window : part.windows) add(record.t[window.first], window == part.windows.front(), {kPose});
}

/// In the order of `add_rows`.
Eigen::VectorXd Comparison::values(const DriveRecord& record, const Part& part, const Prediction& motion) {
  const auto rate = low_pass(record.t, modes_of(motion.dphi), kComparisonFilter);
  const auto torque = low_pass(record.t, modes_of(motion.torque), kComparisonFilter, part.jumping);
  Eigen::VectorXd all(part.expected.size());
  Eigen::Index row = 0;
  const auto add = [&](const Eigen::Vector3d& value) {
    all.segment<3>(row) = value;
    row += 3;
  };
  for (const std::size_t k : part.samples) {
    add(rate[k]);
    if (record.has_torque()) add(torque[k]);
  }
  for (const auto& [first, last] : part.windows) add(moved(motion.pose[first], motion.pose[last]));
  return all;
}

Eigen::MatrixXd Comparison::residuals(const std::vector<Candidate>& candidates) const {
  const std::vector<std::vector<Prediction>> predictions = predict(candidates, records_, workers_);
  Eigen::MatrixXd residuals(predecessors_.size(), candidates.size());
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    Eigen::Index row = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Part& part = parts_[r];
      const Eigen::VectorXd off = part.recorded - values(records_[r], part, predictions[k][r]);
      const Eigen::Map<const Eigen::VectorXd> expected(part.expected.data(), off.size());
      residuals.col(k).segment(row, off.size()) = off.cwiseQuotient(expected).unaryExpr(&robust);
      row += off.size();
    }
  }
  return residuals;
}

double Comparison::held_out_error(const Eigen::VectorXd& residuals) const {
  return held_out_.empty() ? 0 : residuals(held_out_).norm() / std::sqrt(held_out_.size());
}

}  // namespace youbot_base_sim
