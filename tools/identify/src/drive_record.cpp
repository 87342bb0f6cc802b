#include "youbot_base_sim/identify/drive_record.h"

#include <fmt/format.h>

#include <complex>

#include "youbot_base_sim/drive/motor.h"

namespace youbot_base_sim {

namespace {

constexpr double kJump = 0.3;                     // rad/s, of any wheel
constexpr double kMinLength = 1, kMaxLength = 4;  // s
constexpr int kHeldOut = 3;                       // every third motion is
constexpr double kUnchanged = 0.01;               // rad/s: two of the motor's rpm

using Findings = std::vector<std::string>;

/// A unit in which efforts may be.
struct Unit {
  double size;  ///< what a current of 1 mA is in it
  const char* name;
};

void check_length(const DriveRecord& record) {
  constexpr std::size_t kMinSamples = 100;
  if (record.t.size() >= kMinSamples) return;
  throw UnusableRecord(
      fmt::format("{}: {} joint states; must be at least {}", record.name, record.t.size(), kMinSamples));
}

void find_gaps(DriveRecord& record, Findings& findings) {
  const double limit = std::max(0.2, 5 * usual_interval(record.t));
  for (std::size_t k = 1; k < record.t.size(); ++k) {
    if (record.t[k] - record.t[k - 1] <= limit) continue;
    findings.push_back(fmt::format("{}: a gap in joint_states of {:.2f} s at {:.2f} s: left out", record.name,
                                   record.t[k] - record.t[k - 1], record.t[k - 1]));
    record.excluded.emplace_back(record.t[k - 1], record.t[k] + kSettlingTime);
  }
}

/// The initial integrals of the loops are known only for a base at rest.
void find_start_in_motion(DriveRecord& record, Findings& findings) {
  constexpr double kMoving = 0.1;  // rad/s
  if ((record.dphi.front().abs() < kMoving).all()) return;
  findings.push_back(fmt::format("{}: begins in motion: its first {:g} s are left out", record.name, kSettlingTime));
  record.excluded.emplace_back(0, kSettlingTime);
}

/// Turns the samples round of each wheel for which `positive` is not; `finding` has places for record and wheel.
void turn_round(const DriveRecord& record, const Wheels& positive, const std::vector<std::vector<Wheels>*>& samples,
                const char* finding, Findings& findings) {
  for (int i = 0; i < kWheels; ++i) {
    if (positive[i] >= 0) continue;
    for (std::vector<Wheels>* turned : samples) {
      for (Wheels& w : *turned) w[i] = -w[i];
    }
    findings.push_back(fmt::format(finding, record.name, kWheelNames[i]));
  }
}

/// Finds wheels that turn against their commands.
void check_positions(DriveRecord& record, Findings& findings) {
  Wheels product = Wheels::Zero();
  for (std::size_t k = 0; k < record.t.size(); ++k) product += record.commands.at(record.t[k]) * record.dphi[k];
  turn_round(record, product, {&record.phi, &record.dphi},
             "{}: wheel {} turns against its commands: the signs of its position and velocity are reversed", findings);
}

/// True if all efforts are whole multiples of `quantum`.
bool is_quantized_by(const DriveRecord& record, double quantum) {
  std::complex<double> sum = 0;
  double largest = 0;
  for (const Wheels& w : record.torque) {
    largest = std::max(largest, w.abs().maxCoeff());
    for (int i = 0; i < kWheels; ++i) sum += std::polar(1.0, 2 * M_PI * w[i] / quantum);
  }
  return largest > 10 * quantum && std::abs(sum) > 0.9 * kWheels * static_cast<double>(record.torque.size());
}

/// The current comes in whole mA, whatever its unit.
void check_effort_unit(DriveRecord& record, Findings& findings) {
  const Motor motor;
  const Unit units[] = {
      {1, "mA"}, {1e-3, "A"}, {motor.milliampere(), ""}, {1e-3 * motor.torque_constant, "N m at the motor"}};
  for (const Unit& unit : units) {
    if (!is_quantized_by(record, unit.size)) continue;
    if (!*unit.name) return;
    for (Wheels& w : record.torque) w *= motor.milliampere() / unit.size;
    findings.push_back(
        fmt::format("{}: efforts come in steps of {:g}, one mA of the motor: they are {}, not N m at the "
                    "wheel, and converted by {:.4g}",
                    record.name, unit.size, unit.name, motor.milliampere() / unit.size));
    return;
  }
  findings.push_back(record.name +
                     ": efforts do not come in steps of one mA: their unit is assumed to be N m at the wheel");
}

void check_effort(DriveRecord& record, Findings& findings) {
  const bool missing = std::none_of(record.torque.begin(), record.torque.end(),
                                    [](const Wheels& w) { return w.isFinite().all() && (w != 0).any(); });
  if (missing) {
    record.torque.clear();
    findings.push_back(record.name +
                       ": no effort in joint_states: friction and inertia are not fitted; use a driver that "
                       "publishes the sensed torques");
    return;
  }
  check_effort_unit(record, findings);
  Wheels work = Wheels::Zero();  // which motors put into wheels that turn steadily
  for (std::size_t k = 0; k < record.t.size(); ++k) work += record.torque[k] * record.dphi[k];
  turn_round(record, work, {&record.torque},
             "{}: the effort of wheel {} brakes it all the time: its sign is opposite to that of its position, and "
             "is reversed",
             findings);
}

}  // namespace

bool DriveRecord::is_excluded(double time) const {
  return std::any_of(excluded.begin(), excluded.end(),
                     [&](const Eigen::Vector2d& s) { return time >= s[0] && time <= s[1]; });
}

bool DriveRecord::is_tracked(double time) const {
  if (is_excluded(time)) return false;
  const auto next = std::lower_bound(truth_t.begin(), truth_t.end(), time);
  if (next == truth_t.begin() || next == truth_t.end()) return next != truth_t.end() && *next == time;
  return *next - *(next - 1) < max_truth_step;
}

Eigen::Vector3d DriveRecord::truth_at(double time) const { return interpolated(truth_t, truth, time); }

std::vector<std::size_t> DriveRecord::samples(double begin, double end) const {
  std::vector<std::size_t> samples;
  const auto last = std::lower_bound(t.begin(), t.end(), end);
  for (auto time = std::lower_bound(t.begin(), t.end(), begin); time < last; ++time) {
    if (!is_excluded(*time)) samples.push_back(static_cast<std::size_t>(time - t.begin()));
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

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double usual_interval(const std::vector<double>& t) {
  std::vector<double> intervals;
  for (std::size_t k = 1; k < t.size(); ++k) intervals.push_back(t[k] - t[k - 1]);
  return median(intervals);
}

Eigen::Vector3d displacement(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  const double c = std::cos(a[2]), s = std::sin(a[2]);
  return {c * d[0] + s * d[1], -s * d[0] + c * d[1], d[2]};
}

const Motion& motion_at(const std::vector<Motion>& motions, double time) {
  const auto next = std::upper_bound(motions.begin() + 1, motions.end(), time,
                                     [](double t, const Motion& motion) { return t < motion.begin; });
  return *(next - 1);
}

Eigen::Vector3d modes(const Wheels& w) {
  return Eigen::Vector3d{w[0] + w[1] + w[2] + w[3], -w[0] + w[1] + w[2] - w[3], -w[0] + w[1] - w[2] + w[3]} / 4;
}

Wheels wheels_of(const Eigen::Vector3d& m) {
  return {m[0] - m[1] - m[2], m[0] + m[1] + m[2], m[0] + m[1] - m[2], m[0] - m[1] + m[2]};
}

std::vector<Eigen::Vector3d> modes_of(const std::vector<Wheels>& samples, const std::vector<Wheels>& from) {
  std::vector<Eigen::Vector3d> all;
  for (std::size_t k = 0; k < samples.size(); ++k)
    all.push_back(modes(from.empty() ? samples[k] : Wheels(samples[k] - from[k])));
  return all;
}

std::vector<std::string> inspect(DriveRecord& record) {
  Findings findings;
  check_length(record);
  if (record.commands.t.empty())
    throw UnusableRecord(record.name +
                         ": no commands; must have cmd_vel or velocity_command, or columns command_fl ...");
  find_gaps(record, findings);
  if (record.rates_from_angles) findings.push_back(record.name + ": no velocities: differences of the angles");
  if (std::all_of(record.dphi.begin(), record.dphi.end(), [](const Wheels& rate) { return (rate == 0).all(); }))
    throw UnusableRecord(record.name + ": the wheels never turn");
  check_positions(record, findings);
  find_start_in_motion(record, findings);
  check_effort(record, findings);
  return findings;
}

std::vector<std::string> inspect_encoders(DriveRecord& record) {
  Findings findings;
  check_length(record);
  if (!record.has_truth())
    throw UnusableRecord(record.name +
                         ": no ground truth; must have the pose of the base: see --topic ground_truth=TOPIC, --frames");
  find_gaps(record, findings);
  return findings;
}

std::vector<std::string> find_pushes(DriveRecord& record, const Readings& predicted) {
  constexpr double kFilter = 0.1, kMinTorque = 0.12, kMinRate = 0.08, kApart = 1.0;  // s, N m, rad/s, s
  constexpr double kFactor = 8;
  Findings findings;
  if (!record.has_torque()) return findings;
  const auto rate = low_pass(record.t, modes_of(record.dphi, predicted.dphi), kFilter);
  const auto torque = low_pass(record.t, modes_of(record.torque, predicted.torque), kFilter);
  const std::vector<Motion> motions = record.motions();
  const auto settled = [&](double t) {
    const Motion& m = motion_at(motions, t);
    return m.held && t >= m.begin + kSettlingTime && t < m.end && !record.is_excluded(t);
  };
  for (int mode = 0; mode < kModes; ++mode) {
    std::vector<double> rates, torques;
    for (std::size_t k = 0; k < record.t.size(); ++k) {
      if (!settled(record.t[k])) continue;
      rates.push_back(std::abs(rate[k][mode]));
      torques.push_back(std::abs(torque[k][mode]));
    }
    const double min_rate = std::max(kMinRate, kFactor * 1.5 * median(rates));
    const double min_torque = std::max(kMinTorque, kFactor * 1.5 * median(torques));
    struct Push {
      double begin, end, torque;
    };
    std::vector<Push> pushes;
    for (std::size_t k = 0; k < record.t.size(); ++k) {
      const double t = record.t[k], size = std::abs(torque[k][mode]);
      if (!settled(t) || size < min_torque || std::abs(rate[k][mode]) < min_rate) continue;
      if (pushes.empty() || t > pushes.back().end + kApart) pushes.push_back({t, t, size});
      pushes.back().end = t;
      pushes.back().torque = std::max(pushes.back().torque, size);
    }
    for (const Push& push : pushes) {
      findings.push_back(
          fmt::format("{}: from {:.1f} to {:.1f} s the base is pushed ({}) with up to {:.2g} N m per wheel: left out",
                      record.name, push.begin, push.end, kDirections[mode], push.torque));
      record.excluded.emplace_back(push.begin - 0.3, push.end + kSettlingTime);
    }
  }
  return findings;
}

}  // namespace youbot_base_sim
