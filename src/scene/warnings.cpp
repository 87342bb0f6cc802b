#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/integration/rest_friction.h"
#include "youbot_base_sim/physics/roller_geometry.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

namespace {

struct Unit {
  const char* name;
  double size;  // in the key's unit
};

/// A value of a scene, what its absolute value is in mobile bases, besides 0, and units in which it may be by mistake.
struct Plausible {
  const char* key;
  double value;
  double min, max;
  const char* unit;
  std::vector<Unit> others;
};

double largest(const std::vector<Wheels>& rows) {
  double most = 0;
  for (const Wheels& row : rows) most = std::max(most, row.abs().maxCoeff());
  return most;
}

double largest_torque(const Scene& scene) {
  if (const auto* table = std::get_if<WheelTable>(&scene.drive)) return largest(table->values);
  const auto* segments = std::get_if<TorqueSegments>(&scene.drive);
  std::vector<Wheels> rows;
  for (const TorqueSegment& s : segments ? *segments : TorqueSegments())
    rows.insert(rows.end(), {s.constant, s.cos, s.sin});
  return largest(rows);
}

double largest_rate(const Scene& scene) {
  const auto* rates = std::get_if<VelocityTable>(&scene.drive);
  return rates ? largest(rates->table.values) : 0;
}

/// Asks about values that another unit makes plausible.
void ask_about_units(const Scene& scene, std::vector<std::string>& found) {
  const RobotParameters& robot = scene.robot;
  const double speed = scene.initial.velocity().head<2>().norm();
  const double command_delay = scene.motors.value_or(MotorSettings()).command_delay;
  const std::vector<Unit> lengths = {{"mm", 1e-3}, {"cm", 1e-2}};
  constexpr double kDegree = M_PI / 180;
  const std::vector<Plausible> table = {
      {"robot.wheel_radius", robot.R, 0.01, 1, "m", lengths},
      {"robot.roller_axis_radius", robot.R_d, 0.003, 1, "m", lengths},
      {"robot.half_wheelbase", robot.h, 0.02, 5, "m", lengths},
      {"robot.half_track", robot.l, 0.02, 5, "m", lengths},
      {"robot.roller_angle", robot.roller_angle.abs().minCoeff(), 5, 90, "degrees", {{"rad", 1 / kDegree}}},
      {"robot.body_mass", robot.m, 0.1, 5000, "kg", {{"g", 1e-3}}},
      {"robot.wheel_mass", robot.m_1, 0.001, 100, "kg", {{"g", 1e-3}}},
      {"initial.pose", scene.initial.psi(), 0, 6.3, "rad", {{"degrees", kDegree}}},
      {"initial.twist", scene.initial.Omega(), 0, 15, "rad/s", {{"degrees/s", kDegree}}},
      {"initial.twist", speed, 0, 20, "m/s", {{"mm/s", 1e-3}}},
      {"floor.friction", scene.floor.f.maxCoeff(), 0, 3, "", {{"%", 1e-2}}},
      {"drive.torque", largest_torque(scene), 0, 15, "N m", {{"N mm", 1e-3}, {"N cm", 1e-2}}},
      {"drive.velocity_table", largest_rate(scene), 0, 60, "rad/s", {{"degrees/s", kDegree}}},
      {"motors.command_delay", command_delay, 0, 3, "s", {{"ms", 1e-3}}}};
  for (const auto& [key, signed_value, min, max, unit, others] : table) {
    const double value = std::abs(signed_value);
    const auto fits = [min = min, max = max](double x) { return x == 0 || (x >= min && x <= max); };
    const auto meant = std::find_if(others.begin(), others.end(), [&](const Unit& u) { return fits(value * u.size); });
    if (fits(value) || meant == others.end()) continue;
    const std::string of = *unit ? fmt::format(" {}", unit) : "";
    found.push_back(fmt::format("{} has {:g}{}, where {:g} to {:g}{} are usual: is it in {}, {:.4g}{}?", key, value, of,
                                min, max, of, meant->name, value * meant->size, of));
  }
}

void check_geometry(const RobotParameters& robot, std::vector<std::string>& found) {
  const double end_radius = RollerGeometry(robot).end_radius();
  if (end_radius >= 0) return;
  found.push_back(fmt::format(
      "robot.roller_axis_radius = {:g}: {} rollers on a wheel taper to a point before they meet, where their radius is "
      "{:.3g} m; those of a wheel that could be built have at most {:.4g} m",
      robot.R_d, robot.rollers, end_radius, robot.R * std::cos(M_PI / robot.rollers)));
}

void find_without_effect(const Scene& scene, std::vector<std::string>& found) {
  const FloorParameters& floor = scene.floor;
  const bool holds = limits_friction(scene.model) && floor.holding_speed < std::min(floor.nu, RestFriction::kSlow);
  if (floor.holding_speed > 0 && !(holds && !find_method(scene.solver.method)->is_explicit)) {
    found.push_back(fmt::format(
        "floor.holding_speed = {:g}: has no effect but on limited friction, below slip_regularization = {:g} "
        "and {:g} m/s, by a method that is not explicit",
        floor.holding_speed, floor.nu, RestFriction::kSlow));
  }
  if (scene.robot.normal_reactions != NormalReactions::kDynamic) {
    constexpr char kWhy[] = "has no effect unless robot.normal_reactions is dynamic";
    if (scene.robot.a_Z != 0) found.push_back(fmt::format("robot.com_height = {:g}: {}", scene.robot.a_Z, kWhy));
    const auto& wrenches = scene.load_schedule.wrenches;
    for (std::size_t k = 0; k < wrenches.size(); ++k) {
      const double up = wrenches[k].wrench.force.z();
      if (up == 0) continue;
      found.push_back(fmt::format("wrenches[{}].force: its vertical part, {:g} N, {}", k, up, kWhy));
      break;
    }
  }
}

}  // namespace

std::vector<std::string> warnings_of(const Scene& scene) {
  std::vector<std::string> found;
  ask_about_units(scene, found);
  check_geometry(scene.robot, found);
  find_without_effect(scene, found);
  const double duration = scene.duration > 0 ? scene.duration : 1;
  const std::string advised = advice(scene.robot, scene.floor, scene.model, scene.solver, duration);
  if (!advised.empty()) found.push_back(advised);
  return found;
}

}  // namespace youbot_base_sim
