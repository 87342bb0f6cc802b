#include "youbot_base_sim/record/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/physics/no_slip_model.h"

namespace youbot_base_sim {

namespace {

constexpr double kOffset = 1e-9;     // rad, m/s and rad/s, of the twin's wheels and twist
constexpr double kFixedStep = 1e3;   // tolerances, of a fixed step: as the energy balance allows
constexpr double kLeastPath = 1e-3;  // m, of a robot that hardly moves
constexpr double kRounding = 1e-16;  // m, of each step; of the distance from the fixed frame's origin

Scene twin_of(Scene scene) {
  scene.solver.relative_tolerance *= 0.5;
  scene.solver.absolute_tolerance *= 0.5;
  scene.solver.step = 0.5 * fixed_step(scene.solver);
  scene.initial.phi() += kOffset;
  scene.initial.values.col(1).head<3>() += kOffset;
  if (scene.model == Model::kNoSlip) NoSlipModel(scene.robot).constrain(scene.initial);
  return scene;
}

}  // namespace

double promised_error(const Simulation& simulation, const PathLength& path) {
  const SolverSettings& solver = simulation.scene().solver;
  const bool is_fixed = simulation.scene().model != Model::kNoSlip && fixed_step(solver) > 0;
  const double tolerance = solver.relative_tolerance * (is_fixed ? kFixedStep : 1);
  const double speed = simulation.regularization_speed();
  const RobotParameters& robot = simulation.scene().robot;
  const FloorParameters& floor = simulation.scene().floor;
  // A contact with spin friction creeps on the spot too, as fast at its spin radius.
  const double lever = floor.spin_radius > 0 ? std::max(1.0, std::hypot(robot.h, robot.l) / floor.spin_radius) : 1;
  const double creep = std::isfinite(speed) && speed > floor.nu ? lever * speed * simulation.time() : 0;
  const State& x = simulation.state();
  const double rounding = kRounding * (static_cast<double>(simulation.statistics().steps) + std::hypot(x.x(), x.y()));
  return kPromised * (tolerance * (std::max(path.base, path.wheels.maxCoeff()) + kLeastPath) + creep) + rounding;
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
  simulation_.take_switches();  // which would gather
  simulation_.take_load_changes();
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

}  // namespace youbot_base_sim
