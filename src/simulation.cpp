#include "youbot_base_sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/drive/wheel_odometry.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/no_slip_integrator.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

namespace {

/// The scene's own drive, sampled at the beginning of each control period.
Simulation::Drive make_drive(const Scene& scene) {
  const std::shared_ptr<TorqueProfile> torque = make_torque_profile(scene);
  const auto* rates = std::get_if<VelocityTable>(&scene.drive);
  // What is commanded at time t, s: torques, N m, or wheel rates, rad/s. Rows and segments that begin up to `rounding`
  // (s) later count as begun.
  const auto command = [torque, table = rates ? rates->table : WheelTable()](double t, double rounding) -> Wheels {
    if (!torque) return table.at(t + rounding);
    torque->begin_segment(t + rounding);
    return torque->value(t);
  };
  if (!rates && !scene.motors) {
    return [command](double t, const State&) { return command(t, ControlTime::rounding(t)); };
  }
  const DriveMode mode = rates ? DriveMode::kVelocity : DriveMode::kTorque;
  const MotorSettings motors = scene.motors.value_or(MotorSettings());
  WheelDrive wheels(scene.solver.control_period, motors.limit(Motor()), motors.gains, motors.quantized.value_or(false));
  return [=](double t, const State& state) mutable {
    const Wheels commanded = command(t - motors.command_delay, ControlTime::rounding(t));
    for (int i = 0; i < kWheels; ++i) wheels.command(i, {mode, commanded[i]});
    return wheels.sample(state.dphi());
  };
}

}  // namespace

Simulation::Simulation(const Scene& scene, Drive drive)
    : scene_(scene), given_drive_(std::move(drive)), control_time_(scene.solver.control_period) {
  if (given_drive_ && !(scene.solver.control_period > 0)) {
    throw std::invalid_argument("a sampled drive needs a control_period > 0");
  }
  reset();
}

void Simulation::reset() {
  local_ = state_ = scene_.initial;
  leave_origin_at(local_.x(), local_.y());
  t_ = 0;
  periods_ = 0;
  in_period_ = false;
  segment_end_ = 0;
  held_ = nullptr;
  if (control_time_.period() > 0) {
    torque_.reset(held_ = new HeldTorque);
    drive_ = given_drive_ ? given_drive_ : make_drive(scene_);
  } else {
    torque_ = make_torque_profile(scene_);
    if (!torque_) torque_ = std::make_unique<HeldTorque>();
    torque_->begin_segment(0);
  }
  prescribed_ = dynamic_cast<const PrescribedWheels*>(torque_.get());
  extended_ = beyond_the_paper(scene_);
  make_integrator(nullptr);
  next_change_ = kInfinity;
  added_ = {};
  planned_ = {};
  load_changes_.clear();
  state_changes_.clear();
  if (!scene_.load_schedule.empty()) change_loads();
  note_loads(0);
  initial_energy_ = kinetic_energy() - state_.work();
}

// Steps add up in local_, from an origin at the base's own place: its rounding does not grow with the scene's distances.
void Simulation::leave_origin_at(double x, double y) {
  origin_ = {x, y};
  local_.x() = local_.y() = 0;
}

void Simulation::show_state() {
  state_ = local_;
  state_.x() += origin_[0];
  state_.y() += origin_[1];
}

void Simulation::make_integrator(const MotionSoFar* before) {
  FloorParameters floor = scene_.floor;
  for (FloorPatch& patch : floor.patches) {
    for (double* x : {&patch.x0, &patch.x1}) *x -= origin_[0];
    for (double* y : {&patch.y0, &patch.y1}) *y -= origin_[1];
  }
  integrator_ = youbot_base_sim::make_integrator(scene_.model, integrated_robot(scene_), floor, local_, *torque_,
                                                 scene_.solver, extended_, before);
  integrator_->constrain(local_, t_);
  show_state();
  if (stop_) integrator_->stop_on(*stop_);
  if (continues_when_tipping_) integrator_->continue_when_tipping();
}

void Simulation::advance_to(double t) {
  if (!(t > t_)) return;
  if (!held_) return advance_continuously(t);
  if (in_period_) advance_within_period(ControlTime::reached(end_of_period(), t) ? end_of_period() : t);
  const std::int64_t whole = control_time_.ended_by(t) - periods_;
  if (!in_period_ && whole > 0) advance_whole_periods(whole);
  if (!ControlTime::reached(t, t_)) advance_within_period(t);
}

void Simulation::advance_periods(std::int64_t n) {
  if (!held_) throw std::logic_error("a simulation without a control_period has no periods to advance by");
  if (in_period_ && n-- > 0) advance_within_period(end_of_period());
  if (n > 0) advance_whole_periods(n);
}

// The torque acts continuously, segment by segment.
void Simulation::advance_continuously(double t) {
  // A WheelMotion may change wherever it is simulated to.
  const bool is_foreseen = !prescribed_;
  while (t_ < t) {
    if (t_ >= next_change_) change_loads();
    const double end = torque_->begin_segment(t_);
    if (end != segment_end_) integrator_->torque_jumped();
    segment_end_ = end;
    const double smooth_end = std::min({end, next_change_, t_ < scene_.duration ? scene_.duration : kInfinity});
    const double next = std::min(smooth_end, t);
    integrator_->advance(local_, t_, next, is_foreseen ? smooth_end : next);
    t_ = next;
    show_state();
  }
}

// n control periods from the beginning of one; those in which loads or wrenches change in parts.
void Simulation::advance_whole_periods(std::int64_t n) {
  while (n > 0) {
    make_due_changes();
    const std::int64_t whole = std::min(control_time_.ended_by(next_change_) - periods_, n);
    whole >= 1 ? run_periods(whole) : advance_within_period(end_of_period());
    n -= std::max<std::int64_t>(whole, 1);
  }
}

// The control loop: odeint's, over n control periods from the beginning of one, sampling the drive at each.
void Simulation::run_periods(std::int64_t n) {
  const std::int64_t first = periods_;
  const auto count = static_cast<std::size_t>(n);
  const auto observer = [&](std::size_t k) {
    periods_ = first + static_cast<std::int64_t>(k);
    t_ = control_time_.begin(periods_);
    show_state();
    if (k < count) sample_drive();
  };
  integrator_->advance_periods(local_, first, control_time_.period(), count, std::ref(observer));
}

// A part of a control period, for callers that read the state between two samples.
void Simulation::advance_within_period(double t) {
  if (!in_period_) {
    make_due_changes();
    sample_drive();
  }
  while (!ControlTime::reached(t, next_change_)) {
    integrator_->advance(local_, t_, next_change_, next_change_);
    t_ = std::max(t_, next_change_);
    show_state();
    change_loads();
  }
  integrator_->advance(local_, t_, t, t);
  t_ = t;
  show_state();
  in_period_ = t < end_of_period();
  if (!in_period_) ++periods_;
}

void Simulation::sample_drive() {
  const Wheels before = held_->value(t_);
  held_->set(drive_(t_, state_));
  if ((held_->value(t_) != before).any()) integrator_->torque_jumped();
}

void Simulation::stop_on(const std::atomic<bool>& stop) {
  stop_ = &stop;
  integrator_->stop_on(stop);
}

void Simulation::continue_when_tipping() {
  continues_when_tipping_ = true;
  integrator_->continue_when_tipping();
}

void Simulation::set_loads(const AppliedLoads& applied, bool keep_momentum) {
  // The paper's equations have neither loads nor wrenches, and take less time: the extended ones continue from here.
  if (!extended_ && slips(scene_.model)) {
    extended_ = true;
    const MotionSoFar before = integrator_->leave();
    make_integrator(&before);
  }
  added_ = applied;
  integrator_->set_loads(local_, with_added(planned_), keep_momentum);
  show_state();
  note_loads(t_);
}

void Simulation::set_state(const Eigen::Vector3d& pose, const Eigen::Vector3d& velocity,
                           const std::optional<Wheels>& phi) {
  if (integrated_robot(scene_).wheels_prescribed) throw std::logic_error("prescribed wheels cannot be set");
  const double unexplained = kinetic_energy() - state_.work();
  local_.values.col(0).head<3>() = pose.array();
  leave_origin_at(pose[0], pose[1]);
  local_.values.col(1).head<3>() = velocity.array();
  NoSlipModel(scene_.robot).constrain(local_);
  if (phi) local_.phi() = *phi;
  local_.gamma().setZero();
  show_state();
  integrator_->torque_jumped();
  if (slips(scene_.model)) begin_contacts_anew();
  local_.work() = kinetic_energy() - unexplained;
  show_state();
  state_changes_.push_back({t_, state_});
}

// On the rollers on which the wheels stand at their angles.
void Simulation::begin_contacts_anew() {
  MotionSoFar before = integrator_->leave();
  before.contacts.reset();
  make_integrator(&before);
  if (extended_) integrator_->set_loads(local_, applied_loads_, false);
}

// The scene's loads and wrenches, and those that were added.
AppliedLoads Simulation::with_added(AppliedLoads applied) const {
  applied.loads.insert(applied.loads.end(), added_.loads.begin(), added_.loads.end());
  applied.wrenches.insert(applied.wrenches.end(), added_.wrenches.begin(), added_.wrenches.end());
  return applied;
}

// At the beginning of a control period. A change that only rounding separates from it counts as due.
void Simulation::make_due_changes() {
  while (ControlTime::reached(next_change_, t_)) change_loads();
}

// Applies the loads and wrenches of the change that is due.
void Simulation::change_loads() {
  const double t = std::isfinite(next_change_) ? next_change_ : t_;
  integrator_->set_loads(local_, with_added(scene_.load_schedule.at(t, false)), false);
  planned_ = scene_.load_schedule.at(t);
  integrator_->set_loads(local_, with_added(planned_), true);
  show_state();
  next_change_ = scene_.load_schedule.next_change(t);
  note_loads(t);
}

// Notes the loads and wrenches from t on, if they changed; several changes at one instant make one.
void Simulation::note_loads(double t) {
  AppliedLoads now = with_added(planned_);
  const bool loads = now.loads != applied_loads_.loads, wrenches = now.wrenches != applied_loads_.wrenches;
  if (!loads && !wrenches) return;
  applied_loads_ = std::move(now);
  if (!load_changes_.empty() && load_changes_.back().t == t) {
    LoadChange& last = load_changes_.back();
    last = {t, state_.psi(), applied_loads_, last.loads || loads, last.wrenches || wrenches};
  } else {
    load_changes_.push_back({t, state_.psi(), applied_loads_, loads, wrenches});
  }
}

Wheels Simulation::torque() const {
  return prescribed_ ? prescribed_->reaction(scene_.robot, state_.dphi(), contacts().F_X, t_) : torque_->value(t_);
}

std::array<int, kWheels> Simulation::rollers() const {
  std::array<int, kWheels> rollers;
  for (int i = 0; i < kWheels; ++i) rollers[i] = wrapped(integrator_->roller(i), scene_.robot.rollers);
  return rollers;
}

std::array<std::optional<int>, kWheels> Simulation::other_rollers() const {
  std::array<std::optional<int>, kWheels> rollers;
  for (int i = 0; i < kWheels; ++i) {
    if (const auto other = integrator_->other_roller(i)) rollers[i] = wrapped(*other, scene_.robot.rollers);
  }
  return rollers;
}

double Simulation::roller_angle(int i, int k) const {
  return rollers()[i] == k ? state_.gamma()[i] : integrator_->resting_angle(i, k);
}

PowerBalance Simulation::power_balance() const {
  return youbot_base_sim::power_balance(scene_.robot, state_, contacts(), torque());
}

std::string Simulation::method() const {
  return scene_.model == Model::kNoSlip ? NoSlipIntegrator::method(scene_.robot) : scene_.solver.method;
}

double Simulation::energy_balance_error(double kinetic_energy) const {
  return std::abs(kinetic_energy - initial_energy_ - state_.work());
}

}  // namespace youbot_base_sim
