#pragma once

#include "youbot_base_sim/integration/bordered_solver.h"
#include "youbot_base_sim/physics/wheel_torque.h"

namespace youbot_base_sim {

/// A SlipModel under given wheel torques as a system for steppers: models odeint's System, and what rosenbrock.h and
/// switching_integrator.h ask beyond it. Knows which roller of each wheel stands on the floor.
template <class Law>
class SlipSystem {
 public:
  using State = youbot_base_sim::State;

  /// Both must outlive the system. Rollers are those that `state` stands on.
  SlipSystem(const SlipModel<Law>& model, const WheelTorque& torque, const State& state)
      : model_(&model), torque_(&torque) {
    for (int i = 0; i < kWheels; ++i) put(i, model.geometry().roller_at(state.phi()[i]));
  }

  void operator()(const State& x, State& dxdt, double t) const {
    model_->derivative(x, roller_angle_, torque_->at(t), dxdt);
  }

  class Linearization {
   public:
    void factorize(double alpha) { solver_.factorize(jacobian_, *inertia_, alpha); }
    void solve(const State& b, State& u) const { solver_.solve(b, u); }

   private:
    friend class SlipSystem;
    BorderedJacobian jacobian_;
    BorderedSolver solver_;
    const Inertia* inertia_ = nullptr;
  };

  void linearize(const State& x, double t, Linearization& linearization, State& dfdt) const {
    linearization.inertia_ = &model_->inertia();
    model_->linearize(x, roller_angle_, torque_->at(t), linearization.jacobian_);
    const Wheels rate = torque_->rate(t);
    dfdt.values.setZero();
    dfdt.dphi() = rate * (1 / model_->inertia().J_1);
    dfdt.work() = (rate * x.dphi()).sum();
  }

  /// Largest error of a component by what is allowed for it: `absolute` plus `relative` times the component's size for
  /// a velocity, or times 1 m or 1 rad for a position or an angle, of which only changes matter. The roller's angle and
  /// the work are not controlled: nothing depends on them.
  double error_norm(const State& x_old, const State& x_new, const State& error, double relative,
                    double absolute) const {
    const auto size = [&](int column) {
      return absolute + relative * x_old.values.col(column).abs().max(x_new.values.col(column).abs());
    };
    const Wheels position = Wheels{1, 1, 1, 0} * error.values.col(0).abs() / (absolute + relative);
    const Wheels velocity = error.values.col(1).abs() / size(1);
    const Wheels phi = error.phi().abs() / (absolute + relative);
    const Wheels dphi = error.dphi().abs() / size(3);
    const Wheels dgamma = error.dgamma().abs() / size(4);
    const double sum = (position.square() + velocity.square() + phi.square() + dphi.square() + dgamma.square()).sum();
    return std::sqrt(sum / 18);
  }

  /// Wheel angles between which wheel i stays on its roller, [lower, upper), rad.
  double lower_edge(int i) const { return model_->geometry().upper_edge(roller_[i] - 1); }
  double upper_edge(int i) const { return model_->geometry().upper_edge(roller_[i]); }

  /// Unwrapped number of the roller that wheel i stands on.
  int roller(int i) const { return roller_[i]; }

  /// Stands wheel i on roller k (unwrapped number).
  void put(int i, int k) {
    roller_[i] = k;
    roller_angle_[i] = k * model_->geometry().pitch();
  }

  const Wheels& roller_angle() const { return roller_angle_; }
  const SlipModel<Law>& model() const { return *model_; }

 private:
  const SlipModel<Law>* model_;
  const WheelTorque* torque_;
  std::array<int, kWheels> roller_;
  Wheels roller_angle_;
};

}  // namespace youbot_base_sim
