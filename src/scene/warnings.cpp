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
constexpr Unit kMillimetre{"mm", 1e-3}, kCentimetre{"cm", 1e-2}, kGram{"g", 1e-3}, kMillisecond{"ms", 1e-3},
    kNewtonMillimetre{"N mm", 1e-3}, kNewtonCentimetre{"N cm", 1e-2}, kMillimetrePerSecond{"mm/s", 1e-3},
    kDegree{"degrees", M_PI / 180}, kDegreePerSecond{"degrees/s", M_PI / 180}, kRadian{"rad", 180 / M_PI},
    kPercent{"%", 1e-2};

/// Absolute values that a mobile base may have, besides 0, and the units in which others may be given by mistake.
struct Plausible {
  const char* key;
  double (*value)(const Scene& scene);
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

double roller_angle(const Scene& scene) { return scene.robot.roller_angle.abs().minCoeff(); }
double speed(const Scene& scene) { return scene.initial.velocity().head<2>().norm(); }
double command_delay(const Scene& scene) { return scene.motors.value_or(MotorSettings()).command_delay; }

const std::vector<Plausible>& plausible_values() {
  using S = Scene;
  static const std::vector<Unit> lengths = {kMillimetre, kCentimetre};
  static const std::vector<Plausible> table = {
      {"robot.wheel_radius", [](const S& s) { return s.robot.R; }, 0.01, 1, "m", lengths},
      {"robot.roller_axis_radius", [](const S& s) { return s.robot.R_d; }, 0.003, 1, "m", lengths},
      {"robot.half_wheelbase", [](const S& s) { return s.robot.h; }, 0.02, 5, "m", lengths},
      {"robot.half_track", [](const S& s) { return s.robot.l; }, 0.02, 5, "m", lengths},
      {"robot.roller_angle", &roller_angle, 5, 90, "degrees", {kRadian}},
      {"robot.body_mass", [](const S& s) { return s.robot.m; }, 0.1, 5000, "kg", {kGram}},
      {"robot.wheel_mass", [](const S& s) { return s.robot.m_1; }, 0.001, 100, "kg", {kGram}},
      {"initial.pose", [](const S& s) { return s.initial.psi(); }, 0, 6.3, "rad", {kDegree}},
      {"initial.twist", [](const S& s) { return s.initial.Omega(); }, 0, 15, "rad/s", {kDegreePerSecond}},
      {"initial.twist", &speed, 0, 20, "m/s", {kMillimetrePerSecond}},
      {"floor.friction", [](const S& s) { return s.floor.f.maxCoeff(); }, 0, 3, "", {kPercent}},
      {"drive.torque", &largest_torque, 0, 15, "N m", {kNewtonMillimetre, kNewtonCentimetre}},
      {"drive.velocity_table", &largest_rate, 0, 60, "rad/s", {kDegreePerSecond}},
      {"motors.command_delay", &command_delay, 0, 3, "s", {kMillisecond}}};
  return table;
}

/// Asks about values that another unit makes plausible.
void ask_about_units(const Scene& scene, std::vector<std::string>& found) {
  for (const auto& [key, value_of, min, max, unit, others] : plausible_values()) {
    const double value = std::abs(value_of(scene));
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
