#include "youbot_base_sim/physics/roller_geometry.h"

#include <cmath>
#include <stdexcept>

namespace youbot_base_sim {

RollerGeometry::RollerGeometry(const RobotParameters& robot)
    : pitch_(2 * M_PI / robot.rollers),
      R_(robot.R),
      R_d_(robot.R_d),
      R_d_tan_delta_(robot.R_d * robot.tan_delta()),
      sin_delta_(robot.sin_delta()),
      cos_delta_(robot.cos_delta()) {
  // Means of sec(phi~) and cos(phi~) over [-edge, edge]
  const double edge = 0.5 * pitch_;
  const auto [sine, cosine] = sine_and_cosine(edge);
  const double mean_secant = logarithm((1 + sine) / cosine) / edge;
  const double mean_cosine = sine / edge;
  mean_ = {Wheels::Zero(), sin_delta_ * (R_ - R_d_ * mean_secant), cos_delta_ * (R_ * mean_cosine - R_d_),
           Wheels::Zero()};
}

double RollerGeometry::end_radius() const { return R_ - R_d_ / sine_and_cosine(0.5 * pitch_).cosine; }

std::int64_t RollerGeometry::roller_at(double phi) const {
  const double number = std::floor(phi / pitch_ + 0.5);
  constexpr double kMax = 9e18;  // of 64 bits
  if (!(std::abs(number) < kMax)) throw std::domain_error("a wheel has turned too far for its rollers to be numbered");
  auto k = static_cast<std::int64_t>(number);
  // The quotient may round across the edge; the edges themselves decide.
  if (phi >= upper_edge(k)) ++k;
  if (phi < upper_edge(k - 1)) --k;
  return k;
}

Wheels spread_angles(int k, int n) {
  constexpr double kRoot = 1.1673039782614187;  // of x^5 = x + 1
  Wheels angles;
  for (int i = 0; i < kWheels; ++i) angles[i] = 2 * M_PI / n * std::fmod(0.5 + k * std::pow(kRoot, -(i + 1)), 1);
  return angles;
}

}  // namespace youbot_base_sim
