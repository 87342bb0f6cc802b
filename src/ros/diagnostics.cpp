#include "youbot_base_sim/ros/diagnostics.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <fmt/format.h>

#include "youbot_base_sim/ros/conversions.h"

namespace youbot_base_sim {

namespace {

using diagnostic_updater::DiagnosticStatusWrapper;

DiagnosticStatusWrapper driver_status(const std::string& name, bool ok, const std::string& message) {
  DiagnosticStatusWrapper status;
  status.name = name;
  status.summary(ok ? status.OK : status.ERROR, message);
  return status;
}

/// With the warning, or, where that is empty, the message `good`.
DiagnosticStatusWrapper own_status(const std::string& subject, const std::string& warning, const std::string& good) {
  DiagnosticStatusWrapper status = driver_status("youbot_base_sim: " + subject, true, good);
  status.hardware_id = "simulation";
  if (!warning.empty()) status.summary(status.WARN, warning);
  return status;
}

std::string motor_status_text(const BaseDriver& driver, int i) {
  if (driver.faults().silent[i] || driver.faults().ethercat_lost) return "does not answer";
  const auto [mode, value] = driver.set_points()[i];
  if (mode == DriveMode::kOff) return "motor off";
  return fmt::format("{} {:.4g} {}", text_of(mode).name, value, text_of(mode).unit);
}

DiagnosticStatusWrapper wheels_status(const BaseDriver& driver, const Simulation& simulation) {
  DiagnosticStatusWrapper status = own_status("wheels", driver.timed_out() ? "stopped: no command for too long" : "",
                                              driver.motors_on() ? "motors on" : "motors off");
  const auto rollers = simulation.rollers();
  const auto others = simulation.other_rollers();
  for (int i = 0; i < kWheels; ++i) {
    const std::string stands = others[i] ? fmt::format("between rollers {} and {}", rollers[i], *others[i])
                                         : fmt::format("on roller {}", rollers[i]);
    status.add(wheel_joint(i), motor_status_text(driver, i) + ", " + stands);
    status.add(wheel_joint(i) + " set point (N m or rad/s)", driver.set_points()[i].value);
    status.add(wheel_joint(i) + " roller", rollers[i]);
  }
  return status;
}

DiagnosticStatusWrapper faults_status(const Faults& faults) {
  DiagnosticStatusWrapper status = own_status("faults", faults.any() ? "faults are simulated" : "", "none");
  if (faults.ethercat_lost) status.add("EtherCAT", "lost");
  for (int i = 0; i < kWheels; ++i) {
    if (faults.silent[i]) status.add(wheel_joint(i), "does not answer");
    const double slip = faults.encoder_slip[i];
    if (slip != 0) status.add(wheel_joint(i) + " share of each turn that its encoder misses", slip);
  }
  if (faults.encoder_noise != 0) status.add("encoder noise (rad)", faults.encoder_noise);
  if (faults.command_delay != 0) status.add("command delay (s)", faults.command_delay);
  return status;
}

DiagnosticStatusWrapper integration_status(const Simulation& simulation) {
  const IntegrationStatistics& statistics = simulation.statistics();
  DiagnosticStatusWrapper status =
      own_status("integration", statistics.fallback_steps == 0 ? "" : "fallback steps, of first order, were needed",
                 statistics.eased_periods == 0 ? "accurate" : "accurate, but wheels that chatter were held early");
  status.add("model", name_of(simulation.scene().model));
  status.add("method", simulation.method());
  status.add("regularization speed (m/s)", simulation.regularization_speed());
  status.add("relative tolerance", simulation.scene().solver.relative_tolerance);
  status.addf("simulated time (s)", "%.9g", simulation.time());
  for (const StatisticsField& field : kStatisticsFields) status.add(field.text, statistics.*field.value);
  status.addf("energy balance error (J)", "%.2g", simulation.energy_balance_error());
  return status;
}

DiagnosticStatusWrapper reactions_status(const ReactionRecord& record) {
  DiagnosticStatusWrapper status = own_status("normal reactions", "", "every wheel presses or lifts without tipping");
  if (record.tipped != Side::kNone) {
    const bool now = record.tipping != Side::kNone;
    const std::string what =
        record.tipped == Side::kOff
            ? "lifted off the floor"
            : fmt::format("at its tipping limit, on the wheels of the {} side", name_of(record.tipped));
    status.summary(now ? status.ERROR : status.WARN, (now ? "the base is " : "the base was ") + what);
  }
  for (int i = 0; i < kWheels; ++i) {
    status.addf(wheel_joint(i) + " minimum (N)", "%.4g", record.min_N[i]);
    status.addf(wheel_joint(i) + " off the floor (s)", "%.3g", record.time_off_floor[i]);
  }
  status.addf("at the tipping limit (s)", "%.3g", record.time_at_limit);
  return status;
}

DiagnosticStatusWrapper timing_status(const LoopTiming::Report& timing) {
  DiagnosticStatusWrapper status =
      own_status("loop", timing.lost == 0 ? "" : "too slow for the requested rate", "in time");
  status.add("instants", timing.instants);
  status.addf("mean lateness (us)", "%.1f", 1e6 * timing.lateness);
  status.addf("max lateness (us)", "%.1f", 1e6 * timing.max_lateness);
  status.addf("speed (times real time)", "%.3g", timing.speed);
  status.addf("busy (% of the time)", "%.1f", 100 * timing.busy);
  status.addf("lost (s)", "%.3g", timing.lost);
  return status;
}

}  // namespace

diagnostic_msgs::DiagnosticArray diagnostics_message(const BaseDriver& driver, const Simulation& simulation,
                                                     const LoopTiming::Report& timing, const std::string& waits_for,
                                                     const std::map<std::string, std::string>& counters,
                                                     bool arm_missed, const ros::Time& stamp) {
  diagnostic_msgs::DiagnosticArray message;
  message.header.stamp = stamp;
  const bool base = driver.present(), bus = !driver.faults().ethercat_lost;
  message.status = {
      // the first three in the driver's words
      driver_status("platform_Base", base, base ? "base is present" : "base is not connected or switched off"),
      driver_status("platform_Arm", !arm_missed, "arm is not connected or switched off"),
      driver_status("platform_EtherCAT", bus,
                    bus ? "EtherCAT connnection is established" : "EtherCAT connnection lost"),
      wheels_status(driver, simulation),
      faults_status(driver.faults()),
      integration_status(simulation),
      timing_status(timing)};
  if (const auto record = simulation.reaction_record()) message.status.push_back(reactions_status(*record));
  DiagnosticStatusWrapper time = own_status("time", waits_for, "advances");
  for (const auto& [name, value] : counters) time.add(name, value);
  message.status.push_back(time);
  return message;
}

diagnostic_msgs::DiagnosticStatus bag_status(const std::string& path, const std::string& failure) {
  DiagnosticStatusWrapper status = own_status("bag", "", "is being written");
  if (!failure.empty()) status.summary(status.ERROR, failure);
  status.add("file", path);
  return status;
}

#ifdef YOUBOT_BASE_SIM_PR2_MSGS
pr2_msgs::PowerBoardState dashboard_message(const BaseDriver& driver, const ros::Time& stamp) {
  using pr2_msgs::PowerBoardState;
  PowerBoardState message;
  message.header.stamp = stamp;
  message.circuit_state[0] = !driver.present()    ? PowerBoardState::STATE_DISABLED
                             : driver.motors_on() ? PowerBoardState::STATE_ENABLED
                                                  : PowerBoardState::STATE_STANDBY;
  message.circuit_state[1] = PowerBoardState::STATE_DISABLED;
  message.run_stop = driver.faults().ethercat_lost;
  return message;
}
#endif

}  // namespace youbot_base_sim
