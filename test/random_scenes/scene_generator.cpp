#include "scene_generator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <vector>

#include "../physics/random_states.h"
#include "youbot_base_sim/integration/methods.h"

namespace youbot_base_sim {

namespace {

using Json = nlohmann::json;

/// Makes the sections of one scene, in the order in which they decide on each other.
class SceneGenerator {
 public:
  SceneGenerator(std::uint32_t number, std::string table_name) : random_(number), table_name_(std::move(table_name)) {
    for (int k = 0; k < 20; ++k) random_.uniform(0, 1);  // neighbouring seeds begin alike
  }

  RandomScene make() {
    model_ = one_of({"coulomb", "coulomb", "coulomb", "viscous", "no_slip"});
    // A rare scene has what its model refuses.
    limits_friction_ = model_ == "coulomb" || chance(0.01);
    slips_ = model_ != "no_slip" || chance(0.01);
    prescribed_ = slips_ && chance(0.1);
    Json solver = make_solver();
    scene_["model"] = model_;
    scene_["duration"] = duration_;
    if (chance(0.7)) scene_["output_rate"] = log_uniform(2, 1000);
    add("robot", make_robot());
    add("floor", make_floor());
    if (chance(0.2)) scene_["loads"] = list_of(&SceneGenerator::make_load);
    if (chance(0.25)) scene_["wrenches"] = list_of(&SceneGenerator::make_wrench);
    add("initial", make_initial());
    add("solver", solver);
    Json drive = make_drive();
    if (!prescribed_ && chance(drive.contains("velocity_table") ? 0.6 : 0.15)) add("motors", make_motors());
    if (chance(0.03)) scene_["output"]["contacts"] = flag();
    add("drive", drive);
    if (!prescribed_ && !solver.contains("method") && chance(0.01)) scene_["duration"] = log_uniform(2, 60);
    return {text(), table_};
  }

 private:
  bool chance(double probability) { return random_.uniform(0, 1) < probability; }
  bool flag() { return chance(0.5); }
  int whole(int low, int high) { return static_cast<int>(random_.uniform(low, high + 1)); }

  /// Six digits, so that a person can read the file.
  static double rounded(double value) { return std::stod(fmt::format("{:.6g}", value)); }
  double uniform(double low, double high) { return rounded(random_.uniform(low, high)); }
  double log_uniform(double low, double high) {
    return rounded(std::exp(random_.uniform(std::log(low), std::log(high))));
  }
  double around(double value, double factor) { return log_uniform(value / factor, value * factor); }

  const char* one_of(std::initializer_list<const char*> names) {
    return names.begin()[whole(0, static_cast<int>(names.size()) - 1)];
  }

  Json numbers(std::size_t count, double low, double high) {
    Json list = Json::array();
    while (list.size() < count) list.push_back(uniform(low, high));
    return list;
  }

  /// One number of this order of magnitude, or one for each wheel.
  Json for_wheels(double low, double high) {
    if (flag()) return log_uniform(low, high);
    Json list = Json::array();
    while (list.size() < kWheels) list.push_back(log_uniform(low, high));
    return list;
  }

  void add(const char* key, const Json& section) {
    if (!section.empty()) scene_[key] = section;
  }

  Json list_of(Json (SceneGenerator::*make_entry)()) {
    Json list = Json::array();
    for (int count = whole(1, 3); count > 0; --count) list.push_back((this->*make_entry)());
    return list;
  }

  Json make_robot() {
    Json robot;
    if (chance(0.4)) make_masses(robot);
    if (chance(0.4)) make_geometry(robot);
    if (chance(0.25)) robot["profile"] = make_profile();
    make_friction(robot);
    if (chance(0.2)) robot["roller_rate_at_switch"] = one_of({"continuous", "at_rest"});
    if (slips_ && chance(0.1)) robot["contacts"] = one_of({"located", "averaged"});
    if (limits_friction_) make_reactions(robot);
    return robot;
  }

  void make_masses(Json& robot) {
    const double body = around(30, 4), wheel = around(1.4, 3);
    robot["body_mass"] = body;
    robot["wheel_mass"] = wheel;
    robot["total_inertia"] = rounded((0.11 * body + 0.32 * wheel) * random_.uniform(0.7, 1.5));
    if (flag()) robot["wheel_inertia"] = around(5.87e-3, 5);
    if (flag()) robot["roller_inertia"] = chance(0.2) ? 0 : log_uniform(1e-8, 1e-5);
    if (flag()) robot["com"] = numbers(2, -0.06, 0.06);
  }

  void make_geometry(Json& robot) {
    robot["half_wheelbase"] = around(0.235, 1.6);
    robot["half_track"] = around(0.15, 1.6);
    const double radius = around(0.05, 2.5);
    robot["wheel_radius"] = radius;
    const double most = random_.uniform(3, 17);  // 3 to 15, and in one of 14 scenes up to 255
    rollers_ = static_cast<int>(most < 16 ? most : 16 + 240 * (most - 16));
    robot["rollers_per_wheel"] = rollers_;
    if (chance(0.3)) robot["roller_angle"] = for_wheels(20, 70);
    robot["roller_axis_radius"] = rounded(radius * random_.uniform(0.4, 0.98 * std::cos(kPi / rollers_)));
  }

  Json make_profile() {
    if (flag()) return one_of({"paper", "measured"});
    return {{"name", "measured"}, {"friction_scale", log_uniform(0.1, 3)}};
  }

  void make_friction(Json& robot) {
    if (chance(0.2)) robot["wheel_damping"] = chance(0.2) ? Json(0) : for_wheels(1e-3, 1);
    if (chance(0.2)) robot["roller_damping"] = chance(0.2) ? Json(0) : for_wheels(1e-4, 0.05);
    if (chance(0.3)) robot["dry_friction"] = for_wheels(0.01, 2);
    if (chance(0.2)) robot["dry_friction_rate"] = log_uniform(1e-3, 0.3);
    if (chance(0.25)) robot["roller_dry_friction"] = for_wheels(1e-4, 0.2);
    if (chance(0.2)) robot["roller_dry_friction_rate"] = log_uniform(0.01, 10);
  }

  void make_reactions(Json& robot) {
    const bool dynamic = chance(0.35);
    if (dynamic || chance(0.1)) robot["normal_reactions"] = dynamic ? "dynamic" : "static";
    if (dynamic || chance(0.02)) robot["com_height"] = uniform(-0.02, 0.25);
    if (dynamic && flag()) {
      robot["load_sharing"] = one_of({"equal_wheels", "rocking_front", "rocking_rear"});
    } else if (chance(0.2)) {
      robot["diagonal_preload"] = uniform(-30, 30);
    }
  }

  Json make_floor() {
    Json floor;
    if (slips_ && chance(0.5)) floor["friction"] = chance(0.03) ? Json(0) : for_wheels(0.05, 1.5);
    if (chance(0.4)) floor["slip_regularization"] = chance(0.2) ? smallest_regularization() : log_uniform(1e-6, 1e-2);
    if (chance(0.15)) floor["viscous_friction"] = chance(0.05) ? 0 : log_uniform(1e3, 1e6);
    if (chance(0.15)) floor["gravity"] = around(9.81, 3);
    if (chance(0.2)) floor["slope"] = {{"angle", uniform(-0.3, 0.3)}, {"uphill", uniform(-4, 4)}};
    if (chance(0.15)) floor["holding_speed"] = chance(0.2) ? 0 : log_uniform(1e-10, 1e-4);
    if (chance(0.08)) floor["slip_regularization"] = log_uniform(1e-2, 1e3);
    if (limits_friction_ && chance(0.2)) floor["spin_radius"] = log_uniform(1e-4, 1e-2);
    if (limits_friction_ && chance(0.2)) floor["patches"] = list_of(&SceneGenerator::make_patch);
    return floor;
  }

  /// Other methods than radau take hours for a second of the smallest ones.
  double smallest_regularization() { return by_radau_ ? log_uniform(1e-10, 1e-6) : log_uniform(1e-6, 1e-5); }

  Json make_patch() {
    if (chance(0.3)) return make_strip();
    const double x = uniform(-1, 1), y = uniform(-1, 1);
    Json patch = {{"rectangle", {x, y, rounded(x + random_.uniform(0.1, 1)), rounded(y + random_.uniform(0.1, 1))}},
                  {"friction", chance(0.1) ? 0 : log_uniform(0.02, 1.5)}};
    if (flag()) patch["edge"] = log_uniform(1e-3, 0.2);
    return patch;
  }

  /// So thin that the contacts of wheels that spin on the spot pass it.
  Json make_strip() {
    const double y = uniform(0.13, 0.17);
    return {{"rectangle", {-10, y, 10, rounded(y + log_uniform(3e-4, 2e-2))}},
            {"friction", log_uniform(0.02, 5)},
            {"edge", log_uniform(1e-4, 3e-3)}};
  }

  /// When a load or push comes and goes.
  void make_stretch(Json& entry) {
    double start = 0;
    if (chance(0.7)) entry["start"] = start = uniform(0, duration_);
    if (chance(0.7)) entry["end"] = rounded(start + random_.uniform(1e-3, 1) * duration_);
  }

  Json point(double height) { return {uniform(-0.2, 0.2), uniform(-0.15, 0.15), uniform(-0.02, height)}; }

  Json make_load() {
    Json load = {{"mass", log_uniform(0.1, 40)}, {"position", point(0.4)}};
    if (flag()) load["inertia"] = log_uniform(1e-3, 0.5);
    make_stretch(load);
    if (flag()) load["placed"] = one_of({"moving", "at_rest"});
    return load;
  }

  Json make_wrench() {
    Json wrench;
    const double most = log_uniform(1, 300);
    if (chance(0.8)) wrench["force"] = {uniform(-most, most), uniform(-most, most), chance(0.3) ? uniform(-40, 40) : 0};
    if (wrench.empty() || flag()) wrench["torque"] = uniform(-0.2 * most, 0.2 * most);
    if (flag()) wrench["point"] = point(0.2);
    make_stretch(wrench);
    if (flag()) wrench["frame"] = one_of({"platform", "fixed"});
    return wrench;
  }

  Json make_initial() {
    Json initial;
    if (chance(0.5)) initial["pose"] = numbers(3, -1, 1);
    if (chance(0.05)) initial["pose"] = {log_uniform(1, 1e6), -log_uniform(1, 1e6), 0};
    const double speed = log_uniform(0.01, 2);
    if (chance(0.5)) initial["twist"] = numbers(3, -speed, speed);
    if (chance(0.7)) initial["wheel_angles"] = make_wheel_angles();
    const bool fast = chance(0.05);
    if (slips_ && !prescribed_ && chance(0.15))
      initial["wheel_rates"] = numbers(4, fast ? -3000 : -30, fast ? 3000 : 30);
    if (slips_ && chance(0.1)) initial["roller_rates"] = numbers(4, -100, 100);
    return initial;
  }

  /// Anywhere, or exactly on edges between rollers.
  Json make_wheel_angles() {
    if (chance(0.9)) return numbers(4, -4, 4);
    Json angles = Json::array();
    while (angles.size() < kWheels) angles.push_back((2 * whole(-3, 2) + 1) * kPi / rollers_);
    return angles;
  }

  /// Decides the duration too: some methods take a million steps for a second.
  Json make_solver() {
    Json solver = Json::object();
    duration_ = log_uniform(0.4, 2);
    if (chance(0.12)) solver["relative_tolerance"] = log_uniform(1e-8, 1e-3);
    if (chance(0.08)) {
      const double relative = solver.value("relative_tolerance", 3e-7);
      solver["absolute_tolerance"] = log_uniform(1e-5 * relative, 1e-1 * relative);
    }
    if (!prescribed_ && chance(0.06)) {
      const Method& method = methods()[static_cast<std::size_t>(whole(0, static_cast<int>(methods().size()) - 1))];
      solver["method"] = method.name;
      by_radau_ = method.name == "radau";
      if (!by_radau_) duration_ = log_uniform(2e-3, method.is_explicit ? 0.01 : 0.1);
    }
    if (!prescribed_ && chance(0.4))
      solver["control_period"] = flag() ? 1e-3 : chance(0.1) ? 0 : log_uniform(3e-4, 0.1);
    return solver;
  }

  Json make_motors() {
    Json motors;
    if (flag()) motors["velocity_proportional_gain"] = around(0.4, 4);
    if (flag()) motors["velocity_integral_gain"] = around(1.2, 4);
    if (flag()) motors["max_wheel_torque"] = around(3.085, 4);
    if (flag()) motors["max_wheel_rate"] = around(16.21, 3);
    if (chance(0.3)) motors["command_delay"] = log_uniform(1e-4, 0.1);
    if (chance(0.2)) motors["quantized"] = flag();
    if (motors.contains("quantized")) motors["scene_kinematics"] = true;
    return motors;
  }

  Json make_drive() {
    if (prescribed_) {
      Json drive = {{"wheel_angle_table", make_angle_table()}};
      if (flag()) drive["resolution"] = log_uniform(1e-5, 1e-2);
      return drive;
    }
    switch (whole(0, 3)) {
      case 0:
        return {{"reference_motion", make_reference_motion()}};
      case 1:
        return {{"torque", make_torque()}};
      case 2:
        return {{"torque_table", make_table(torque_limit())}};
      default:
        return {{"velocity_table", make_table(log_uniform(0.5, 30))}};
    }
  }

  /// Mostly what motors can exert, at times far beyond what friction can transmit.
  double torque_limit() { return chance(0.15) ? log_uniform(5, 200) : log_uniform(0.05, 5); }

  Json make_reference_motion() {
    Json motion = {{"period", log_uniform(0.1, 30)}};
    for (const char* component : {"V_X", "V_Y", "Omega"}) {
      if (!chance(0.8)) continue;
      for (const char* part : {"constant", "cos", "sin"}) {
        if (flag()) motion[component][part] = uniform(-0.8, 0.8);
      }
    }
    return motion;
  }

  Json make_torque() {
    Json segments = Json::array();
    double start = chance(0.7) ? 0 : uniform(-0.1, 0.3);
    for (int count = whole(1, 4); count > 0; --count, start = rounded(start + random_.uniform(0.01, 0.6))) {
      const double most = torque_limit();
      Json segment = {{"start", start}, {"constant", numbers(4, -most, most)}};
      if (chance(0.15)) segment["constant"] = {most, most, -most, -most};  // wheels spin, the base hardly moves
      for (const char* part : {"cos", "sin"}) {
        if (chance(0.3)) segment[part] = numbers(4, -most, most);
      }
      if (segment.contains("cos") || segment.contains("sin") || chance(0.05))
        segment["period"] = log_uniform(chance(0.2) ? 1e-4 : 0.02, 10);
      segments.push_back(segment);
    }
    return segments;
  }

  /// Rows of up to `most` with pauses between them, into the table. Returns its name.
  std::string make_table(double most) {
    table_ = "t,fl,fr,bl,br\n";
    double t = chance(0.7) ? 0 : uniform(-0.1, 0.1);
    const double pause = log_uniform(0.01, 0.5);
    for (int count = whole(1, 30); count > 0; --count, t = rounded(t + random_.uniform(0.2, 1) * pause)) {
      table_ += fmt::format("{}", t);
      const bool still = chance(0.15);
      for (int i = 0; i < kWheels; ++i) table_ += fmt::format(",{}", still ? 0 : uniform(-most, most));
      table_ += "\n";
    }
    return table_name_;
  }

  /// Rows of wheel angles, to the duration or beyond, as wheels turn that change their rates. Returns the table's name.
  std::string make_angle_table() {
    table_ = "t,fl,fr,bl,br\n";
    const double most = log_uniform(0.1, 10), pause = log_uniform(0.02, 0.3);
    Wheels angle = random_.wheels(-4, 4), rate = Wheels::Zero();
    for (double t = 0, before = 0; before < duration_; before = t, t = rounded(t + pause)) {
      angle += (t - before) * rate;
      rate = 0.7 * rate + random_.wheels(-most, most);
      table_ += fmt::format("{}", t);
      for (int i = 0; i < kWheels; ++i) table_ += fmt::format(",{}", rounded(angle[i]));
      table_ += "\n";
    }
    return table_name_;
  }

  std::string text() const {
    std::string lines;
    for (const auto& [key, value] : scene_.items()) lines += fmt::format("{}: {}\n", key, value.dump());
    return lines;
  }

  Random random_;
  std::string table_name_;
  std::string model_;
  bool limits_friction_ = false, slips_ = false;
  bool prescribed_ = false;  // the wheels' angles
  double duration_ = 0;      // s
  bool by_radau_ = true;
  int rollers_ = 6;
  Json scene_;
  std::string table_;
};

}  // namespace

RandomScene random_scene_file(std::uint32_t number, const std::string& table_name) {
  return SceneGenerator(number, table_name).make();
}

}  // namespace youbot_base_sim
