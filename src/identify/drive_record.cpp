#include "youbot_base_sim/identify/drive_record.h"

#include <algorithm>

namespace youbot_base_sim {

namespace {

constexpr double kJump = 0.3;                     // rad/s, of any wheel
constexpr double kMinLength = 1, kMaxLength = 4;  // s
constexpr int kHeldOut = 3;                       // every third motion is
constexpr double kUnchanged = 0.01;               // rad/s: two of the motor's rpm

}  // namespace

bool DriveRecord::is_excluded(double time) const {
  return std::any_of(excluded.begin(), excluded.end(),
                     [&](const Eigen::Vector2d& s) { return time >= s[0] && time <= s[1]; });
}

std::vector<std::size_t> DriveRecord::samples(double begin, double end) const {
  std::vector<std::size_t> samples;
  for (std::size_t k = 0; k < t.size(); ++k) {
    if (t[k] >= begin && t[k] < end && !is_excluded(t[k])) samples.push_back(k);
  }
  return samples;
}

std::vector<Motion> DriveRecord::motions() const {
  std::vector<Motion> motions;
  Motion motion{0, 0, true, false};
  Wheels first = Wheels::Zero(), before = Wheels::Zero();
  const auto finish = [&](double time, const Wheels& next) {
    motion.end = time;
    motions.push_back(motion);
    motion = {time, 0, true, (next != 0).any()};
    first = next;
  };
  for (std::size_t k = 0; k < commands.t.size() && commands.t[k] < duration(); ++k) {
    const double time = std::max(commands.t[k], 0.0);
    const Wheels& rate = commands.values[k];
    const bool long_enough = time >= motion.begin + kMinLength;
    const bool jump = ((rate - before).abs() > kJump).any();
    if (long_enough && (jump || (!motion.held && time >= motion.begin + kMaxLength))) {
      finish(time, rate);
    } else if (time <= motion.begin) {
      first = rate;
      motion.moving = (rate != 0).any();
    } else if (((rate - first).abs() > kUnchanged).any()) {
      motion.held = false;
      motion.moving = motion.moving || (rate != 0).any();
    }
    before = rate;
  }
  finish(duration(), first);
  int moving = 0;
  bool held_out = false;
  for (Motion& each : motions) {
    if (each.moving) held_out = ++moving % kHeldOut == 0;
    each.held_out = held_out;
  }
  return motions;
}

const Motion& motion_at(const std::vector<Motion>& motions, double time) {
  return *std::find_if(motions.rbegin(), motions.rend() - 1,
                       [&](const Motion& motion) { return motion.begin <= time; });
}

Eigen::Vector3d modes(const Wheels& w) {
  return Eigen::Vector3d{w[0] + w[1] + w[2] + w[3], -w[0] + w[1] + w[2] - w[3], -w[0] + w[1] - w[2] + w[3]} / 4;
}

Wheels wheels_of(const Eigen::Vector3d& m) {
  return {m[0] - m[1] - m[2], m[0] + m[1] + m[2], m[0] + m[1] - m[2], m[0] - m[1] + m[2]};
}

std::vector<Eigen::Vector3d> modes_of(const std::vector<Wheels>& samples) {
  std::vector<Eigen::Vector3d> all;
  for (const Wheels& w : samples) all.push_back(modes(w));
  return all;
}

std::vector<Eigen::Vector3d> modes_of(const std::vector<Wheels>& a, const std::vector<Wheels>& b) {
  std::vector<Eigen::Vector3d> all;
  for (std::size_t k = 0; k < a.size(); ++k) all.push_back(modes(a[k] - b[k]));
  return all;
}

}  // namespace youbot_base_sim
