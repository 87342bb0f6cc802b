#include "youbot_base_sim/slip_odometry/wheel_stream.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

std::optional<WheelStream::Reading> WheelStream::read(const std::string& from, double t,
                                                      const std::vector<std::string>& names,
                                                      const std::vector<double>& positions,
                                                      const std::vector<double>& velocities,
                                                      const std::vector<double>& efforts) {
  finding_.clear();
  Reading reading;
  for (int i = 0; i < kWheels; ++i) {
    const auto joint = std::find(names.begin(), names.end(), joints[static_cast<std::size_t>(i)]);
    const auto k = static_cast<std::size_t>(joint - names.begin());
    if (joint == names.end() || k >= positions.size()) return {};  // the arm's, perhaps
    const double sign = std::copysign(1, rad_per_unit[i]);
    reading.phi[i] = rad_per_unit[i] * positions[k];
    reading.dphi[i] = k < velocities.size() ? sign * velocities[k] : std::nan("");
    reading.torque[i] = k < efforts.size() ? sign * efforts[k] : std::nan("");
  }
  if (!counts(from, t)) return {};
  if (reading.phi.allFinite()) count_on(t, reading.phi);
  reading.phi += counted_;
  return reading;
}

/// Another publisher counts once the present one is silent, unless one was chosen.
bool WheelStream::counts(const std::string& from, double t) {
  constexpr double kSilence = 2;  // s
  if (!publisher.empty()) {
    followed_ = publisher;
  } else if (!last_ || std::abs(t - time_) > kSilence) {
    followed_ = from;
  }
  if (from != followed_ && from != other_) {
    finding_ = fmt::format("{} publishes joint_states too: follows {} (to choose: ~publisher)", from, followed_);
    other_ = from;
  }
  return from == followed_;
}

/// Positions have begun anew where a wheel's change all but spans the shortest period that holds all of them.
void WheelStream::count_on(double t, const Wheels& phi) {
  constexpr double kMinShare = 0.75, kTurn = 2 * M_PI, kOther = 0.03, kExact = 1e-3;
  constexpr int kFewestBits = 8, kMostBits = 32;
  const Wheels change = phi - last_.value_or(phi);
  min_ = last_ ? min_.min(phi) : phi;
  max_ = last_ ? max_.max(phi) : phi;
  const double span = (1 - 1e-9) * (max_ - min_).maxCoeff(), unit = std::abs(rad_per_unit[0]);
  double period = period_ > 0 ? period_ : kTurn;
  for (int bits = kFewestBits; period_ == 0 && unit != 1 && bits <= kMostBits; ++bits) {
    const double counter = std::ldexp(unit, bits);
    if (counter >= span && (counter < period || period < span)) period = counter;
  }
  for (int i = 0; i < kWheels; ++i) {
    if (std::abs(change[i]) < kMinShare * period || span > (1 + kExact) * period) continue;
    if (period_ == 0 && period != kTurn && std::abs(change[i]) <= max_rate * (t - time_)) continue;
    // A counter that ends elsewhere goes back by the rest of a change like the one before.
    const double found = std::abs(change[i]) + std::abs(change_[i]);
    if (period_ == 0 && std::abs(found / period - 1) > kOther) period = found;
    if (period_ == 0) finding_ = fmt::format("positions begin anew after {:.6g} rad: counted on", period);
    period_ = period;
    counted_[i] -= std::copysign(period, change[i]);
  }
  last_ = phi;
  change_ = change;
  time_ = t;
}

}  // namespace youbot_base_sim
