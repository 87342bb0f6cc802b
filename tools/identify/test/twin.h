#pragma once

#include <random>

#include "youbot_base_sim/drive/base_driver.h"
#include "youbot_base_sim/drive/driver_kinematics.h"
#include "youbot_base_sim/identify/drive_record.h"
#include "youbot_base_sim/identify/fitted_parameters.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

inline Scene measured_base() {
  Scene scene;
  scene.robot = measured_robot();
  scene.motors.emplace();
  return scene;
}

/// One command of a drive: a velocity of the base (m/s, rad/s) for some time (s).
struct Command {
  double time;
  Eigen::Vector3d velocity;
};

/// A robot that is known, and what the bag of its drive would tell: readings at 50 Hz in whole rpm, mA and ticks, with
/// noise, by motors at 1 kHz, from wheels that stood anyhow.
struct Twin {
  Scene robot;  ///< with its motors
  unsigned seed = 1;
  double noise = 1;                     ///< times 0.004 rad/s and 0.005 N m
  double push_from = -1, push_to = -1;  ///< s
  Wheels push = Wheels::Zero();         ///< N m at each wheel, as a hand that pushes the base
  bool in_cycles = false;               ///< commands, which come at any time, are applied when the joints are read
  bool ground_truth = false;            ///< with noise of 0.3 mm and 0.5 mrad

  static constexpr double kCycle = 0.02;  // s

  /// Angles at which the wheels start, where readings are zero, rad.
  Wheels start() const {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> anywhere(0, 2 * M_PI);
    return Wheels::NullaryExpr([&] { return anywhere(random); });
  }

  DriveRecord drive(const std::vector<Command>& programme) const {
    std::mt19937_64 random(seed);
    random.discard(kWheels);  // those of `start`
    std::normal_distribution<double> normal;
    Scene scene = robot;
    scene.solver.control_period = 1e-3;
    scene.solver.relative_tolerance = 1e-6;
    const Wheels phi = start();
    scene.initial.phi() = phi;
    BaseDriver::Settings settings;
    settings.motors = *robot.motors;
    BaseDriver driver(settings);

    DriveRecord record;
    record.name = "twin";
    double end = 0;
    std::uniform_real_distribution<double> late(0, kCycle);
    std::vector<double> applied;
    for (const Command& command : programme) {
      const double arrival = end + late(random);
      record.commands.t.push_back(arrival);
      record.commands.values.push_back(DriverKinematics().wheel_rates(command.velocity));
      applied.push_back(in_cycles ? kCycle * std::ceil(arrival / kCycle) : arrival);
      end += command.time;
    }
    std::size_t next = 0;
    Wheels torque = Wheels::Zero();
    const auto drive = [&](double t, const State& state) -> Wheels {
      while (next < applied.size() && applied[next] <= t + 1e-9) {
        driver.command(t, drive_command(DriveMode::kVelocity, record.commands.values[next]));
        ++next;
      }
      torque = driver.sample(t, state.dphi());
      return t >= push_from && t < push_to ? Wheels(torque + push) : torque;
    };
    Simulation simulation(scene);
    const Motor motor;
    const auto whole = [](double value, double quantum) { return std::round(value / quantum) * quantum; };
    for (int k = 0; kCycle * k < end; ++k) {
      advance_to(simulation, kCycle * k, drive);
      Wheels angles = simulation.state().phi() - phi, rates, torques;
      for (int i = 0; i < kWheels; ++i) {
        angles[i] = whole(angles[i], motor.tick());
        rates[i] = whole(simulation.state().dphi()[i] + 0.004 * noise * normal(random), motor.rpm());
        torques[i] = whole(torque[i] + 0.005 * noise * normal(random), motor.milliampere());
      }
      record.t.push_back(kCycle * k);
      record.phi.push_back(angles);
      record.dphi.push_back(rates);
      record.torque.push_back(torques);
      if (!ground_truth) continue;
      const State& state = simulation.state();
      record.truth_t.push_back(kCycle * k);
      record.truth.emplace_back(state.x() + 3e-4 * normal(random), state.y() + 3e-4 * normal(random),
                                state.psi() + 5e-4 * normal(random));
    }
    simulation.take_switches();
    return record;
  }
};

}  // namespace youbot_base_sim
