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

}  // namespace

Comparison::Comparison(const DriveRecord& record, double delay)
    : record_(record),
      jumping_(jumping(record, delay)),
      rate_(low_pass(record.t, modes_of(record.dphi), kComparisonFilter)),
      torque_(low_pass(record.t, modes_of(record.torque), kComparisonFilter, jumping_)) {
  choose_samples();
  choose_windows();
  // In the order of `residuals`.
  const std::vector<Motion> motions = record.motions();
  const auto add = [&](double t, bool first, int rows) {
    for (int r = 0; r < rows; ++r) {
      rows_.push_back({motion_at(motions, t).held_out, first ? -1 : static_cast<int>(rows_.size()) - rows});
    }
  };
  const int per_sample = record.has_torque() ? 2 * kModes : kModes;
  for (const std::size_t k : samples_) add(record.t[k], k == samples_.front(), per_sample);
  for (const Window& w : windows_) add(record.t[w.first], w.first == windows_.front().first, 3);
}

void Comparison::choose_samples() {
  double next = 0;
  for (const std::size_t k : record_.samples()) {
    if (record_.t[k] < next) continue;
    samples_.push_back(k);
    next = record_.t[k] + kInterval;
  }
}

void Comparison::choose_windows() {
  if (!record_.has_truth()) return;
  for (std::size_t first = 0, last = 1; last < record_.t.size(); ++last) {
    if (record_.t[last] < record_.t[first] + kWindow) continue;
    const double begin = record_.t[first], end = record_.t[last];
    if (begin >= record_.truth_t.front() && end <= record_.truth_t.back() && !record_.is_excluded(begin) &&
        !record_.is_excluded(end)) {
      windows_.push_back({first, last, moved(truth_at(record_, begin), truth_at(record_, end))});
    }
    first = last;
  }
}

Eigen::VectorXd Comparison::residuals(const Prediction& prediction) const {
  const auto rate = low_pass(record_.t, modes_of(prediction.dphi), kComparisonFilter);
  const auto torque = low_pass(record_.t, modes_of(prediction.torque), kComparisonFilter, jumping_);
  Eigen::VectorXd all(static_cast<Eigen::Index>(rows_.size()));
  Eigen::Index row = 0;
  const auto add = [&](const Eigen::Vector3d& difference, double expected) {
    all.segment<3>(row) = difference / expected;
    row += 3;
  };
  for (const std::size_t k : samples_) {
    add(rate_[k] - rate[k], kRate);
    if (record_.has_torque()) add(torque_[k] - torque[k], kTorque);
  }
  for (const Window& w : windows_) add(w.moved - moved(prediction.pose[w.first], prediction.pose[w.last]), kPose);
  return all;
}

}  // namespace youbot_base_sim
