#include "youbot_base_sim/simulation.h"

#include <algorithm>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "youbot_base_sim/drive/wheel_drive.h"
#include "youbot_base_sim/integration/radau.h"
#include "youbot_base_sim/integration/safe_stepper.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/integration/switching_integrator.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

/// The motion of one model, from one state on: chosen once, so that nothing in its loops asks which.
class Dynamics {
 public:
  virtual ~Dynamics() = default;

  /// Advances (x, t) to t_end (s) within one segment of the torque; appends to `switches`.
  virtual void advance(State& x, double& t, double t_end, std::vector<RollerSwitch>& switches) = 0;
  /// The torque jumps to another segment.
  virtual void jump() = 0;
  virtual double kinetic_energy(const State& x) const = 0;  // J
  virtual Contacts contacts(const State& x, double t) const = 0;
  virtual std::int64_t roller(int i) const = 0;  // unwrapped
  virtual std::optional<std::int64_t> other_roller(int i) const = 0;
  /// Angle of roller k of wheel i that is not on the floor, rad.
  virtual double resting_angle(int i, int k) const = 0;
  virtual const IntegrationStatistics& statistics() const = 0;
};

/// Models 2a and 2b.
template <class Law>
class SlipDynamics : public Dynamics {
 public:
  SlipDynamics(const Scene& scene, const TorqueProfile& torque)
      : rollers_(scene.robot.rollers),
        at_rest_(scene.robot.roller_rate_at_switch == RollerRateAtSwitch::kAtRest),
        torque_(torque),
        model_(scene.robot, scene.floor),
        system_(model_, torque, scene.initial),
        integrator_({scene.solver.relative_tolerance, scene.solver.absolute_tolerance}, rollers_),
        resting_angle_(static_cast<std::size_t>(kWheels * rollers_), 0.0) {
    integrator_.restart();
  }

  void advance(State& x, double& t, double t_end, std::vector<RollerSwitch>& switches) override {
    const auto on_switch = [&](const RollerSwitch& event, State& state) {
      switches.push_back(event);
      change_roller(state, event.wheel, event.roller_from, event.roller_to);
    };
    while (t < t_end) {
      if (!integrator_.advance(system_, x, t, t_end, on_switch)) step_safely(x, t, std::min(t_end, t + kSafeStretch));
    }
  }

  void jump() override { integrator_.jump(); }
  double kinetic_energy(const State& x) const override { return youbot_base_sim::kinetic_energy(model_.robot(), x); }
  Contacts contacts(const State& x, double t) const override {
    return system_.contacts(x.velocities(), x.phi(), torque_.value(t));
  }
  std::int64_t roller(int i) const override { return system_.roller(i); }
  std::optional<std::int64_t> other_roller(int i) const override {
    if (!system_.shared(i)) return std::nullopt;
    return 2 * system_.lower_roller(i) + 1 - system_.roller(i);
  }
  double resting_angle(int i, int k) const override { return resting_angle_[index(i, k)]; }
  const IntegrationStatistics& statistics() const override { return integrator_.statistics(); }

 private:
  using Integrator = SwitchingIntegrator<Radau<Law>>;
  static constexpr double kSafeStretch = 1e-3;  // s, before the accurate integration is tried again
  static constexpr double kSafeStep = 1e-5;     // s

  std::size_t index(int i, int k) const { return static_cast<std::size_t>(i * rollers_ + k); }

  // The roller that leaves the floor keeps its angle; the one that comes has the angle that it left it with.
  void change_roller(State& x, int wheel, int from, int to) {
    resting_angle_[index(wheel, from)] = x.gamma()[wheel];
    x.gamma()[wheel] = resting_angle_[index(wheel, to)];
    if (!at_rest_) return;
    // The energy of the roller that leaves is its bearing's to take.
    x.work() -= 0.5 * model_.robot().J_2 * x.dgamma()[wheel] * x.dgamma()[wheel];
    x.dgamma()[wheel] = 0;
  }

  void step_safely(State& x, double& t, double t_end) {
    const int steps = std::max(1, static_cast<int>(std::ceil((t_end - t) / kSafeStep)));
    const double start = t, dt = (t_end - t) / steps;
    for (int i = 0; i < kWheels; ++i) system_.put(i, system_.roller(i));  // on one roller each
    for (int k = 1; k <= steps; ++k) {
      safe_stepper_.step(system_, x, t, dt);
      t = k == steps ? t_end : start + k * dt;
      for (int i = 0; i < kWheels; ++i) {
        const std::int64_t from = system_.roller(i), to = model_.geometry().roller_at(x.phi()[i]);
        if (from == to) continue;
        system_.put(i, to);
        change_roller(x, i, wrapped(from, rollers_), wrapped(to, rollers_));
      }
    }
    integrator_.statistics().fallback_steps += static_cast<std::uint64_t>(steps);
  }

  int rollers_;
  bool at_rest_;
  const TorqueProfile& torque_;
  SlipModel<Law> model_;
  SlipSystem<Law> system_;
  Integrator integrator_;
  SafeStepper<Law> safe_stepper_;
  std::vector<double> resting_angle_;
};

/// Model 1, which is not stiff: odeint's Dormand-Prince.
class NoSlipDynamics : public Dynamics {
 public:
  NoSlipDynamics(const Scene& scene, const TorqueProfile& torque)
      : torque_(torque), model_(scene.robot), solver_(scene.solver) {}

  void advance(State& x, double& t, double t_end, std::vector<RollerSwitch>&) override {
    namespace odeint = boost::numeric::odeint;
    if (!(t < t_end)) return;
    Numbers numbers;
    Eigen::Map<State::Values>(numbers.data()) = x.values;
    const auto system = [this](const Numbers& y, Numbers& dydt, double time) {
      State state, derivative;
      state.values = Eigen::Map<const State::Values>(y.data());
      model_.derivative(state, torque_.value(time), derivative);
      Eigen::Map<State::Values>(dydt.data()) = derivative.values;
    };
    statistics_.steps += odeint::integrate_adaptive(odeint::make_controlled<odeint::runge_kutta_dopri5<Numbers>>(
                                                        solver_.absolute_tolerance, solver_.relative_tolerance),
                                                    system, numbers, t, t_end, t_end - t);
    x.values = Eigen::Map<State::Values>(numbers.data());
    model_.constrain(x);
    t = t_end;
  }

  void jump() override {}
  double kinetic_energy(const State& x) const override { return model_.kinetic_energy(x.velocity()); }
  Contacts contacts(const State&, double) const override {
    const Wheels none = Wheels::Zero();
    return {none, none, none, none, none, none, none, none};
  }
  std::int64_t roller(int) const override { return 0; }
  std::optional<std::int64_t> other_roller(int) const override { return std::nullopt; }
  double resting_angle(int, int) const override { return 0; }
  const IntegrationStatistics& statistics() const override { return statistics_; }

 private:
  using Numbers = std::array<double, State::Values::SizeAtCompileTime>;
  const TorqueProfile& torque_;
  NoSlipModel model_;
  SolverSettings solver_;
  IntegrationStatistics statistics_;
};

std::unique_ptr<Dynamics> make_dynamics(const Scene& scene, const TorqueProfile& torque) {
  switch (scene.model) {
    case Model::kNoSlip:
      return std::make_unique<NoSlipDynamics>(scene, torque);
    case Model::kViscous:
      return std::make_unique<SlipDynamics<ViscousLaw>>(scene, torque);
    default:
      return std::make_unique<SlipDynamics<CoulombLaw>>(scene, torque);
  }
}

/// The scene's own drive, sampled: its torque at the beginning of each control period, or its velocities by the wheels'
/// velocity loop.
Simulation::Drive make_drive(const Scene& scene) {
  // A row or a segment that begins where a control period does must not be missed for a rounding error.
  const double late = 1e-6 * scene.solver.control_period;
  if (const auto* velocities = std::get_if<VelocityTable>(&scene.drive)) {
    WheelDrive wheels(scene.solver.control_period);
    return [wheels, late, table = velocities->table](double t, const State& state) mutable {
      const Wheels rate = table.at(t + late);
      for (int i = 0; i < kWheels; ++i) wheels.command(i, {DriveMode::kVelocity, rate[i]});
      return wheels.sample(state.dphi());
    };
  }
  const std::shared_ptr<TorqueProfile> torque = make_torque_profile(scene);
  if (!torque) return [](double, const State&) -> Wheels { return Wheels::Zero(); };
  return [torque, late](double t, const State&) {
    torque->begin_segment(t + late);
    return torque->value(t);
  };
}

}  // namespace

class Simulation::Loop {
 public:
  Loop(const Scene& scene, Drive drive) : scene_(scene), given_drive_(std::move(drive)) {
    if (given_drive_ && !(scene.solver.control_period > 0)) {
      throw std::invalid_argument("a sampled drive needs a control_period > 0");
    }
    switches_.reserve(1024);
    reset();
  }

  void reset() {
    state_ = scene_.initial;
    t_ = 0;
    periods_ = 0;
    in_period_ = false;
    switches_.clear();
    held_ = nullptr;
    if (scene_.solver.control_period > 0) {
      auto held = std::make_unique<HeldTorque>();
      held_ = held.get();
      torque_ = std::move(held);
      drive_ = given_drive_ ? given_drive_ : make_drive(scene_);
    } else {
      torque_ = make_torque_profile(scene_);
      if (!torque_) torque_ = std::make_unique<HeldTorque>();
      torque_->begin_segment(0);
    }
    dynamics_ = make_dynamics(scene_, *torque_);
    initial_energy_ = dynamics_->kinetic_energy(state_);
  }

  void advance_to(double t) {
    if (!held_) return advance_continuously(t);
    const double slack = 1e-6 * scene_.solver.control_period;
    while (t_ < t - slack) {
      const double end = period_end();
      advance_held(end <= t + slack ? end : t);
    }
  }

  void advance_periods(std::int64_t n) {
    if (!held_) throw std::logic_error("a simulation without a control_period has no periods to advance by");
    for (std::int64_t k = 0; k < n; ++k) advance_held(period_end());
  }

  const Scene scene_;
  State state_;
  double t_ = 0;
  std::unique_ptr<TorqueProfile> torque_;
  std::unique_ptr<Dynamics> dynamics_;
  std::vector<RollerSwitch> switches_;
  double initial_energy_ = 0;

 private:
  void advance_continuously(double t) {
    while (t_ < t) {
      const double end = torque_->begin_segment(t_);
      dynamics_->advance(state_, t_, std::min(end, t), switches_);
    }
  }

  // k * period rather than a sum, so that an hour of periods is an hour.
  double period_end() const { return static_cast<double>(periods_ + 1) * scene_.solver.control_period; }

  void advance_held(double t) {
    if (!in_period_) {
      const Wheels before = held_->value(t_);
      held_->set(drive_(t_, state_));
      if ((held_->value(t_) != before).any()) dynamics_->jump();
    }
    in_period_ = true;
    dynamics_->advance(state_, t_, t, switches_);
    if (t == period_end()) {
      ++periods_;
      in_period_ = false;
    }
  }

  Drive given_drive_;
  Drive drive_;
  HeldTorque* held_ = nullptr;  // torque_, where the drive is sampled
  std::int64_t periods_ = 0;    // completed
  bool in_period_ = false;
};

Simulation::Simulation(const Scene& scene) : loop_(std::make_unique<Loop>(scene, nullptr)) {}

Simulation::Simulation(const Scene& scene, Drive drive) : loop_(std::make_unique<Loop>(scene, std::move(drive))) {}

Simulation::~Simulation() = default;

void Simulation::advance_to(double t) { loop_->advance_to(t); }
void Simulation::advance_periods(std::int64_t n) { loop_->advance_periods(n); }
void Simulation::reset() { loop_->reset(); }
double Simulation::time() const { return loop_->t_; }
const State& Simulation::state() const { return loop_->state_; }
Wheels Simulation::torque() const { return loop_->torque_->value(loop_->t_); }

std::array<int, kWheels> Simulation::rollers() const {
  std::array<int, kWheels> rollers;
  for (int i = 0; i < kWheels; ++i) rollers[i] = wrapped(loop_->dynamics_->roller(i), loop_->scene_.robot.rollers);
  return rollers;
}

std::array<std::optional<int>, kWheels> Simulation::other_rollers() const {
  std::array<std::optional<int>, kWheels> rollers;
  for (int i = 0; i < kWheels; ++i) {
    if (const auto other = loop_->dynamics_->other_roller(i)) rollers[i] = wrapped(*other, loop_->scene_.robot.rollers);
  }
  return rollers;
}

double Simulation::roller_angle(int i, int k) const {
  return rollers()[i] == k ? loop_->state_.gamma()[i] : loop_->dynamics_->resting_angle(i, k);
}

Contacts Simulation::contacts() const { return loop_->dynamics_->contacts(loop_->state_, loop_->t_); }

std::vector<RollerSwitch> Simulation::take_switches() {
  std::vector<RollerSwitch> taken(loop_->switches_);
  loop_->switches_.clear();  // which keeps its memory
  return taken;
}

const IntegrationStatistics& Simulation::statistics() const { return loop_->dynamics_->statistics(); }

double Simulation::kinetic_energy() const { return loop_->dynamics_->kinetic_energy(loop_->state_); }

double Simulation::energy_balance_error() const {
  return std::abs(kinetic_energy() - loop_->initial_energy_ - loop_->state_.work());
}

const Scene& Simulation::scene() const { return loop_->scene_; }

}  // namespace youbot_base_sim
