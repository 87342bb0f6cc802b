#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <utility>

#include "youbot_base_sim/drive/control_time.h"
#include "youbot_base_sim/drive/faults.h"
#include "youbot_base_sim/drive/motor.h"
#include "youbot_base_sim/export.h"

namespace YOUBOT_BASE_SIM_EXPORT youbot_base_sim {

/// A set point for each wheel that the command names; the other wheels keep theirs.
using DriveCommand = std::array<std::optional<SetPoint>, kWheels>;

/// One for all wheels: torques, N m, or rates, rad/s.
inline DriveCommand drive_command(DriveMode mode, const Wheels& values) {
  DriveCommand command;
  for (int i = 0; i < kWheels; ++i) command[i] = SetPoint{mode, values[i]};
  return command;
}

/// The driver's connection to its base. It gives the base up when EtherCAT has failed for longer than its
/// time-out, and finds it again only by a reconnect while the cable is in. Times are simulated time, s.
class EthercatConnection {
 public:
  /// The driver's MaximumNumberOfEtherCATErrors in cycles of 1 ms; also the firmware's MotorControllerTimeout, s.
  static constexpr double kTimeout = 0.1;

  /// True if the base was there at the last `update`.
  bool present() const { return present_; }

  /// Looks at time t whether the base is still there, as the driver does in each of its cycles.
  bool update(double t) { return present_ = present_ && !ControlTime::reached(lost_since_ + kTimeout, t); }

  /// The cable comes out at time t, or is in again.
  void set_lost(double t, bool lost) {
    update(t);
    lost_since_ = lost ? std::min(lost_since_, t) : kInfinity;
  }

  /// Starts anew. False if the cable is still out: then the base is not there.
  bool reconnect() { return present_ = lost_since_ == kInfinity; }

 private:
  bool present_ = true;
  double lost_since_ = kInfinity;  // infinite: the cable is in
};

/// The base driver without ROS, which behaves like the real one as far as its sources show. It sends set points over
/// EtherCAT every 1 ms, forever if no command follows, and loses the base when EtherCAT fails. Times are simulated, s.
class BaseDriver {
 public:
  struct Settings {
    double control_period = 1e-3;  ///< s
    Motor motor;                   ///< as the driver's configuration file has it
    MotorSettings motors;          ///< limits of that motor and the like; a fault adds to the delay of commands
    double command_timeout = 0;    ///< the wheels stop after this time without a command, s; 0: never, as the driver

    /// True if EtherCAT carries whole rpm, mA and encoder ticks, as it does unless `motors` says otherwise.
    bool quantized() const { return motors.quantized.value_or(true); }
  };

  /// The base is present; its motors are on and keep its wheels at rest.
  explicit BaseDriver(const Settings& settings);

  /// Takes a command that arrives at time t, which switches its motors on; without effect if the base is not present.
  void command(double t, const DriveCommand& command);

  /// Switches the motors off, so that the wheels rotate freely. False if the base is not present.
  bool switch_off();

  /// Switches the motors on to hold the wheels at rest. False if the base is not present.
  bool switch_on();

  /// Restarts the driver with the motors on and the wheels held at rest. False, without the base, if EtherCAT is lost.
  bool reconnect();

  /// Replaces the faults at time t.
  void set_faults(double t, const Faults& faults);
  const Faults& faults() const { return faults_; }

  /// Torque at each wheel, N m, for the control period that begins at time t with wheel rates `dphi` (rad/s).
  const Wheels& sample(double t, const Wheels& dphi);

  /// The last sample, N m.
  const Wheels& torque() const { return torque_; }

  const EthercatConnection& connection() const { return connection_; }
  bool present() const { return connection_.present(); }  ///< the base, in the driver's eyes
  bool motors_on() const { return motors_on_; }  ///< what the driver's dashboard shows: only its services change it
  bool timed_out() const { return timed_out_; }  ///< stopped because no command arrived in time
  const Motor& motor() const { return motor_; }  ///< with its limits

  /// Events in `sample` since the last `take_events`.
  struct Events {
    bool base_lost = false;  ///< EtherCAT has failed for too long
    bool timed_out = false;  ///< the wheels were stopped because no command arrived in time
  };
  Events take_events() { return std::exchange(events_, {}); }

  /// The present set points of the motors.
  const std::array<SetPoint, kWheels>& set_points() const { return drive_.set_points(); }

 private:
  struct Pending {
    double due;
    DriveCommand command;
  };

  bool responds(int i) const { return !faults_.ethercat_lost && !faults_.silent[i]; }
  void send_to_all(const SetPoint& set_point) { sent_.fill(set_point); }
  void apply_due_commands(double t);
  void check_command_timeout(double t);
  void exchange_ethercat(double t);

  Settings settings_;
  Motor motor_;  // with its limits
  WheelDrive drive_;
  Faults faults_;
  EthercatConnection connection_;
  bool motors_on_ = true;
  bool timed_out_ = false;
  std::array<SetPoint, kWheels> sent_;  // what the driver sends in each of its cycles
  std::deque<Pending> pending_;         // commands that arrive later
  Events events_;
  double last_command_;
  std::array<double, kWheels> silent_since_;  // infinite: responds
  Wheels torque_ = Wheels::Zero();            // of the motors, N m
};

}  // namespace youbot_base_sim
