#include "youbot_base_sim/offline/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

constexpr double kOffset = 1e-9;      // rad, m/s and rad/s, of the twin's wheels and twist
constexpr double kLeastPath = 1e-3;   // m, of a robot that hardly moves
constexpr double kLeastSpeed = 1e-3;  // m/s, likewise
constexpr double kRounding = 1e-16;   // m, of each step; of the distance from the fixed frame's origin

Scene twin_of(Scene scene) {
  scene.solver.relative_tolerance *= 0.5;
  scene.solver.absolute_tolerance *= 0.5;
  scene.initial.phi() += kOffset;
  scene.initial.values.col(1).head<3>() += kOffset;
  if (scene.model == Model::kNoSlip) NoSlipModel(scene.robot).constrain(scene.initial);
  return scene;
}

/// The largest error of the energy balance, as a share of the energy that the motion had or exchanged.
double allowed_share(const Simulation& simulation) {
  const Scene& scene = simulation.scene();
  const double tolerance = scene.solver.relative_tolerance;
  double share = std::max(std::min(1e3 * tolerance, 1e-3), 10 * tolerance);
  if (std::holds_alternative<std::shared_ptr<const WheelMotion>>(scene.drive)) {
    // Drives of prescribed wheels exert what friction does, which rounding of the slip blurs.
    constexpr double kSlipRounding = 2e-14;  // m/s
    share = std::max(share, kSlipRounding / simulation.regularization_speed());
  }
  return std::clamp(share, 1e-9, 0.1);
}

}  // namespace

double promised_error(const Simulation& simulation, const PathLength& path) {
  const double tolerance = simulation.scene().solver.relative_tolerance;
  const double speed = simulation.regularization_speed();
  const RobotParameters& robot = simulation.scene().robot;
  const FloorParameters& floor = simulation.scene().floor;
  // A contact with spin friction creeps on the spot too, as fast at its spin radius.
  const double lever = floor.spin_radius > 0 ? std::max(1.0, std::hypot(robot.h, robot.l) / floor.spin_radius) : 1;
  const double creep = std::isfinite(speed) && speed > floor.nu ? lever * speed * simulation.time() : 0;
  const State& x = simulation.state();
  const double rounding = kRounding * (static_cast<double>(simulation.statistics().steps) + std::hypot(x.x(), x.y()));
  const double distance = std::max({path.base, path.wheels.maxCoeff(), simulation.statistics().drift});
  return kPromised * (tolerance * (distance + kLeastPath) + creep) + rounding;
}

Twin::Twin(const Scene& scene) : simulation_(twin_of(scene)), rows_(simulation_) {}

void Twin::follow(const Simulation& run) {
  if (!ending_.empty()) return;
  try {
    simulation_.advance_to(0.5 * (simulation_.time() + run.time()));
    if (!rows_.next()) return;
  } catch (const Stopped&) {
    throw;
  } catch (const std::exception& error) {
    ending_ = error.what();
    return;
  }
  simulation_.take_events();  // they would gather
  const State &x = simulation_.state(), &other = run.state();
  const RobotParameters& robot = simulation_.scene().robot;
  const double position = std::hypot(x.x() - other.x(), x.y() - other.y()), heading = std::abs(x.psi() - other.psi());
  position_ = std::max(position_, position);
  heading_ = std::max(heading_, heading);
  distance_ = std::max(distance_, std::hypot(position, std::hypot(robot.h, robot.l) * heading));
}

std::string Twin::doubt(const Simulation& run, const PathLength& path) const {
  if (!ending_.empty()) return fmt::format("a twin at half the tolerance ended early: {}", ending_);
  const double promised = promised_error(run, path);
  if (distance_ <= promised) return "";
  return fmt::format(
      "a twin at half the tolerance parts from it by {:.2g} m and {:.2g} rad, where {:.2g} m are allowed", position_,
      heading_, promised);
}

std::string unreliability_reason(const Simulation& simulation, const RowLoop& rows, const Twin* twin) {
  if (const std::uint64_t steps = simulation.statistics().fallback_steps) {
    return fmt::format("{} fallback steps, of first order, went on where the bound of work was reached", steps);
  }
  const double promised = promised_error(simulation, rows.path());
  // The speed that wheels gave the base which were held while their momentum counted dies down: in the motions tried it
  // moved the base as far as it would in 0.002 to 1 s.
  const double moved = simulation.statistics().forced_hold_speed * std::min(simulation.time(), 1.0);
  if (moved > promised) {
    return fmt::format(
        "wheels that had not stopped chattering between two rollers were made to rest on both: the base may be off by "
        "{:.2g} m, where {:.2g} m are allowed",
        moved, promised);
  }
  const Scene& scene = simulation.scene();
  const EnergyAudit& energy = rows.energy();
  // The scale includes the energy of a speed that friction can give the base unseen between two rows.
  const double speed = kLeastSpeed + scene.floor.f.maxCoeff() * scene.floor.g * energy.longest_interval;
  const double exchanged = std::max(energy.max_kinetic_energy, energy.drive_work);
  const double allowed = allowed_share(simulation) * (exchanged + 0.5 * scene.robot.m_s() * speed * speed);
  if (energy.max_balance_error <= allowed && std::isfinite(exchanged))
    return twin ? twin->doubt(simulation, rows.path()) : "";
  return fmt::format("the energy balance is off by {:.2g} J of {:.2g} J, where {:.2g} J are allowed",
                     energy.max_balance_error, exchanged, allowed);
}

}  // namespace youbot_base_sim
