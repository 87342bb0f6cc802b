#include "youbot_base_sim/integration/no_slip_integrator.h"

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/integration/smooth_stepper.h"

namespace youbot_base_sim {

namespace {

/// Model 1 as a System, which has no edges.
class NoSlipSystem final : public SmoothSystem {
 public:
  NoSlipSystem(const NoSlipModel& model, const TorqueProfile& torque, IntegrationStatistics& statistics)
      : model_(model), torque_(torque), statistics_(statistics) {}

  void operator()(const State& x, State& dxdt, double t) const override {
    ++statistics_.evaluations;
    model_.derivative(x, torque_.value(t), dxdt);
  }
  double max_step(const State& x, double t) const override {
    const double longest = std::min(torque_.max_step(t), kMaxTurn / std::abs(x.Omega()));
    if (!model_.dry()) return longest;
    State dxdt;
    (*this)(x, dxdt, t);
    return std::min(longest, model_.max_step(x.velocity(), dxdt.velocity()));
  }
  State increments() const override {
    const RobotParameters& robot = model_.robot();
    // The friction of bearings reverses where rolling wheels and rollers have their smoothing rates.
    const double reversal =
        std::min(robot.dry_friction_rate * robot.R,
                 robot.roller_dry_friction_rate * (robot.R - robot.R_d) * robot.cos_delta().minCoeff());
    const double step = std::min(1e-6, 1e-3 * reversal);
    State steps;
    steps.psi() = 1e-6;
    steps.values.col(1) << step, step, step, 0;
    return steps;
  }
  Wheels middle() const override { return Wheels::Constant(kInfinity); }

 private:
  const NoSlipModel& model_;
  const TorqueProfile& torque_;
  IntegrationStatistics& statistics_;
};

}  // namespace

NoSlipIntegrator::NoSlipIntegrator(const MotionStart& motion)
    : robot_(motion.robot),
      floor_(motion.floor),
      torque_(motion.torque),
      model_(robot_, floor_, {}),
      max_first_step_(10 / model_.max_decay_rate()),
      next_step_(max_first_step_),
      statistics_(motion.before ? motion.before->statistics : IntegrationStatistics()),
      method_(find_method(method(robot_))->make(share_of(motion.settings.tolerance(), 0.1), statistics_)) {}

// Steps end at t_end. Those that it cuts short do not lose the length worth trying.
void NoSlipIntegrator::advance(State& x, double t, double t_end, double) {
  const NoSlipSystem system(model_, torque_, statistics_);
  State end;
  while (t < t_end) {
    if (stop_ && *stop_) throw Stopped();
    const double left = t_end - t, wanted = next_step_, length = std::min({left, wanted, system.max_step(x, t)});
    next_step_ = length;
    if (method_->try_step(system, x, t, end, next_step_) == boost::numeric::odeint::fail) {
      ++statistics_.rejected_steps;
      continue;
    }
    ++statistics_.steps;
    x = end;
    statistics_.drift_speed += kDriftPerRadian * length * std::abs(x.Omega()) * x.velocity().norm();
    statistics_.drift += statistics_.drift_speed * length;
    if (length < wanted) next_step_ = std::max(next_step_, wanted);
    if (length == left) t = t_end;  // without rounding
  }
  model_.constrain(x);
}

void NoSlipIntegrator::torque_jumped() {
  method_->reset();
  next_step_ = std::min(next_step_, max_first_step_);
}

void NoSlipIntegrator::set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) {
  const double energy = kinetic_energy(x);
  const Eigen::Vector3d momentum = product(model_.inertia(), x.velocity());
  model_ = NoSlipModel(robot_, floor_, applied);
  torque_jumped();
  if (keep_momentum) {
    x.values.col(1).head<3>() = product(inverse(model_.inertia()), momentum).array();
    model_.constrain(x);
  }
  x.work() += kinetic_energy(x) - energy;
}

ContactDetails NoSlipIntegrator::contacts(const State& x, double) const {
  const Wheels none = Wheels::Zero();
  ContactDetails details{{none, none, none, none, none, none, none, none}};
  details.N = normal_reactions(model_.robot(), floor_);
  details.external.head<3>() = model_.external_force(x.psi()).array();
  return details;
}

}  // namespace youbot_base_sim
