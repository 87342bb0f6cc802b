// Drives the node's control loop through hours of random commands; prints what must not change. See scripts/study soak.

#include <fmt/format.h>
#include <ros/serialization.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <random>

#include "youbot_base_sim/loop/base_loop.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/ros/telemetry.h"

namespace {

using namespace youbot_base_sim;

constexpr double kHour = 3600;           // s
constexpr int kPeriodsAnHour = 3600000;  // of 1 ms

// KiB that the process may grow after the first hour. A byte kept for each switch would add four times as much a day.
constexpr double kMaxGrowth = 512;

/// Memory that the process holds, KiB.
double resident_memory() {
  long all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return static_cast<double>(resident * sysconf(_SC_PAGESIZE) / 1024);
}

/// Random requests, as a stack might send them.
class RandomStack {
 public:
  explicit RandomStack(unsigned seed) : engine_(seed) {}

  /// Seconds until the next request, in whole control periods.
  double pause() { return 1e-3 * std::round(uniform(50, 4000)); }

  BaseRequest request() {
    const unsigned kind = engine_() % 9;
    if (kind == 8) return engine_() % 2 == 0 ? BaseRequest(SwitchOff()) : BaseRequest(SwitchOn());
    if (kind <= 1) {
      last_ = twist({uniform(-0.6, 0.6), uniform(-0.6, 0.6), uniform(-1.5, 1.5)});
    } else if (kind == 2) {
      last_ = each(DriveMode::kVelocity, 16);
    } else if (kind <= 4) {
      last_ = each(DriveMode::kTorque, 2.5);
    } else if (kind == 5) {
      last_ = twist({0, 0, 0});
    } else if (kind == 6) {
      for (std::optional<SetPoint>& wheel : last_) {
        if (wheel) wheel->value = -wheel->value;
      }
    } else {
      // Torques under which a wheel comes to rest between two rollers, found by a random search.
      last_ = drive_command(DriveMode::kTorque,
                            {-1.6608860541984796, 0.6423426008195765, 1.6391085502068918, 1.12921153639236});
    }
    return last_;
  }

 private:
  double uniform(double low, double high) { return low + (high - low) * (engine_() / 4294967296.0); }

  static DriveCommand twist(const Eigen::Vector3d& velocity) {
    return drive_command(DriveMode::kVelocity, DriverKinematics().wheel_rates(velocity));
  }
  DriveCommand each(DriveMode mode, double size) {
    DriveCommand command;
    for (int i = 0; i < kWheels; ++i) {
      if (engine_() % 8 != 0) command[i] = SetPoint{mode, uniform(-size, size)};  // else it keeps its own
    }
    return command;
  }

  std::mt19937 engine_;
  DriveCommand last_;
};

/// What must be the same for every hour.
struct Hour {
  double cpu = 0;              ///< processor time, s
  double energy_error = 0;     ///< error of the energy balance after the hour, J
  double drive_energy = 0;     ///< that went through the drive trains, either way, J
  std::uint64_t switches = 0;  ///< all of them, counted ones too
  double edge_error = 0;       ///< largest distance of a located switch from its roller boundary, rad
  double edge_allowed = 0;     ///< largest that is allowed, rad
  bool all_switches = true;    ///< the counts add up to the wheels' rotation
};

/// A base in the node's loop, and its record.
class Soak {
 public:
  explicit Soak(unsigned seed)
      : stack_(seed),
        loop_(settings()),
        telemetry_(loop_.simulation().scene(), {}),
        geometry_(loop_.simulation().scene().robot) {}

  Hour hour() {
    Hour hour;
    const std::clock_t start = std::clock();
    const double end = 1e-3 * static_cast<double>(++hours_ * kPeriodsAnHour);
    while (loop_.time() < end - 5e-4) {
      if (loop_.time() > next_request_ - 5e-4) {
        loop_.push(loop_.time(), stack_.request());
        next_request_ = loop_.time() + stack_.pause();
      }
      const std::int64_t periods = loop_.periods_until(std::min({loop_.next_instant(), next_request_, end}));
      loop_.advance_periods(periods);
      hour.drive_energy += std::abs((loop_.simulation().torque() * loop_.simulation().state().dphi()).sum()) *
                           static_cast<double>(periods) * 1e-3;
      const Events events = loop_.take_events();
      for (const RollerSwitch& event : events.switches) add(event, hour);
      if (loop_.meet_instant()) {
        telemetry_.visit(loop_.simulation(), loop_.sensors(), stamp_of(loop_.time()),
                         [](const TopicRow&, const auto& make) { ros::serialization::serializeMessage(make()); });
      }
      loop_.take_driver_events();
    }
    for (int i = 0; i < kWheels; ++i) hour.all_switches &= on_its_roller(i);
    hour.cpu = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    hour.energy_error = loop_.simulation().energy_balance_error();
    return hour;
  }

  const BaseLoop& loop() const { return loop_; }

 private:
  static LoopSettings settings() {
    LoopSettings settings;  // the node's defaults
    settings.scene.solver.control_period = 1e-3;
    settings.scene.solver.relative_tolerance = 1e-5;
    settings.scene.solver.absolute_tolerance = 1e-8;
    settings.scene.solver.keeps_up = true;
    return settings;
  }

  // A switch is located to 1e-12 s, and an angle is known to its last place.
  void add(const RollerSwitch& event, Hour& hour) {
    const auto wheel = static_cast<std::size_t>(event.wheel);
    const std::int64_t before = rollers_[wheel];
    rollers_[wheel] += event.direction * event.count;
    hour.switches += static_cast<std::uint64_t>(event.count);
    if (event.count > 1) return;
    const long double edge = (static_cast<long double>(std::min(before, rollers_[wheel])) + 0.5L) * 2 *
                             3.14159265358979323846264338L / loop_.simulation().scene().robot.rollers;
    hour.edge_error = std::max(hour.edge_error, static_cast<double>(std::abs(event.phi - edge)));
    hour.edge_allowed = std::max(hour.edge_allowed, 1e-12 * 20 + 4e-16 * std::abs(event.phi));
  }

  bool on_its_roller(int i) const {
    const std::int64_t counted = rollers_[static_cast<std::size_t>(i)];
    const std::int64_t stands_on = geometry_.roller_at(loop_.simulation().state().phi()[i]);
    // A wheel at rest between two rollers stands on both.
    return stands_on == counted || (loop_.simulation().other_rollers()[i] && std::abs(stands_on - counted) == 1);
  }

  RandomStack stack_;
  BaseLoop loop_;
  Telemetry telemetry_;
  RollerGeometry geometry_;
  std::array<std::int64_t, kWheels> rollers_{};
  std::int64_t hours_ = 0;
  double next_request_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const int hours = argc > 1 ? std::atoi(argv[1]) : 24;
  if (hours < 1 || hours > 10000) {
    fmt::print(stderr, "soak: HOURS = {}: must be from 1 to 10000\n", argv[1]);
    return 2;
  }
  Soak soak(argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1);
  const Simulation& simulation = soak.loop().simulation();
  bool holds = true;
  double error_before = 0, memory_allowed = 0;
  fmt::print(
      "| hour | times real time | memory, KiB | energy through the drive trains, J | error, J | switches | off their "
      "boundary, rad | largest angle, rad | t - hours, s |\n|---|---|---|---|---|---|---|---|---|\n");
  for (int k = 1; k <= hours; ++k) {
    const Hour hour = soak.hour();
    const double memory = resident_memory(), energy_error = std::abs(hour.energy_error - error_before);
    const double time_error = soak.loop().time() - k * kHour;
    if (k == 1) memory_allowed = memory + kMaxGrowth;
    fmt::print("| {} | {:.0f} | {:.0f} | {:.0f} | {:.1e} | {}{} | {:.1e} | {:.0f} | {:g} |\n", k, kHour / hour.cpu,
               memory, hour.drive_energy, energy_error, hour.switches, hour.all_switches ? "" : ", some lost",
               hour.edge_error, simulation.state().phi().abs().maxCoeff(), time_error);
    std::fflush(stdout);
    holds = holds && simulation.state().values.allFinite() && hour.all_switches &&
            hour.edge_error <= hour.edge_allowed && memory <= memory_allowed && time_error == 0 &&
            energy_error <= simulation.scene().solver.relative_tolerance * hour.drive_energy;
    error_before = hour.energy_error;
  }
  for (const StatisticsField& field : kStatisticsFields)
    fmt::print(stderr, "{}: {}\n", field.text, simulation.statistics().*field.value);
  return holds ? 0 : 1;
}
