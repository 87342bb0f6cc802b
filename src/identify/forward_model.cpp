#include "youbot_base_sim/identify/forward_model.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>

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

/// The time of a sample, in the control period where it was taken: stamps are rounded, which must not move it to the
/// next, whose torque is another.
double time_in_period(double t) {
  constexpr double kRounding = 1e-5;  // s
  const double whole = std::round(t / kControlPeriod) * kControlPeriod;
  return std::abs(t - whole) < kRounding ? whole : t;
}

Scene start_of(const Scene& candidate, const DriveRecord& record, const Wheels& phi) {
  Scene scene = candidate;
  scene.solver.control_period = kControlPeriod;
  scene.solver.relative_tolerance = 1e-4;  // residuals change by 1e-4 of what is expected of them
  scene.solver.absolute_tolerance = 1e-7;
  scene.initial = State();
  scene.initial.phi() = phi;
  // Rolling as the wheels turn.
  const NoSlipModel rolling(scene.robot);
  const Eigen::Vector3d v = rolling_velocity(rolling, record.dphi.front());
  scene.initial.values.col(1).head<3>() = v.array();
  scene.initial.dphi() = rolling.dphi(v);
  scene.initial.dgamma() = rolling.dgamma(v);
  return scene;
}

}  // namespace

Eigen::Vector3d rolling_velocity(const NoSlipModel& model, const Wheels& rates) {
  Eigen::Matrix<double, kWheels, 3> rolling;
  for (int k = 0; k < 3; ++k) rolling.col(k) = model.dphi(Eigen::Vector3d::Unit(k)).matrix();
  return rolling.colPivHouseholderQr().solve(rates.matrix());
}

Prediction predict(const Scene& candidate, const DriveRecord& record, const Wheels& phi,
                   const std::atomic<bool>* stop) {
  const MotorSettings& motors = *candidate.motors;
  WheelDrive loops(kControlPeriod, motors.limit(Motor()), motors.gains);
  DelayedCommands commands(record.commands, motors.command_delay, motors.limit(Motor()));
  Wheels torque = Wheels::Zero();
  Simulation simulation(start_of(candidate, record, phi), [&](double t, const State& state) {
    const Wheels rate = commands.mean(t);
    for (int i = 0; i < kWheels; ++i) loops.command(i, {DriveMode::kVelocity, rate[i]});
    return torque = loops.sample(state.dphi());
  });
  if (stop) simulation.stop_on(*stop);
  Prediction prediction;
  for (const double t : record.t) {
    simulation.advance_to(time_in_period(t));
    const State& state = simulation.state();
    prediction.phi.push_back(state.phi() - phi);
    prediction.dphi.push_back(state.dphi());
    prediction.torque.push_back(torque);
    prediction.pose.emplace_back(state.x(), state.y(), state.psi());
  }
  simulation.take_switches();
  return prediction;
}

std::vector<Prediction> predict(const std::vector<Replay>& replays, const Workers& workers) {
  std::vector<Prediction> predictions(replays.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t k = next++; k < replays.size(); k = next++) {
      predictions[k] = predict(replays[k].candidate, *replays[k].record, replays[k].phi, workers.stop);
    }
  };
  std::vector<std::future<void>> helpers;
  for (int k = 1; k < workers.threads; ++k) helpers.push_back(std::async(std::launch::async, work));
  helpers.push_back(std::async(std::launch::deferred, work));
  for (auto helper = helpers.rbegin(); helper != helpers.rend(); ++helper) helper->wait();
  for (std::future<void>& helper : helpers) helper.get();
  return predictions;
}

}  // namespace youbot_base_sim
