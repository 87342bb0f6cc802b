#include "youbot_base_sim/drive/imu.h"

#include "youbot_base_sim/drive/normal_noise.h"

namespace youbot_base_sim {

namespace {

Eigen::Vector2d velocity_of(const State& state) { return turned({state.V_X(), state.V_Y(), 0}, state.psi()).head<2>(); }

/// What an accelerometer reads at heading psi (rad), where the velocity changes by `acceleration` in the scene's frame.
Eigen::Vector3d reading(const Eigen::Vector2d& acceleration, const Eigen::Vector3d& upwards, double psi) {
  const Eigen::Vector3d whole = upwards + Eigen::Vector3d(acceleration[0], acceleration[1], 0);
  return turned(whole, -psi);
}

double square(double x) { return x * x; }

}  // namespace

Imu::Imu(const ImuSettings& settings, const FloorParameters& floor, double t, const State& state)
    : settings_(settings),
      upwards_(turned({floor.g * sine_and_cosine(floor.slope).sine, 0, floor.g * sine_and_cosine(floor.slope).cosine},
                      floor.uphill)),
      start_(t),
      t_(t),
      psi_(state.psi()),
      velocity_(velocity_of(state)),
      rate_(state.Omega()),
      specific_(reading({0, 0}, upwards_, psi_)) {}

void Imu::update(double t, const State& state) {
  const double passed = t - t_;
  if (!(passed > 0)) return;
  const Wheels noise = normal_noise(random_);
  const Eigen::Vector2d velocity = velocity_of(state);
  rate_ = (state.psi() - psi_) / passed + settings_.rate_bias + settings_.rate_noise * noise[0];
  // At the end's heading, the mean over a curve would lean backwards.
  specific_ = reading((velocity - velocity_) / passed, upwards_, 0.5 * (psi_ + state.psi()));
  for (int i = 0; i < 3; ++i) {
    specific_[i] += settings_.acceleration_bias + settings_.acceleration_noise * noise[i + 1];
  }
  heading_ += rate_ * passed;
  walked_variance_ += square(settings_.rate_noise * passed);
  t_ = t;
  psi_ = state.psi();
  velocity_ = velocity;
}

double Imu::rate_variance() const { return square(settings_.rate_noise) + square(settings_.rate_bias); }

double Imu::acceleration_variance() const {
  return square(settings_.acceleration_noise) + square(settings_.acceleration_bias);
}

double Imu::heading_variance() const { return walked_variance_ + square(settings_.rate_bias * (t_ - start_)); }

}  // namespace youbot_base_sim
