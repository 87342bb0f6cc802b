#include "youbot_base_sim/identify/forward_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "youbot_base_sim/identify/least_squares.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kControlPeriod = 1e-3;  // s, as the motors'

/// The mean of a table over each control period, delayed: a little more delay is a little more of the old row.
struct DelayedCommands {
  const WheelTable& table;
  double delay;  // s
  Motor motor;
  std::size_t next = 0;
  Wheels now = Wheels::Zero();

  /// Over the period that begins at t (s); to be called for one after the other.
  Wheels mean(double t) {
    const double end = t + kControlPeriod;
    Wheels sum = Wheels::Zero();
    for (; next < table.t.size() && table.t[next] + delay < end; ++next) {
      const double change = std::max(table.t[next] + delay, t);
      sum += (change - t) * now;
      t = change;
      // EtherCAT carries rounded rows; their means are not.
      now = table.values[next].unaryExpr([&](double rate) {
        return motor.transmitted(motor.limited({DriveMode::kVelocity, rate})).value;
      });
    }
    return (sum + (end - t) * now) / kControlPeriod;
  }
};

/// The time of a sample in its control period: rounding of the stamp must not move it to the next period.
double time_in_period(double t) {
  constexpr double kRounding = 1e-5;  // s
  const double whole = std::round(t / kControlPeriod) * kControlPeriod;
  return std::abs(t - whole) < kRounding ? whole : t;
}

Scene start_of(Scene scene, const DriveRecord& record, const Wheels& phi) {
  scene.solver.control_period = kControlPeriod;
  scene.solver.relative_tolerance = 3e-5;  // at 1e-4 its errors look like a shifted centre of mass
  scene.solver.absolute_tolerance = 3e-8;
  scene.initial = State();
  scene.initial.phi() = phi;
  // Rolling as the wheels turn.
  const NoSlipModel rolling(scene.robot);
  const Eigen::Vector3d v = Rolling(scene.robot).velocity(record.dphi.front());
  scene.initial.values.col(1).head<3>() = v.array();
  scene.initial.dphi() = rolling.dphi(v);
  scene.initial.dgamma() = rolling.dgamma(v);
  return scene;
}

constexpr double kMinRate = 0.5;        // rad/s: wheels that turn
constexpr double kTransient = 0.5;      // s, after which ripple is more than what is left of the start
constexpr double kRippleFilter = 0.15;  // s: what is slower is no ripple

/// For each motion and wheel the part of its rate that comes as often as its rollers: all cosines, then all sines.
Eigen::VectorXd ripples(const DriveRecord& record, const Readings& readings, int rollers) {
  const auto& [phi, dphi, torque] = readings;
  const std::vector<Wheels> slow = low_pass(record.t, dphi, kRippleFilter);
  const std::vector<Motion> motions = record.motions();
  Eigen::MatrixXcd sums = Eigen::MatrixXcd::Zero(kWheels, static_cast<Eigen::Index>(motions.size()));
  for (Eigen::Index m = 0; m < sums.cols(); ++m) {
    for (const std::size_t k : record.samples(motions[m].begin + kTransient, motions[m].end)) {
      for (int i = 0; i < kWheels; ++i) {
        if (std::abs(dphi[k][i]) < kMinRate) continue;
        sums(i, m) += (dphi[k][i] - slow[k][i]) * std::polar(1.0, -rollers * (phi[k][i] - phi[0][i]));
      }
    }
  }
  Eigen::VectorXd parts(2 * sums.size());
  parts << sums.real().reshaped(), sums.imag().reshaped();
  return parts;
}

double rate_error(const DriveRecord& record, const Prediction& prediction) {
  constexpr double kFilter = 0.1;  // s
  const std::vector<Eigen::Vector3d> off = low_pass(record.t, modes_of(record.dphi, prediction.dphi), kFilter);
  double error = 0;
  for (const std::size_t k : record.samples()) error += off[k].squaredNorm();
  return error;
}

}  // namespace

Prediction predict(const Scene& scene, const DriveRecord& record, const Wheels& phi, const std::atomic<bool>* stop) {
  const MotorSettings& motors = *scene.motors;
  const Motor motor = motors.limit(Motor());
  WheelDrive loops(kControlPeriod, motor, motors.gains);
  DelayedCommands commands{record.commands, motors.command_delay, motor};
  Wheels torque = Wheels::Zero();
  const auto drive = [&](double t, const State& state) {
    const Wheels rate = commands.mean(t);
    for (int i = 0; i < kWheels; ++i) loops.command(i, {DriveMode::kVelocity, rate[i]});
    return torque = loops.sample(state.dphi());
  };
  Simulation simulation(start_of(scene, record, phi));
  if (stop) simulation.stop_on(*stop);
  Prediction prediction;
  for (const double t : record.t) {
    advance_to(simulation, time_in_period(t), drive);
    const State& state = simulation.state();
    prediction.phi.push_back(state.phi() - phi);
    prediction.dphi.push_back(state.dphi());
    prediction.torque.push_back(torque);
    prediction.pose.emplace_back(state.x(), state.y(), state.psi());
  }
  simulation.take_switches();
  return prediction;
}

std::vector<std::vector<Prediction>> predict(const std::vector<Candidate>& candidates,
                                             const std::vector<DriveRecord>& records, const Workers& workers) {
  std::vector<std::vector<Prediction>> predictions(candidates.size(), std::vector<Prediction>(records.size()));
  workers.share(candidates.size() * records.size(), [&](std::size_t run) {
    const std::size_t k = run / records.size(), r = run % records.size();
    predictions[k][r] = predict(candidates[k].scene, records[r], candidates[k].phi[r], workers.stop);
  });
  return predictions;
}

void find_angles(Candidate& candidate, const std::vector<DriveRecord>& records, const Workers& workers) {
  // All wheels ripple alike, each in the others' rates: only together can they be found. Ripples are nearly linear in
  // the phases' cosines and sines, which the tries make orthogonal to each other, to a constant and to their products.
  constexpr int kTries = 16;
  const int rollers = candidate.scene.robot.rollers;
  Eigen::MatrixXd phases(kTries, 2 * kWheels);
  std::vector<Candidate> tries(kTries, candidate);
  for (int k = 0; k < kTries; ++k) {
    for (int i = 0; i < kWheels; ++i) {
      const double phase = 2 * M_PI * k * (2 * i + 1) / kTries;
      phases(k, i) = std::cos(phase);
      phases(k, kWheels + i) = std::sin(phase);
      for (Wheels& phi : tries[k].phi) phi[i] += phase / rollers;
    }
  }
  const std::vector<std::vector<Prediction>> predictions = predict(tries, records, workers);
  for (std::size_t r = 0; r < records.size(); ++r) {
    const Eigen::VectorXd recorded = ripples(records[r], records[r], rollers);
    Eigen::MatrixXd predicted(recorded.size(), kTries);
    for (int k = 0; k < kTries; ++k) predicted.col(k) = ripples(records[r], predictions[k][r], rollers);
    const Eigen::VectorXd found =
        solve_least_squares(2.0 / kTries * predicted * phases, recorded - predicted.rowwise().mean());
    for (int i = 0; i < kWheels; ++i) candidate.phi[r][i] += std::atan2(found[kWheels + i], found[i]) / rollers;
  }
}

DriveRecord applied_in_cycles(DriveRecord record) {
  const double longest = 2 * record.duration() / static_cast<double>(record.t.size());
  WheelTable commands;
  for (std::size_t k = 0; k < record.commands.t.size(); ++k) {
    const auto cycle = std::lower_bound(record.t.begin(), record.t.end(), record.commands.t[k]);
    if (cycle == record.t.end()) break;
    // The driver continued during a gap of the record.
    const double applied = *cycle - record.commands.t[k] < longest ? *cycle : record.commands.t[k];
    if (!commands.t.empty() && commands.t.back() == applied) {
      commands.values.back() = record.commands.values[k];
    } else {
      commands.t.push_back(applied);
      commands.values.push_back(record.commands.values[k]);
    }
  }
  record.commands = commands;
  return record;
}

double find_delay(Candidate& candidate, const std::vector<DriveRecord>& records, const Workers& workers, double first,
                  double step) {
  constexpr int kTried = 7;
  std::vector<Candidate> tried(kTried, candidate);
  for (int k = 0; k < kTried; ++k) tried[k].scene.motors->command_delay = first + k * step;
  const std::vector<std::vector<Prediction>> predictions = predict(tried, records, workers);
  std::array<double, kTried> errors{};
  for (int k = 0; k < kTried; ++k) {
    for (std::size_t r = 0; r < records.size(); ++r) errors[k] += rate_error(records[r], predictions[k][r]);
  }
  const auto best = std::min_element(errors.begin(), errors.end()) - errors.begin();
  const auto middle = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(best, 1, kTried - 2));
  const double before = errors[middle - 1], at = errors[middle], after = errors[middle + 1];
  const double curvature = before - 2 * at + after, slope = (after - before) / 2;
  const double offset = curvature > 0 ? std::clamp(-slope / curvature, -1.0, 1.0) : 0;
  candidate.scene.motors->command_delay = std::max(0.0, first + (static_cast<double>(middle) + offset) * step);
  return at + offset * slope + offset * offset * curvature / 2;
}

}  // namespace youbot_base_sim
