#include "youbot_base_sim/loop/slip_odometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

namespace {

constexpr double kMemory = 1;           // s, over which efforts are compared, and doubtful speeds keep their direction
constexpr double kInconsistent = 0.05;  // m/s of the rims that no motion of the base explains
constexpr double kShareInconsistent = 0.3;  // and of the largest
constexpr double kMinInterval = 1e-3;       // s: of less, stamps are not exact enough for a rate
constexpr double kMaxSimulated = 2;         // s, of one reading: after a longer way the base is taken to roll

/// The rates at the end of an interval (s) of mean rates `now`, where the one before has `before`, the next `next`:
/// weighted essentially non-oscillatory, so that a command that jumps does not show before it comes (Liu, Osher and
/// Chan 1994).
Wheels end_rates(const Wheels& before, double length_before, const Wheels& now, double length, const Wheels& next,
                 double length_next) {
  constexpr double kSmooth = 0.1;  // rad^2/s^2: smaller changes are smooth, or of ticks
  const Wheels extrapolated = now + (now - before) * (length / (length_before + length));
  const Wheels between = (length_next * now + length * next) / (length + length_next);
  const Wheels past_weight = 1 / (kSmooth + (now - before).square()).square();
  const Wheels next_weight = 2 / (kSmooth + (next - now).square()).square();
  return (past_weight * extrapolated + next_weight * between) / (past_weight + next_weight);
}

/// The pose after a displacement (m, m, rad) that begins at `pose`, in the frame of the base there.
Eigen::Vector3d moved_on(const Eigen::Vector3d& pose, const Eigen::Vector3d& displacement) {
  return pose + turned(displacement, pose[2]);
}

Eigen::Vector3d pose_of(const State& x) { return {x.x(), x.y(), x.psi()}; }

/// Covariance of one more like the columns, less their mean; zero of a single one.
Eigen::Matrix3d spread(const Eigen::Matrix3Xd& values) {
  const auto n = static_cast<double>(values.cols());
  if (n < 2) return Eigen::Matrix3d::Zero();
  const Eigen::Matrix3Xd off = values.colwise() - values.rowwise().mean();
  return (n + 1) / (n * (n - 1)) * off * off.transpose();
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

/// One simulation of the base, whose wheels stand at encoders' readings plus `phase`.
class SlipOdometry::Replica {
 public:
  Replica(const Scene& scene, const Wheels& phase)
      : scene_(scene), phase_(phase), segment_(std::make_shared<Segment>()) {
    scene_.drive = std::shared_ptr<const WheelMotion>(segment_);
    scene_.solver.control_period = 0;
    scene_.load_schedule = {};
  }

  bool runs() const { return simulation_ != nullptr; }
  void stop() { simulation_.reset(); }

  /// Begins where encoders read `phi` (rad), with wheels and base that roll at the rates `dphi` (rad/s).
  void begin(const Wheels& phi, const Wheels& dphi) {
    scene_.initial = State();
    scene_.initial.phi() = phi + phase_;
    const DriverKinematics rolling{scene_.robot.R, scene_.robot.h + scene_.robot.l};
    scene_.initial.values.col(1).head<3>() = rolling.velocity(dphi).array();
    NoSlipModel(scene_.robot).constrain(scene_.initial);
    scene_.initial.dphi() = dphi;
    segment_->follow(0, 1, scene_.initial, dphi, dphi);
    simulation_ = std::make_unique<Simulation>(scene_);
  }

  /// Turns the wheels by `moved` (rad) to rates of `end_dphi` (rad/s) within `length` (s). Returns how far the base
  /// goes, in its frame (m, m, rad). Throws std::domain_error.
  Eigen::Vector3d follow(const Wheels& moved, const Wheels& end_dphi, double length) {
    const Eigen::Vector3d before = pose_of(simulation_->state());
    const double from = simulation_->time();
    segment_->follow(from, length, simulation_->state(), moved, end_dphi);
    simulation_->advance_to(from + length);
    if (!simulation_->state().values.allFinite()) throw std::domain_error("the state is not finite");
    simulation_->take_switches();
    const Eigen::Vector3d way = pose_of(simulation_->state()) - before;
    return turned(way, -before[2]);
  }

  Eigen::Vector3d velocity() const {
    return runs() ? simulation_->state().velocity() : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  Wheels torque() const { return runs() ? simulation_->torque() : Wheels(Wheels::Zero()); }

  /// Where it alone would have gone.
  Eigen::Vector3d pose() const { return pose_; }
  void move(const Eigen::Vector3d& displacement) { pose_ = moved_on(pose_, displacement); }
  void reset() { pose_.setZero(); }

 private:
  Scene scene_;
  Wheels phase_;
  std::shared_ptr<Segment> segment_;
  std::unique_ptr<Simulation> simulation_;  // null until it begins
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();
};

SlipOdometry::SlipOdometry(const Scene& scene, const Settings& settings)
    : settings_(settings),
      kinematics_{scene.robot.R, scene.robot.h + scene.robot.l},
      uncertainty_(kinematics_, Wheels::Zero(), settings.wheel_error) {
  if (!slips(scene.model)) throw std::invalid_argument("model no_slip has no slip: plain odometry is the same");
  const int count = settings.angles_at_zero || scene.robot.averaged_contacts ? 1 : std::max(1, settings.replicas);
  for (int k = 0; k < count; ++k) {
    const Wheels phase = settings.angles_at_zero.value_or(spread_angles(k, scene.robot.rollers));
    replicas_.push_back(std::make_unique<Replica>(scene, phase));
  }
}

SlipOdometry::~SlipOdometry() = default;

void SlipOdometry::update(double t, const Wheels& phi, const std::optional<Wheels>& torque,
                          const std::optional<Wheels>& dphi) {
  doubt_.clear();
  doubtful_speed_ = 0;
  if (!phi.allFinite() || !std::isfinite(t)) return doubt("a reading is not finite", 0, 0);
  if (!last_ || t < last_->t) return begin(t, phi);
  const double dt = t - last_->t;
  if (dt < kMinInterval) return;
  const Wheels moved = checked(phi - last_->phi, dt);
  last_ = {t, phi};
  Interval interval = interval_of(moved, dt);
  if (doubt_.empty()) {  // neither a gap nor a jump
    if (torque && torque->allFinite()) interval.torque = torque;
    if (dphi && (dphi->abs() <= settings_.max_rate).all()) interval.dphi = dphi;
  }
  if (latest_) simulate(*latest_, end_rate_before(interval));
  before_ = latest_.value_or(interval);
  latest_ = interval;
  uncertainty_.update(followed_ + moved);
  check_wheels();
}

/// Begins with a first reading, at the present pose.
void SlipOdometry::begin(double t, const Wheels& phi) {
  if (last_) doubt("the time has gone back: what lies between is lost", 0, 0);
  pose_ = pose();
  for (const auto& replica : replicas_) replica->stop();
  uncertainty_.carry(phi - (latest_ ? Wheels(followed_ + latest_->moved) : followed_));
  last_ = {t, phi};
  latest_.reset();
  followed_ = phi;
}

/// The path of the wheels, but of an encoder that has jumped, at its rate before.
Wheels SlipOdometry::checked(const Wheels& moved, double dt) {
  const Wheels rate = latest_ ? latest_->rate : Wheels(Wheels::Zero());
  const WheelMask jumped = moved.abs() > settings_.max_rate * dt;
  if (!jumped.any()) return moved;
  std::string names;
  for (int i = 0; i < kWheels; ++i) {
    if (jumped[i]) names += fmt::format("{}{} by {:.3g} rad", names.empty() ? "" : ", ", kWheelNames[i], moved[i]);
  }
  doubt("an encoder has jumped: " + names, fastest(rate), dt);
  return jumped.select(rate * dt, moved);
}

/// What lies between two readings. Over a gap the wheels turn faster, but no faster than they can.
SlipOdometry::Interval SlipOdometry::interval_of(const Wheels& moved, double dt) {
  if (dt > settings_.max_gap)
    doubt(fmt::format("no reading for {:.3g} s", dt), fastest(moved / dt), std::min(dt, kMemory));
  const double shortest = moved.abs().maxCoeff() / settings_.max_rate;
  const double length = std::min(dt, std::max(settings_.max_gap, shortest));
  return {moved, moved / length, length, {}, {}};
}

/// The rates at the end of the latest interval: those read there, where they fit the angles.
Wheels SlipOdometry::end_rate_before(const Interval& next) {
  const Interval& now = *latest_;
  const Wheels by_angles = end_rates(before_.rate, before_.length, now.rate, now.length, next.rate, next.length);
  if (!now.dphi) return by_angles;
  rate_product_ += now.length * by_angles * *now.dphi;
  rate_square_ += now.length * by_angles.square();
  const Wheels sign = rate_signs();
  return (sign == 0).select(by_angles, sign * *now.dphi);
}

Wheels SlipOdometry::rate_signs() const {
  constexpr double kEnough = 1, kMaxOff = 0.1;  // rad^2/s
  const Wheels ratio = (rate_square_ > kEnough).select(rate_product_ / rate_square_.max(kEnough), 0);
  return ((ratio.abs() - 1).abs() < kMaxOff).select(ratio.sign(), 0);
}

/// Follows the wheels through an interval, with these rates at its end.
void SlipOdometry::simulate(const Interval& interval, const Wheels& end_rate) {
  for (const auto& replica : replicas_) {
    if (!replica->runs()) replica->begin(followed_, interval.rate);
  }
  const Eigen::Vector3d displacement = mean_displacement(interval, end_rate);
  pose_ = moved_on(pose_, displacement);
  slip_ = (displacement - kinematics_.velocity(interval.moved)) / interval.length;
  followed_ += interval.moved;
  if (interval.torque) check_torque(interval);
}

/// Of all replicas. One whose motion ends, and all after a way too long to simulate, go as wheels roll.
Eigen::Vector3d SlipOdometry::mean_displacement(const Interval& interval, const Wheels& end_rate) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& replica : replicas_) {
    Eigen::Vector3d displacement = kinematics_.velocity(interval.moved);
    try {
      if (interval.length > kMaxSimulated)
        throw std::domain_error("the wheels have turned too far since the last reading");
      displacement = replica->follow(interval.moved, end_rate, interval.length);
    } catch (const std::domain_error& error) {
      replica->stop();
      doubt(fmt::format("the simulation begins anew: {}", error.what()), fastest(interval.rate), interval.length);
    }
    replica->move(displacement);
    sum += displacement;
  }
  return sum / static_cast<double>(replicas_.size());
}

/// Four wheels have one rate more than the base has velocities.
void SlipOdometry::check_wheels() {
  const Wheels& rate = latest_->rate;
  const double against = 0.25 * kinematics_.wheel_radius * std::abs(rate[0] + rate[1] - rate[2] - rate[3]);
  if (against < kInconsistent || against < kShareInconsistent * fastest(rate)) return;
  doubt(fmt::format("front and rear wheels turn against each other by {:.3g} m/s: some slip, or are off the floor",
                    against),
        against, latest_->length);
}

/// By how long they agree with the signs of expected torques.
void SlipOdometry::learn_effort_signs(const Wheels& torque, const Wheels& expected, double dt) {
  constexpr double kLarge = 0.1, kEnough = 1, kMinShare = 0.6;  // N m, s
  effort_agreement_ += (expected.abs() > kLarge).select(dt * torque.sign() * expected.sign(), 0);
  effort_time_ += (expected.abs() > kLarge).select(Wheels::Constant(dt), 0);
  for (int i = 0; i < kWheels; ++i) {
    const bool known = effort_time_[i] > kEnough && std::abs(effort_agreement_[i]) > kMinShare * effort_time_[i];
    if (effort_sign_[i] == 0 && known) effort_sign_[i] = effort_agreement_[i] > 0 ? 1 : -1;
  }
}

void SlipOdometry::check_torque(const Interval& interval) {
  if (!std::isfinite(settings_.max_effort_error)) return;
  Wheels expected = Wheels::Zero();
  for (const auto& replica : replicas_) expected += replica->torque() / static_cast<double>(replicas_.size());
  learn_effort_signs(*interval.torque, expected, interval.length);
  // Of the mean: at roller switches and jerks of the encoders single torques differ by more.
  const Wheels off = (effort_sign_ == 0).select(0, effort_sign_ * *interval.torque - expected);
  effort_error_ += std::min(1.0, interval.length / kMemory) * (off - effort_error_);
  const double error = 0.25 * sum(effort_error_.abs());
  if (error <= settings_.max_effort_error) return;
  doubt(
      fmt::format("efforts are {:.3g} N m off what this motion takes: wheels are off the floor, or the base is pushed",
                  error),
      fastest(interval.rate), interval.length);
}

/// Notes the reason, and that the base may be faster or slower by `speed` (m/s) for `dt` (s).
void SlipOdometry::doubt(const std::string& reason, double speed, double dt) {
  if (doubt_.empty()) doubt_ = reason;
  doubtful_speed_ = std::max(doubtful_speed_, speed);
  doubtful_variance_ += speed * speed * dt * kMemory;
}

void SlipOdometry::reset() {
  const Eigen::Vector3d ahead = latest_displacement();
  pose_ = -turned(ahead, -ahead[2]);
  for (const auto& replica : replicas_) replica->reset();
  uncertainty_.reset(latest_ ? Wheels(followed_ + latest_->moved) : followed_);
  doubtful_variance_ = 0;
}

/// Since the reading before the last, whose interval waits to be simulated: as wheels roll, and slip as before.
Eigen::Vector3d SlipOdometry::latest_displacement() const {
  if (!latest_) return Eigen::Vector3d::Zero();
  return kinematics_.velocity(latest_->moved) + latest_->length * slip_;
}

Eigen::Vector3d SlipOdometry::pose() const { return moved_on(pose_, latest_displacement()); }

Eigen::Vector3d SlipOdometry::velocity() const {
  return latest_ ? Eigen::Vector3d(kinematics_.velocity(latest_->rate) + slip_) : Eigen::Vector3d::Zero();
}

Eigen::Matrix3d SlipOdometry::pose_covariance() const {
  return uncertainty_.pose_covariance() + spread(values(&Replica::pose)) + of_speeds(doubtful_variance_);
}

Eigen::Matrix3d SlipOdometry::velocity_covariance() const {
  const Wheels rate = latest_ ? latest_->rate : Wheels(Wheels::Zero());
  return uncertainty_.velocity_covariance(rate) + spread(values(&Replica::velocity)) +
         of_speeds(doubtful_speed_ * doubtful_speed_);
}

/// Of the rims, m/s.
double SlipOdometry::fastest(const Wheels& rate) const { return kinematics_.wheel_radius * rate.abs().maxCoeff(); }

/// A column for each replica.
Eigen::Matrix3Xd SlipOdometry::values(Eigen::Vector3d (Replica::*value)() const) const {
  Eigen::Matrix3Xd values(3, replicas_.size());
  for (std::size_t k = 0; k < replicas_.size(); ++k) {
    values.col(static_cast<Eigen::Index>(k)) = (replicas_[k].get()->*value)();
  }
  return values;
}

/// Of doubtful variances of X and Y (m^2 or m^2/s^2) and, by them, of yaw.
Eigen::Matrix3d SlipOdometry::of_speeds(double variance) const {
  const double arm = kinematics_.half_lengths;
  return (variance * Eigen::Vector3d(1, 1, 1 / (arm * arm))).asDiagonal();
}

}  // namespace youbot_base_sim
