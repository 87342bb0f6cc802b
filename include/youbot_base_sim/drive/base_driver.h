#pragma once

#include <array>
#include <deque>
#include <optional>
#include <utility>

#include "youbot_base_sim/drive/dry_friction.h"
#include "youbot_base_sim/drive/ethercat_connection.h"
#include "youbot_base_sim/drive/faults.h"
#include "youbot_base_sim/drive/motor_sensors.h"
#include "youbot_base_sim/drive/wheel_drive.h"

namespace youbot_base_sim {

/// A set point for each wheel that a command names; the others keep theirs.
using DriveCommand = std::array<std::optional<SetPoint>, kWheels>;

/// The base driver without ROS: it keeps the set points of the four motors and sends them over EtherCAT once a cycle
/// of 1 ms, for ever if no command follows; it switches motors on and off, and loses the base when EtherCAT fails. What
/// the driver and the motors do at each of these is what the real ones do, as far as their sources tell.
///
/// Times are simulated time, s.
class BaseDriver {
 public:
  struct Settings {
    double control_period = 1e-3;  ///< s
    Motor motor;
    VelocityGains gains;
    bool quantized = true;       ///< set points and readings as EtherCAT carries them, else exact
    double dry_friction = 0;     ///< N m a wheel
    double wheel_inertia = 0;    ///< J_1, which dry friction needs, kg m^2
    double command_timeout = 0;  ///< s without a command after which the wheels are stopped; 0: never, as the driver
  };

  /// The base is present, its motors are on and keep its wheels, which are at angles phi (rad), at rest.
  BaseDriver(const Settings& settings, const Wheels& phi);

  /// Takes a command that arrives at time t. Has no effect if the base is not present. Motors that were off are on
  /// again, as the driver's.
  void command(double t, const DriveCommand& command);

  /// Lets the wheels turn freely: no current. False if the base is not present.
  bool switch_off();

  /// Has the motors keep the wheels at rest. False if the base is not present.
  bool switch_on();

  /// Starts the driver anew, with the motors on and the wheels kept at rest. False if EtherCAT is still lost: then the
  /// base is not present.
  bool reconnect();

  void set_faults(double t, const Faults& faults);
  const Faults& faults() const { return faults_; }

  /// Torque on the wheels, motors and dry friction, for the control period that begins at time t with rates `dphi`
  /// (rad/s), N m.
  Wheels sample(double t, const Wheels& dphi);

  /// Reads the motors of wheels at angles phi (rad) and rates dphi (rad/s).
  const MotorReadings& read(const Wheels& phi, const Wheels& dphi) {
    return faulty_ ? read_faulty(phi, dphi) : sensors_.read(phi, dphi, torque_);
  }

  /// The readings of before.
  const MotorReadings& readings() const { return sensors_.readings(); }

  const EthercatConnection& connection() const { return connection_; }
  bool present() const { return connection_.present(); }  ///< the base, in the driver's eyes
  bool motors_on() const { return motors_on_; }  ///< what the driver's dashboard shows: only its services change it
  bool timed_out() const { return timed_out_; }  ///< stopped for want of commands
  const Motor& motor() const { return settings_.motor; }

  /// What has happened in `sample` since the last `take_events`.
  struct Events {
    bool base_lost = false;  ///< EtherCAT has failed for too long
    bool timed_out = false;  ///< the wheels were stopped for want of commands
  };
  Events take_events() { return std::exchange(events_, {}); }

  /// What each motor does now.
  const std::array<SetPoint, kWheels>& set_points() const { return drive_.set_points(); }

 private:
  struct Pending {
    double due;
    DriveCommand command;
  };

  bool answers(int i) const { return !faults_.ethercat_lost && !faults_.silent[i]; }
  void keep_all(const SetPoint& set_point) { sent_.fill(set_point); }
  void take_pending(double t);
  void watch(double t);
  void exchange(double t);
  SetPoint carried(const SetPoint& set_point) const;
  const MotorReadings& read_faulty(const Wheels& phi, const Wheels& dphi);

  Settings settings_;
  WheelDrive drive_;
  DryFriction friction_;
  MotorSensors sensors_;
  Faults faults_;
  bool faulty_ = false;  // faults_.any()
  EthercatConnection connection_;
  bool motors_on_ = true;
  bool timed_out_ = false;
  std::array<SetPoint, kWheels> sent_;  // what the driver sends in each of its cycles, as EtherCAT carries it
  std::deque<Pending> pending_;         // commands that arrive later
  Events events_;
  double last_command_;
  std::array<double, kWheels> silent_since_;  // infinite: answers
  Wheels torque_ = Wheels::Zero();            // of the motors, N m
};

}  // namespace youbot_base_sim
