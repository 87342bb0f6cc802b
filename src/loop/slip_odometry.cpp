#include "youbot_base_sim/loop/slip_odometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

constexpr double kMemory = 1;           // s, over which efforts are compared, and doubtful speeds keep their direction
constexpr double kInconsistent = 0.05;  // m/s of the rims that no motion of the base explains
constexpr double kShareInconsistent = 0.3;  // and of the largest

/// The rate at the end of an interval of mean rate `now` after an equal one of `before`: a parabola's, but never beyond
/// what keeps the cubic monotonous (Fritsch and Carlson 1980).
double end_rate(double before, double now) {
  const double rate = now + 0.5 * (now - before);
  return rate * now <= 0 ? 0 : std::clamp(rate, -2 * std::abs(now), 2 * std::abs(now));
}

Eigen::Vector3d pose_in(const Eigen::Vector3d& origin, const State& x) {
  const Eigen::Vector3d moved = turned({x.x(), x.y(), 0}, origin[2]);
  return {origin[0] + moved[0], origin[1] + moved[1], origin[2] + x.psi()};
}

}  // namespace

/// The wheels between two readings: cubics from where they are to where they were read.
class SlipOdometry::Segment : public WheelMotion {
 public:
  /// Turns the wheels of x at time t (s) by `moved` (rad) to rates of `end_dphi` (rad/s) after `length` (s).
  void follow(double t, double length, const State& x, const Wheels& moved, const Wheels& end_dphi) {
    start_ = t;
    length_ = length;
    phi_ = x.phi();
    dphi_ = x.dphi();
    moved_ = moved;
    end_dphi_ = end_dphi;
  }

  Wheels angle(double t) const override {
    const double s = (t - start_) / length_;
    return phi_ + s * (length_ * dphi_ + s * (quadratic() + s * cubic()));
  }
  Wheels rate(double t) const override {
    const double s = (t - start_) / length_;
    return dphi_ + s / length_ * (2 * quadratic() + 3 * s * cubic());
  }
  Wheels acceleration(double t) const override {
    const double s = (t - start_) / length_;
    return (2 * quadratic() + 6 * s * cubic()) / (length_ * length_);
  }

 private:
  Wheels quadratic() const { return 3 * moved_ - length_ * (2 * dphi_ + end_dphi_); }
  Wheels cubic() const { return length_ * (dphi_ + end_dphi_) - 2 * moved_; }

  double start_ = 0, length_ = 1;  // s
  Wheels phi_ = Wheels::Zero(), dphi_ = Wheels::Zero(), moved_ = Wheels::Zero(), end_dphi_ = Wheels::Zero();
};

SlipOdometry::SlipOdometry(const Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      segment_(std::make_shared<Segment>()),
      uncertainty_({scene.robot.R, scene.robot.h + scene.robot.l}, Wheels::Zero(), settings.wheel_error) {
  if (!slips(scene.model)) throw std::invalid_argument("model no_slip has no slip: plain odometry is the same");
  scene_.drive = std::shared_ptr<const WheelMotion>(segment_);
  scene_.solver.control_period = 0;
  scene_.load_schedule = {};
  scene_.robot.averaged_contacts = settings.averaged_contacts;
}

/// Begins a simulation at the present pose with wheels and base that roll.
void SlipOdometry::begin() {
  scene_.initial = State();
  scene_.initial.phi() = last_->phi;
  const DriverKinematics rolling{scene_.robot.R, scene_.robot.h + scene_.robot.l};
  scene_.initial.values.col(1).head<3>() = rolling.velocity(rate_).array();
  NoSlipModel(scene_.robot).constrain(scene_.initial);
  scene_.initial.dphi() = rate_;
  segment_->follow(0, 1, scene_.initial, rate_, rate_);
  simulation_ = std::make_unique<Simulation>(scene_);
}

/// Ends it where it is.
void SlipOdometry::leave() {
  origin_ = pose();
  simulation_.reset();
}

void SlipOdometry::update(double t, const Wheels& phi, const std::optional<Wheels>& torque) {
  doubt_.clear();
  doubtful_speed_ = 0;
  if (!phi.allFinite() || !std::isfinite(t)) return doubt("a reading is not finite", 0, 0);
  const Reading before = last_.value_or(Reading{t, phi});
  const double dt = t - before.t;
  if (dt < 0) {
    leave();
    doubt("the time has gone back: what lies between is lost", 0, 0);
  }
  last_ = {t, phi};
  if (!(dt > 0)) return;
  const Wheels moved = checked(phi - before.phi, dt);
  advance(moved, dt);
  check_wheels(dt);
  if (torque && torque->allFinite() && dt <= settings_.max_gap) check_torque(*torque, dt);
}

/// The path of the wheels, but of an encoder that has jumped, at its rate before.
Wheels SlipOdometry::checked(const Wheels& moved, double dt) {
  const WheelMask jumped = moved.abs() > settings_.max_rate * dt;
  if (!jumped.any()) return moved;
  std::string names;
  for (int i = 0; i < kWheels; ++i) {
    if (jumped[i]) names += fmt::format("{}{} by {:.3g} rad", names.empty() ? "" : ", ", kWheelNames[i], moved[i]);
  }
  doubt("an encoder has jumped: " + names, scene_.robot.R * rate_.abs().maxCoeff(), dt);
  return jumped.select(rate_ * dt, moved);
}

void SlipOdometry::advance(const Wheels& moved, double dt) {
  const Wheels rate = moved / dt;
  if (dt > settings_.max_gap) {
    doubt(fmt::format("no reading for {:.3g} s", dt), scene_.robot.R * rate.abs().maxCoeff(), std::min(dt, kMemory));
  }
  // Over a gap the wheels turn faster, but no faster than they can.
  const double shortest = moved.abs().maxCoeff() / settings_.max_rate;
  const double length = std::min(dt, std::max(settings_.max_gap, shortest));
  const Wheels mean = moved / length;
  Wheels end;
  for (int i = 0; i < kWheels; ++i) end[i] = dt > settings_.max_gap ? mean[i] : end_rate(rate_[i], rate[i]);
  if (!simulation_) {
    rate_ = mean;
    begin();
  }
  const double from = simulation_->time();
  segment_->follow(from, length, simulation_->state(), moved, end);
  try {
    simulation_->advance_to(from + length);
    if (!simulation_->state().values.allFinite()) throw std::domain_error("the state is not finite");
  } catch (const std::domain_error& error) {
    leave();
    doubt(fmt::format("the simulation begins anew: {}", error.what()), scene_.robot.R * rate.abs().maxCoeff(), dt);
    return;
  }
  simulation_->take_switches();
  rate_ = rate;
  uncertainty_.update(followed_ += moved);
}

/// Four wheels have one rate more than the base has velocities.
void SlipOdometry::check_wheels(double dt) {
  const double against = 0.25 * scene_.robot.R * std::abs(rate_[0] + rate_[1] - rate_[2] - rate_[3]);
  if (against < kInconsistent || against < kShareInconsistent * scene_.robot.R * rate_.abs().maxCoeff()) return;
  doubt(fmt::format("front and rear wheels turn against each other by {:.3g} m/s: some slip, or are off the floor",
                    against),
        against, dt);
}

void SlipOdometry::check_torque(const Wheels& torque, double dt) {
  if (!simulation_ || !std::isfinite(settings_.max_effort_error)) return;
  // Of the mean: at roller switches and jerks of the encoders single torques differ by more.
  effort_error_ += std::min(1.0, dt / kMemory) * (torque - simulation_->torque() - effort_error_);
  const double error = 0.25 * sum(effort_error_.abs());
  if (error <= settings_.max_effort_error) return;
  doubt(
      fmt::format("efforts are {:.3g} N m off what this motion takes: wheels are off the floor, or the base is pushed",
                  error),
      scene_.robot.R * rate_.abs().maxCoeff(), dt);
}

/// Notes the reason, and that the base may be faster or slower by `speed` (m/s) for `dt` (s).
void SlipOdometry::doubt(const std::string& reason, double speed, double dt) {
  if (doubt_.empty()) doubt_ = reason;
  doubtful_speed_ = std::max(doubtful_speed_, speed);
  doubtful_variance_ += speed * speed * dt * kMemory;
}

void SlipOdometry::reset() {
  if (simulation_) begin();
  origin_.setZero();
  uncertainty_.reset(followed_);
  doubtful_variance_ = 0;
}

Eigen::Vector3d SlipOdometry::pose() const { return simulation_ ? pose_in(origin_, simulation_->state()) : origin_; }

Eigen::Vector3d SlipOdometry::velocity() const {
  return simulation_ ? simulation_->state().velocity() : Eigen::Vector3d::Zero();
}

Eigen::Matrix3d SlipOdometry::pose_covariance() const {
  const double arm = scene_.robot.h + scene_.robot.l;
  Eigen::Matrix3d covariance = uncertainty_.pose_covariance();
  covariance.diagonal() += doubtful_variance_ * Eigen::Vector3d(1, 1, 1 / (arm * arm));
  return covariance;
}

Eigen::Matrix3d SlipOdometry::velocity_covariance() const {
  const double arm = scene_.robot.h + scene_.robot.l;
  Eigen::Matrix3d covariance = uncertainty_.velocity_covariance(rate_);
  covariance.diagonal() += doubtful_speed_ * doubtful_speed_ * Eigen::Vector3d(1, 1, 1 / (arm * arm));
  return covariance;
}

}  // namespace youbot_base_sim
