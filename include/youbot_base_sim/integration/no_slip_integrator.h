#pragma once

#include <memory>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/tolerance.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/torque_profile.h"

namespace youbot_base_sim {

/// Model 1, which has no switches: odeint's dopri5, or rosenbrock4 where the bearings brake too hard for it. Steps are
/// short where dry friction reverses, in a bearing or in the torques of a desired motion: an error estimate misses most
/// of a kink between two stages. Steps keep to a tenth of the tolerance: only bearings damp their errors. `drift` is a
/// path that counts what they add up to in a base that spins: a tenth of the speed a step, 8 steps or more a radian.
class NoSlipIntegrator : public MotionIntegrator {
 public:
  explicit NoSlipIntegrator(const MotionStart& motion);

  /// The method that a robot needs: dopri5 or rosenbrock4.
  static const char* method(const RobotParameters& robot) {
    return NoSlipModel(robot).max_decay_rate() > kMaxExplicitRate ? "rosenbrock4" : "dopri5";
  }

  void advance(State& x, double t, double t_end, double smooth_end) override;
  void stop_on(const std::atomic<bool>& stop) override { stop_ = &stop; }
  void torque_jumped() override;
  double kinetic_energy(const State& x) const override { return model_.kinetic_energy(x.velocity()); }
  void set_loads(State& x, const AppliedLoads& applied, bool keep_momentum) override;
  MotionSoFar leave() override { return {std::nullopt, statistics_, std::nullopt, {}}; }
  ContactDetails contacts(const State& x, double t) const override;
  const IntegrationStatistics& statistics() const override { return statistics_; }

 private:
  // Steps of dopri5 end near 3 / rate: at 1e5/s, a millisecond takes 30 of them.
  static constexpr double kMaxExplicitRate = 1e6;
  static constexpr double kDriftPerRadian = 8 * 0.1 / 20;  // of the speed; 20 tolerances are promised

  RobotParameters robot_;
  FloorParameters floor_;
  const TorqueProfile& torque_;
  NoSlipModel model_;
  double max_first_step_;  // s: much longer ones may overflow, where the error estimate is void
  double next_step_;       // s, worth trying
  IntegrationStatistics statistics_;
  std::unique_ptr<SmoothStepper> method_;
  const std::atomic<bool>* stop_ = nullptr;  // null: never
};

}  // namespace youbot_base_sim
