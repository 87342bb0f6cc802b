#include "youbot_base_sim/drive/torque_profiles.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

Eigen::Vector3d ReferenceMotion::velocity(double t) const {
  const double w = 2 * M_PI / period;
  const auto [s, c] = sine_and_cosine(w * t);
  const auto value = [s = s, c = c](const Harmonic& v) { return v.constant + v.cos * c + v.sin * s; };
  return {value(V_X), value(V_Y), value(Omega)};
}

Eigen::Vector3d ReferenceMotion::acceleration(double t) const {
  const double w = 2 * M_PI / period;
  const auto [s, c] = sine_and_cosine(w * t);
  const auto value = [w, s = s, c = c](const Harmonic& v) { return w * (v.sin * c - v.cos * s); };
  return {value(V_X), value(V_Y), value(Omega)};
}

ReferenceTorque::ReferenceTorque(const RobotParameters& robot, const ReferenceMotion& motion)
    : model_(robot), motion_(motion) {
  constant_ = cos_ = sin_ = cos_2_ = sin_2_ = Wheels::Zero();
  constexpr int kSamples = 5;  // as many as coefficients: a discrete Fourier transform
  for (int k = 0; k < kSamples; ++k) {
    const double part = static_cast<double>(k) / kSamples, t = part * motion.period, angle = 2 * M_PI * part;
    const Wheels M = model_.torque(motion.velocity(t), motion.acceleration(t)) / kSamples;
    constant_ += M;
    const auto [s, c] = sine_and_cosine(angle);
    const auto [s_2, c_2] = sine_and_cosine(2 * angle);
    cos_ += 2 * M * c;
    sin_ += 2 * M * s;
    cos_2_ += 2 * M * c_2;
    sin_2_ += 2 * M * s_2;
  }
}

Wheels ReferenceTorque::value(double t) const {
  if (model_.dry()) return model_.torque(motion_.velocity(t), motion_.acceleration(t));
  const auto [s, c] = sine_and_cosine(2 * M_PI * t / motion_.period);
  return at(s, c);
}

std::array<Wheels, 3> ReferenceTorque::values(const std::array<double, 3>& t) const {
  if (model_.dry()) return TorqueProfile::values(t);
  const auto [s, c] = sine_and_cosine(Wheels(2 * M_PI * Wheels{t[0], t[1], t[2], 0} / motion_.period));
  return {at(s[0], c[0]), at(s[1], c[1]), at(s[2], c[2])};
}

// The torque at the phase of the motion that has this sine and cosine.
Wheels ReferenceTorque::at(double s, double c) const {
  return constant_ + c * cos_ + s * sin_ + (c * c - s * s) * cos_2_ + (2 * s * c) * sin_2_;
}

// The torque jumps where the dry friction of the desired motion changes its sign.
double ReferenceTorque::max_step(double t) const {
  const auto varies = [](const Harmonic& v) { return v.cos != 0 || v.sin != 0; };
  if (!varies(motion_.V_X) && !varies(motion_.V_Y) && !varies(motion_.Omega)) return kInfinity;
  const double by_phase = kShareOfPeriod * motion_.period;
  if (!model_.dry()) return by_phase;
  const Eigen::Vector3d v = motion_.velocity(t);
  const double length = std::min(by_phase, model_.max_step(v, motion_.acceleration(t)));
  return std::min(length, model_.max_step(v, (motion_.velocity(t + length) - v) / length));  // by what it grows to
}

double PiecewiseTorque::max_step(double) const {
  return (segment_.cos != 0 || segment_.sin != 0).any() ? kShareOfPeriod * segment_.period : kInfinity;
}

double PiecewiseTorque::begin_segment(double t) {
  const auto next = std::upper_bound(segments_.begin(), segments_.end(), t,
                                     [](double time, const TorqueSegment& segment) { return time < segment.start; });
  segment_ = next == segments_.begin() ? TorqueSegment{} : *(next - 1);
  return next == segments_.end() ? kInfinity : next->start;
}

Wheels PiecewiseTorque::value(double t) const {
  const auto [s, c] = sine_and_cosine(2 * M_PI * t / segment_.period);
  return segment_.constant + segment_.cos * c + segment_.sin * s;
}

Wheels WheelTable::at(double time) const {
  const auto after = std::upper_bound(t.begin(), t.end(), time);
  if (after == t.begin()) return Wheels::Zero();
  return values[static_cast<std::size_t>(after - t.begin()) - 1];
}

double WheelTable::next(double time) const {
  const auto after = std::upper_bound(t.begin(), t.end(), time);
  return after == t.end() ? kInfinity : *after;
}

double TableTorque::begin_segment(double t) {
  segment_ = table_.at(t);
  return table_.next(t);
}

}  // namespace youbot_base_sim
