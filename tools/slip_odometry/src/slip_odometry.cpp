#include "youbot_base_sim/slip_odometry/slip_odometry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/slip_odometry/replay.h"
#include "youbot_base_sim/slip_odometry/wheel_cubic.h"

namespace youbot_base_sim {

namespace {

constexpr double kMemory = 1;           // s, over which efforts are compared, and doubtful speeds keep their direction
constexpr double kInconsistent = 0.05;  // m/s of the rims that no motion of the base explains
constexpr double kShareInconsistent = 0.3;  // and of the largest
constexpr double kMinInterval = 1e-3;       // s: of less, stamps are not exact enough for a rate
// Of a wheel's path, where no fit tells: a base that none was made for, and one whose angles one has found.
constexpr double kGuessedError = 0.012, kFittedError = 0.005;
constexpr double kMaxSimulated = 2;  // s, of one reading: after a longer way the base is taken to roll

/// The rates at the end of an interval (s) of mean rates `now`, between `before` and `next`: weighted essentially
/// non-oscillatory, so that a command's jump does not show before it comes (Liu, Osher and Chan 1994).
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

/// One simulation of the base, whose wheels stand at encoders' readings plus `phase`.
class SlipOdometry::Replica {
 public:
  Replica(const Scene& scene, const Wheels& phase, bool softly) : scene_(scene), phase_(phase), softly_(softly) {}

  bool runs() const { return replay_ != nullptr; }
  void stop() { replay_.reset(); }
  void set_phase(const Wheels& phase) {
    stop();
    phase_ = phase;
  }

  /// Begins where encoders read `phi` (rad), with wheels and base that roll at the rates `dphi` (rad/s).
  void begin(const Wheels& phi, const Wheels& dphi) {
    *cubic_ = {};
    cubic_->phi = phi;
    cubic_->dphi = cubic_->moved = cubic_->end_dphi = dphi;
    replay_ = std::make_unique<Replay>(scene_, cubic_, phase_, softly_);
    cubic_->moved.setZero();
  }

  /// Turns the wheels by `moved` (rad) to rates of `end_dphi` (rad/s) within `length` (s). Returns how far the base
  /// goes, in its frame (m, m, rad). Throws std::domain_error.
  Eigen::Vector3d follow(const Wheels& moved, const Wheels& end_dphi, double length) {
    const Eigen::Vector3d before = pose_of(replay_->simulation().state());
    const double from = replay_->simulation().time();
    cubic_->phi += cubic_->moved;
    cubic_->dphi = cubic_->end_dphi;
    cubic_->start = from;
    cubic_->length = length;
    cubic_->moved = moved;
    cubic_->end_dphi = end_dphi;
    replay_->advance_to(from + length);
    if (!replay_->simulation().state().values.allFinite()) throw std::domain_error("the state is not finite");
    replay_->drop_switches();
    const Eigen::Vector3d way = pose_of(replay_->simulation().state()) - before;
    return turned(way, -before[2]);
  }

  Eigen::Vector3d velocity() const {
    return runs() ? replay_->simulation().state().velocity() : Eigen::Vector3d(Eigen::Vector3d::Zero());
  }
  Wheels torque() const { return runs() ? replay_->simulation().torque() : Wheels(Wheels::Zero()); }

  /// The pose to which it alone would have gone.
  Eigen::Vector3d pose() const { return pose_; }
  void move(const Eigen::Vector3d& displacement) { pose_ = moved_on(pose_, displacement); }
  void reset() { pose_.setZero(); }

 private:
  const Scene& scene_;
  Wheels phase_;
  bool softly_;
  std::shared_ptr<WheelCubic> cubic_ = std::make_shared<WheelCubic>();
  std::unique_ptr<Replay> replay_;  // null until it begins
  Eigen::Vector3d pose_ = Eigen::Vector3d::Zero();
};

SlipOdometry::SlipOdometry(const Scene& scene, const Settings& settings)
    : scene_(scene),
      settings_(settings),
      kinematics_(DriverKinematics::of(scene.robot)),
      uncertainty_(kinematics_, Wheels::Zero(),
                   settings.wheel_error.value_or(settings.angles_at_zero ? kFittedError : kGuessedError)) {
  if (!slips(scene.model)) throw std::invalid_argument("model no_slip has no slip: plain odometry is the same");
}

/// One of known phases; the candidates of those that efforts may tell; some of others, whose wheels follow softly.
void SlipOdometry::make_replicas(bool known, bool efforts) {
  const int rollers = scene_.robot.rollers;
  if (efforts) search_.emplace(rollers);
  replicas_.clear();
  simulated_ = known ? 1 : efforts ? PhaseSearch::kCandidates : std::max(1, settings_.replicas);
  for (int k = 0; k < simulated_; ++k) {
    const Wheels phase = efforts ? search_->phases(k) : settings_.angles_at_zero.value_or(spread_angles(k, rollers));
    replicas_.push_back(std::make_unique<Replica>(scene_, phase, !known && !efforts));
  }
}

/// Begins replicas anew where the search has them now: one, once the phases are found.
void SlipOdometry::set_phases() {
  simulated_ = search_->found() ? 1 : PhaseSearch::kCandidates;
  for (int k = 0; k < PhaseSearch::kCandidates; ++k) replicas_[k]->set_phase(search_->phases(k));
}

SlipOdometry::~SlipOdometry() = default;

void SlipOdometry::update(double t, const Wheels& phi, const std::optional<Wheels>& torque,
                          const std::optional<Wheels>& dphi) {
  doubt_.clear();
  doubtful_speed_ = 0;
  if (!phi.allFinite() || !std::isfinite(t)) return doubt("a reading is not finite", 0, 0);
  if (!last_ || t < last_->t) return begin(t, phi);
  const double dt = t - last_->t;
  if (dt < kMinInterval) return check_time(phi - last_->phi);
  const Wheels moved = checked(phi - last_->phi, dt);
  last_ = {t, phi};
  doubtful_way_ *= std::exp(-dt / kMemory);
  Interval interval = interval_of(moved, dt);
  if (doubt_.empty()) {  // neither a gap nor a jump
    if (torque && torque->allFinite()) interval.torque = torque;
    if (dphi && dphi->allFinite()) interval.dphi = dphi;
  }
  if (latest_) simulate(*latest_, end_rate_before(interval));
  before_ = latest_.value_or(interval);
  latest_ = interval;
  uncertainty_.update(followed_ + moved);
  check_wheels();
}

/// Wheels that turn further than they can since the last reading show stamps that stand still.
void SlipOdometry::check_time(const Wheels& moved) {
  const double angle = moved.abs().maxCoeff();
  if (angle <= settings_.max_rate * kMinInterval) return;
  doubt(fmt::format("the time of readings stands still while wheels turn by {:.3g} rad", angle),
        fastest(moved / kMemory), kMinInterval);
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
  const Wheels corrected = jumped.select(rate * dt, moved);
  if (search_) {  // for what it reads zero now
    followed_ += moved - corrected;
    uncertainty_.carry(moved - corrected);
    search_.emplace(scene_.robot.rollers);
    set_phases();
  }
  return corrected;
}

/// The motion between two readings. Over a gap the wheels turn faster, but no faster than they can.
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
  dphi_square_ += now.length * now.dphi->square();
  const Wheels factor = rate_factors();
  const Wheels rate = (factor == 0).select(by_angles, *now.dphi / factor);
  return (rate.abs() <= settings_.max_rate).all() ? rate : by_angles;
}

Wheels SlipOdometry::rate_factors() const {
  constexpr double kEnough = 1, kMinFit = 0.8, kMaxApart = 0.05;  // rad^2/s; squared correlation; of one wheel's
  const Wheels fits = rate_product_.square() / (rate_square_ * dphi_square_).max(1e-300);
  Wheels factor = (rate_square_ > kEnough && fits > kMinFit).select(rate_product_ / rate_square_.max(kEnough), 0);
  factor = ((factor.abs() - 1).abs() < kMaxApart).select(factor.sign(), factor);
  return ((factor.abs() / factor.abs().maxCoeff() - 1).abs() < kMaxApart).select(factor, 0);
}

/// Follows the wheels through an interval, with these rates at its end.
void SlipOdometry::simulate(const Interval& interval, const Wheels& end_rate) {
  const bool known = settings_.angles_at_zero || scene_.robot.averaged_contacts;
  const bool efforts = !known && interval.torque && (*interval.torque != 0).any();
  if (replicas_.empty() || (efforts && !search_)) make_replicas(known, efforts);
  const Eigen::Vector3d displacement = mean_displacement(interval, end_rate);
  pose_ = moved_on(pose_, displacement);
  slip_ = (displacement - kinematics_.velocity(interval.moved)) / interval.length;
  followed_ += interval.moved;
  if (interval.torque) take_torque(*interval.torque, interval);
}

/// Poses of simulated replicas. One whose motion ends, and all after a way too long to simulate, go as wheels roll.
Eigen::Vector3d SlipOdometry::mean_displacement(const Interval& interval, const Wheels& end_rate) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (int k = 0; k < simulated_; ++k) {
    Replica& replica = *replicas_[k];
    Eigen::Vector3d displacement = kinematics_.velocity(interval.moved);
    try {
      if (!replica.runs()) replica.begin(followed_, interval.rate);
      if (interval.length > kMaxSimulated)
        throw std::domain_error("the wheels have turned too far since the last reading");
      displacement = replica.follow(interval.moved, end_rate, interval.length);
    } catch (const std::domain_error& error) {
      replica.stop();
      doubt(fmt::format("the simulation begins anew: {}", error.what()), fastest(interval.rate), interval.length);
    }
    replica.move(displacement);
    mean += displacement / simulated_;
  }
  for (std::size_t k = simulated_; k < replicas_.size(); ++k) replicas_[k]->move(mean);
  return mean;
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

/// Judges signs by how long they agree with those of expected torques.
void SlipOdometry::learn_effort_signs(const Wheels& torque, const Wheels& expected, double dt) {
  constexpr double kLarge = 0.1, kEnough = 1, kMinShare = 0.6;  // N m, s
  effort_agreement_ += (expected.abs() > kLarge).select(dt * torque.sign() * expected.sign(), 0);
  effort_time_ += (expected.abs() > kLarge).select(Wheels::Constant(dt), 0);
  for (int i = 0; i < kWheels; ++i) {
    const bool known = effort_time_[i] > kEnough && std::abs(effort_agreement_[i]) > kMinShare * effort_time_[i];
    if (effort_sign_[i] == 0 && known) effort_sign_[i] = effort_agreement_[i] > 0 ? 1 : -1;
  }
}

void SlipOdometry::take_torque(const Wheels& torque, const Interval& interval) {
  PhaseSearch::Torques torques;
  Wheels expected = Wheels::Zero();
  for (int k = 0; k < simulated_; ++k) {
    const Wheels of_replica = replicas_[k]->torque();
    expected += of_replica / simulated_;
    if (search_) torques[k] = of_replica;
  }
  learn_effort_signs(torque, expected, interval.length);
  check_torque(effort_sign_ * torque, expected, interval);
  if (!search_ || search_->found() || (effort_sign_ == 0).any() || (interval.rate == 0).all()) return;
  if (search_->update(effort_sign_ * torque, torques, interval.length)) set_phases();
}

void SlipOdometry::check_torque(const Wheels& torque, const Wheels& expected, const Interval& interval) {
  if (!std::isfinite(settings_.max_effort_error)) return;
  // The mean counts: at roller switches and jerks of the encoders single torques differ by more.
  const Wheels off = (effort_sign_ == 0).select(0, torque - expected);
  effort_error_ += std::min(1.0, interval.length / kMemory) * (off - effort_error_);
  const double error = 0.25 * sum(effort_error_.abs());
  if (error <= settings_.max_effort_error) return;
  doubt(
      fmt::format("efforts are {:.3g} N m off what this motion takes: wheels are off the floor, or the base is pushed",
                  error),
      fastest(interval.rate), interval.length);
}

/// Notes the reason, and that the base may be faster or slower by `speed` (m/s) for `dt` (s): a Gauss-Markov process
/// with time constant kMemory. A short doubt is a step of speed dt, a long one a walk.
void SlipOdometry::doubt(const std::string& reason, double speed, double dt) {
  if (doubt_.empty()) doubt_ = reason;
  doubtful_speed_ = std::max(doubtful_speed_, speed);
  const double way = speed * kMemory * (1 - std::exp(-dt / kMemory));
  doubtful_variance_ += 2 * (doubtful_way_ * way + speed * kMemory * (speed * dt - way));
  doubtful_way_ += way;
}

void SlipOdometry::reset() {
  const Eigen::Vector3d ahead = latest_displacement();
  pose_ = -turned(ahead, -ahead[2]);
  for (const auto& replica : replicas_) replica->reset();
  uncertainty_.reset(latest_ ? Wheels(followed_ + latest_->moved) : followed_);
  doubtful_variance_ = doubtful_way_ = 0;
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
  return uncertainty_.pose_covariance() + spread(values(&Replica::pose, true)) + of_speeds(doubtful_variance_);
}

Eigen::Matrix3d SlipOdometry::velocity_covariance() const {
  const Wheels rate = latest_ ? latest_->rate : Wheels(Wheels::Zero());
  return uncertainty_.velocity_covariance(rate) + spread(values(&Replica::velocity, false)) +
         of_speeds(doubtful_speed_ * doubtful_speed_);
}

double SlipOdometry::fastest(const Wheels& rate) const { return kinematics_.wheel_radius * rate.abs().maxCoeff(); }

/// A column for each replica that is simulated or, of `all`, was.
Eigen::Matrix3Xd SlipOdometry::values(Eigen::Vector3d (Replica::*value)() const, bool all) const {
  Eigen::Matrix3Xd values(3, all ? static_cast<int>(replicas_.size()) : simulated_);
  for (int k = 0; k < values.cols(); ++k) values.col(k) = (replicas_[k].get()->*value)();
  return values;
}

/// Covariances of doubtful X and Y (m^2 or m^2/s^2) and, by them, of yaw.
Eigen::Matrix3d SlipOdometry::of_speeds(double variance) const {
  const double arm = kinematics_.half_lengths;
  return (variance * Eigen::Vector3d(1, 1, 1 / (arm * arm))).asDiagonal();
}

}  // namespace youbot_base_sim
