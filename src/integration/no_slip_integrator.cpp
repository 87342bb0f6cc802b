#include "youbot_base_sim/integration/no_slip_integrator.h"

#include <algorithm>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <functional>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/smooth_stepper.h"

namespace youbot_base_sim {

namespace odeint = boost::numeric::odeint;

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
  State increments() const override {
    const RobotParameters& robot = model_.robot();
    // Bearings' friction turns where rolling wheels and rollers turn at their smoothing rates.
    const double turns =
        std::min(robot.dry_friction_rate * robot.R, robot.roller_dry_friction_rate * (robot.R - robot.R_d) * kCosDelta);
    const double step = std::min(1e-6, 1e-3 * turns);
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

void NoSlipIntegrator::advance_periods(State& x, std::int64_t first, double period, std::size_t n,
                                       const PeriodObserver& observer) {
  for (std::size_t k = 0; k < n; ++k) {
    observer(k);
    const auto now = static_cast<double>(first) + static_cast<double>(k);
    advance(x, now * period, (now + 1) * period);
  }
  observer(n);
}

void NoSlipIntegrator::advance(State& x, double t, double t_end) {
  if (!(t < t_end)) return;
  const NoSlipSystem system(model_, torque_, statistics_);
  const double dt = std::min(t_end - t, max_first_step_);
  const auto observer = [this](const State&, double) {
    if (stop_ && *stop_) throw Stopped();
  };
  if (stiff_) {
    const auto rosenbrock4 = find_method("rosenbrock4")->make(tolerance_, 0, statistics_);
    statistics_.steps +=
        odeint::integrate_adaptive(std::ref(*rosenbrock4), std::ref(system), x, t, t_end, dt, observer);
  } else {
    statistics_.steps += odeint::integrate_adaptive(
        odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(tolerance_.absolute, tolerance_.relative),
        std::ref(system), x, t, t_end, dt, observer);
  }
  model_.constrain(x);
}

void NoSlipIntegrator::set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) {
  const double energy = kinetic_energy(x);
  const Eigen::Vector3d momentum = model_.inertia() * x.velocity();
  model_ = NoSlipModel(robot_, floor_, applied);
  if (keep_momentum) {
    x.values.col(1).head<3>() = model_.inertia().llt().solve(momentum).array();
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
