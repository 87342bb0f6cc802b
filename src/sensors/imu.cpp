#include "youbot_base_sim/sensors/imu.h"

#include "youbot_base_sim/sensors/normal_noise.h"

namespace youbot_base_sim {

namespace {

/// Velocity of a point of the base, in the scene's frame.
Eigen::Vector2d velocity_of(const State& state, const Eigen::Vector3d& point) {
  const double V_X = state.V_X() - state.Omega() * point.y(), V_Y = state.V_Y() + state.Omega() * point.x();
  return turned({V_X, V_Y, 0}, state.psi()).head<2>();
}

/// Reading of an accelerometer at heading psi (rad), where the velocity changes by `acceleration` in the scene's frame.
Eigen::Vector3d reading(const Eigen::Vector2d& acceleration, const Eigen::Vector3d& upwards, double psi) {
  const Eigen::Vector3d whole = upwards + Eigen::Vector3d(acceleration[0], acceleration[1], 0);
  return turned(whole, -psi);
}

double square(double x) { return x * x; }

/// Standard deviations of these variances: that of the rate, and three of the acceleration.
Wheels deviations(double rate, double acceleration) {
  return Wheels(rate, acceleration, acceleration, acceleration).sqrt();
}

}  // namespace

Imu::Imu(const ImuSettings& settings, const FloorParameters& floor, double t, const State& state)
    : settings_(settings),
      upwards_(turned({floor.g * sine_and_cosine(floor.slope).sine, 0, floor.g * sine_and_cosine(floor.slope).cosine},
                      floor.uphill)),
      start_(t),
      t_(t),
      psi_(state.psi()),
      velocity_(velocity_of(state, settings.position)),
      biases_(settings.rate.bias, settings.acceleration.bias, settings.acceleration.bias, settings.acceleration.bias),
      rate_(state.Omega()),
      specific_(reading({0, 0}, upwards_, psi_)) {}

void Imu::update(double t, const State& state) {
  const double passed = t - t_;
  if (!(passed > 0)) return;
  const SensorErrors &rate = settings_.rate, &acceleration = settings_.acceleration;
  const Wheels errors =
      biases_ + deviations(rate.noise_variance(passed), acceleration.noise_variance(passed)) * normal_noise(random_);
  const Eigen::Vector2d velocity = velocity_of(state, settings_.position);
  rate_ = (state.psi() - psi_) / passed + errors[0];
  // At the end's heading, the mean over a curve would lean backwards.
  specific_ = reading((velocity - velocity_) / passed, upwards_, 0.5 * (psi_ + state.psi()));
  specific_ += errors.tail<3>().matrix();
  heading_ += rate_ * passed;
  noise_variance_ += rate.noise_variance(passed) * square(passed);
  if (rate.walk + acceleration.walk > 0) {
    biases_ += deviations(square(rate.walk) * passed, square(acceleration.walk) * passed) * normal_noise(random_);
  }
  t_ = t;
  interval_ = passed;
  psi_ = state.psi();
  velocity_ = velocity;
}

void Imu::carry(const State& before, const State& after) {
  const double turn = after.psi() - before.psi();
  const Eigen::Vector2d gained = velocity_of(before, settings_.position) - velocity_;
  psi_ += turn;
  velocity_ = velocity_of(after, settings_.position) - turned({gained[0], gained[1], 0}, turn).head<2>();
}

double Imu::variance(const SensorErrors& errors) const {
  return errors.noise_variance(interval_) + errors.bias_variance(t_ - start_);
}

double Imu::heading_variance() const {
  const double passed = t_ - start_, walk = settings_.rate.walk;
  return noise_variance_ + square(settings_.rate.bias * passed) + square(walk) * passed * square(passed) / 3;
}

}  // namespace youbot_base_sim
