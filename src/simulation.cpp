#include "youbot_base_sim/simulation.h"

#include <deque>
#include <stdexcept>

#include "youbot_base_sim/drive/prescribed_wheels.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/no_slip_integrator.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Samples the scene's drive, or set points, at each control period: through motors if these or the scene ask for any.
class Simulation::SampledDrive {
 public:
  explicit SampledDrive(const Scene& scene)
      : scene_(scene),
        motors_(scene.motors.value_or(MotorSettings())),
        wheels_(scene.solver.control_period, motors_.limit(Motor()), motors_.gains, motors_.quantized.value_or(false)),
        torque_(make_torque_profile(scene)) {}

  /// Set points, N m or rad/s, that are commanded at time t, s.
  void command(double t, DriveMode mode, const Wheels& values) {
    pending_.push_back({t + motors_.command_delay, mode, values});
  }

  /// Torque for the control period that begins at time t (s) with wheel rates `dphi` (rad/s), N m.
  Wheels sample(double t, const Wheels& dphi) {
    for (; !pending_.empty() && ControlTime::reached(pending_.front().due, t); pending_.pop_front()) {
      set_points_ = pending_.front();
    }
    if (set_points_) return through_motors(set_points_->mode, set_points_->values, dphi);
    // Rows and segments that begin later by rounding alone count as begun.
    const double sent = t - motors_.command_delay, begun = sent + ControlTime::rounding(t);
    if (const auto* rates = std::get_if<VelocityTable>(&scene_.drive)) {
      return through_motors(DriveMode::kVelocity, rates->table.at(begun), dphi);
    }
    torque_->begin_segment(begun);
    const Wheels torque = torque_->value(sent);
    return scene_.motors ? through_motors(DriveMode::kTorque, torque, dphi) : torque;
  }

 private:
  struct SetPoints {
    double due;  // s
    DriveMode mode;
    Wheels values;
  };

  Wheels through_motors(DriveMode mode, const Wheels& values, const Wheels& dphi) {
    for (int i = 0; i < kWheels; ++i) wheels_.command(i, {mode, values[i]});
    return wheels_.sample(dphi);
  }

  const Scene& scene_;
  MotorSettings motors_;
  WheelDrive wheels_;
  std::unique_ptr<TorqueProfile> torque_;  // of the scene; null if it has none
  std::deque<SetPoints> pending_;          // due later
  std::optional<SetPoints> set_points_;
};

Simulation::Simulation(const Scene& scene) : scene_(scene), control_time_(scene.solver.control_period) { reset(); }

Simulation::~Simulation() = default;

void Simulation::reset() {
  local_ = state_ = scene_.initial;
  leave_origin_at(local_.x(), local_.y());
  t_ = segment_end_ = 0;
  held_.set(Wheels::Zero());
  drive_.reset();
  continuous_.reset();
  if (!sampled()) {
    continuous_ = make_torque_profile(scene_);
    if (!continuous_) continuous_ = std::make_unique<HeldTorque>();
    continuous_->begin_segment(0);
  } else if (!std::holds_alternative<std::monostate>(scene_.drive)) {
    drive_ = std::make_unique<SampledDrive>(scene_);
  }
  prescribed_ = dynamic_cast<const PrescribedWheels*>(continuous_.get());
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

// Steps add up in local_, from an origin near the base: rounding does not grow with the scene's distances.
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
  const RobotParameters robot = prescribed_ ? PrescribedWheels::driven(scene_.robot) : scene_.robot;
  integrator_ = youbot_base_sim::make_integrator(
      {scene_.model, robot, floor, local_, profile(), scene_.solver, extended_, before});
  integrator_->constrain(local_, t_);
  show_state();
  if (stop_) integrator_->stop_on(*stop_);
  if (continues_when_tipping_) integrator_->continue_when_tipping();
}

void Simulation::advance_to(double t) {
  while (!ControlTime::reached(t, t_)) {
    if (ControlTime::reached(next_change_, t_)) {
      change_loads();
      continue;
    }
    if (ControlTime::reached(segment_end_, t_)) begin_segment();
    const double smooth_end = std::min(segment_end_, next_change_);
    const double end = ControlTime::reached(smooth_end, t) ? smooth_end : t;
    // Commands, and a WheelMotion, may change wherever it is simulated to.
    integrator_->advance(local_, t_, end, continuous_ && !prescribed_ ? smooth_end : end);
    t_ = end;
    show_state();
  }
}

void Simulation::step() {
  if (!sampled()) throw std::logic_error("a simulation without a control_period has no periods to advance by");
  advance_to(period_end());
}

// Samples the drive at the beginning of a control period; or begins the next smooth segment of a continuous torque.
void Simulation::begin_segment() {
  t_ = std::max(t_, segment_end_);
  if (sampled()) segment_end_ = period_end();
  if (drive_) hold(drive_->sample(t_, state_.dphi()));
  if (continuous_) {
    segment_end_ = std::min(continuous_->begin_segment(t_), t_ < scene_.duration ? scene_.duration : kInfinity);
    integrator_->torque_jumped();
  } else if (!sampled()) {
    segment_end_ = kInfinity;
  }
}

void Simulation::hold(const Wheels& torque) {
  const bool jumps = (torque != held_.value(t_)).any();
  held_.set(torque);
  if (jumps) integrator_->torque_jumped();
}

void Simulation::set_torque(const Wheels& torque) {
  if (prescribed_) throw std::logic_error("prescribed wheels take no torque");
  drive_.reset();
  if (continuous_) {
    held_.set(torque);
    continuous_.reset();
    segment_end_ = t_;
    change_integrator(integrator_->leave());
  }
  hold(torque);
}

void Simulation::set_points(DriveMode mode, const Wheels& values) {
  if (!sampled()) throw std::logic_error("set points need a control_period > 0");
  if (!drive_) {
    drive_ = std::make_unique<SampledDrive>(scene_);
    drive_->command(-kInfinity, DriveMode::kTorque, held_.value(t_));  // holds until the new ones are due
  }
  drive_->command(t_, mode, values);
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
    change_integrator(integrator_->leave());
  }
  added_ = applied;
  integrator_->set_loads(local_, with_added(planned_), keep_momentum);
  show_state();
  note_loads(t_);
}

void Simulation::set_state(const Eigen::Vector3d& pose, const Eigen::Vector3d& velocity,
                           const std::optional<Wheels>& phi) {
  if (prescribed_) throw std::logic_error("prescribed wheels cannot be set");
  const double unexplained = kinetic_energy() - state_.work();
  local_.values.col(0).head<3>() = pose.array();
  leave_origin_at(pose[0], pose[1]);
  local_.values.col(1).head<3>() = velocity.array();
  NoSlipModel(scene_.robot).constrain(local_);
  if (phi) local_.phi() = *phi;
  local_.gamma().setZero();
  show_state();
  integrator_->torque_jumped();
  if (slips(scene_.model)) {
    MotionSoFar before = integrator_->leave();
    before.contacts.reset();  // for the rollers on which the wheels stand at their angles
    change_integrator(before);
  }
  local_.work() = kinetic_energy() - unexplained;
  show_state();
  state_changes_.push_back({t_, state_});
}

// Another integrator continues the motion under the same loads.
void Simulation::change_integrator(const MotionSoFar& before) {
  make_integrator(&before);
  if (extended_ || !slips(scene_.model)) integrator_->set_loads(local_, applied_loads_, false);
}

// The scene's loads and wrenches, and those that were added.
AppliedLoads Simulation::with_added(AppliedLoads applied) const {
  applied.loads.insert(applied.loads.end(), added_.loads.begin(), added_.loads.end());
  applied.wrenches.insert(applied.wrenches.end(), added_.wrenches.begin(), added_.wrenches.end());
  return applied;
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
  return prescribed_ ? prescribed_->reaction(scene_.robot, state_.dphi(), contacts().F_X, t_) : profile().value(t_);
}

std::array<int, kWheels> Simulation::rollers() const {
  std::array<int, kWheels> rollers{};
  const ContactModes* modes = integrator_->contact_modes();
  for (int i = 0; modes && i < kWheels; ++i) rollers[i] = wrapped(modes->roller(i), modes->rollers());
  return rollers;
}

std::array<std::optional<int>, kWheels> Simulation::other_rollers() const {
  std::array<std::optional<int>, kWheels> others;
  const ContactModes* modes = integrator_->contact_modes();
  for (int i = 0; modes && i < kWheels; ++i) {
    if (modes->shared(i)) others[i] = wrapped(2 * modes->lower_roller(i) + 1 - modes->roller(i), modes->rollers());
  }
  return others;
}

double Simulation::roller_angle(int i, int k) const {
  if (rollers()[i] == k) return state_.gamma()[i];
  const ContactModes* modes = integrator_->contact_modes();
  return modes ? modes->angle_off_floor(i, k) : 0;
}

PowerBalance Simulation::power_balance() const {
  return youbot_base_sim::power_balance(scene_.robot, state_, contacts(), torque());
}

std::string Simulation::method() const {
  return scene_.model == Model::kNoSlip ? NoSlipIntegrator::method(scene_.robot) : scene_.solver.method;
}

}  // namespace youbot_base_sim
