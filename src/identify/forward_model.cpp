#include "youbot_base_sim/identify/forward_model.h"

#include <algorithm>

#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kControlPeriod = 1e-3;  // s, as the motors'

/// The mean of a table over each control period, delayed. A mean, so that a little more delay is a little more of the
/// old row, and not nothing at first and then a whole period.
class DelayedCommands {
 public:
  DelayedCommands(const WheelTable& table, double delay, const Motor& motor)
      : table_(table), delay_(delay), motor_(motor) {}

  /// Over the period that begins at t (s); to be called for one after the other.
  Wheels mean(double t) {
    const double end = t + kControlPeriod;
    Wheels sum = Wheels::Zero();
    while (next_ < table_.t.size() && table_.t[next_] + delay_ < end) {
      const double change = std::max(table_.t[next_] + delay_, t);
      sum += (change - t) * now_;
      t = change;
      now_ = transmitted(table_.values[next_++]);
    }
    return (sum + (end - t) * now_) / kControlPeriod;
  }

 private:
  /// As EtherCAT carries them: rows are rounded, their means are not.
  Wheels transmitted(Wheels rate) const {
    for (int i = 0; i < kWheels; ++i)
      rate[i] = motor_.transmitted(motor_.limited({DriveMode::kVelocity, rate[i]})).value;
    return rate;
  }

  const WheelTable& table_;
  double delay_;
  Motor motor_;
  std::size_t next_ = 0;
  Wheels now_ = Wheels::Zero();
};

Scene start_of(const Scene& candidate, const DriveRecord& record, const Wheels& phi) {
  Scene scene = candidate;
  scene.solver.control_period = kControlPeriod;
  scene.solver.relative_tolerance = 1e-5;
  scene.solver.absolute_tolerance = 1e-8;
  scene.initial = State();
  scene.initial.phi() = phi;
  // Rolling as the wheels turn, ahead, sideways and round.
  const NoSlipModel rolling(scene.robot);
  const Eigen::Matrix<double, kWheels, 3> rates = [&] {
    Eigen::Matrix<double, kWheels, 3> m;
    for (int k = 0; k < 3; ++k) m.col(k) = rolling.dphi(Eigen::Vector3d::Unit(k)).matrix();
    return m;
  }();
  const Eigen::Vector3d v = rates.colPivHouseholderQr().solve(record.dphi.front().matrix());
  scene.initial.values.col(1).head<3>() = v.array();
  scene.initial.dphi() = rolling.dphi(v);
  scene.initial.dgamma() = rolling.dgamma(v);
  return scene;
}

}  // namespace

Prediction predict(const Scene& candidate, const DriveRecord& record, const Wheels& phi) {
  const MotorSettings& motors = *candidate.motors;
  WheelDrive loops(kControlPeriod, motors.limit(Motor()), motors.gains);
  DelayedCommands commands(record.commands, motors.command_delay, motors.limit(Motor()));
  Wheels torque = Wheels::Zero();
  Simulation simulation(start_of(candidate, record, phi), [&](double t, const State& state) {
    const Wheels rate = commands.mean(t);
    for (int i = 0; i < kWheels; ++i) loops.command(i, {DriveMode::kVelocity, rate[i]});
    return torque = loops.sample(state.dphi());
  });
  Prediction prediction;
  for (const double t : record.t) {
    simulation.advance_to(t);
    const State& state = simulation.state();
    prediction.dphi.push_back(state.dphi());
    prediction.torque.push_back(torque);
    prediction.pose.emplace_back(state.x(), state.y(), state.psi());
  }
  simulation.take_switches();
  return prediction;
}

}  // namespace youbot_base_sim
