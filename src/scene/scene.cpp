#include "youbot_base_sim/scene/scene.h"

#include <fmt/format.h>

#include "scene_section.h"
#include "wheel_table.h"
#include "youbot_base_sim/physics/inertia.h"

namespace youbot_base_sim {

namespace {

const char kModelNames[] = "no_slip, viscous or coulomb";

bool find_model(const std::string& name, Model& model) {
  for (const Model candidate : {Model::kNoSlip, Model::kViscous, Model::kCoulomb}) {
    if (name == name_of(candidate)) {
      model = candidate;
      return true;
    }
  }
  return false;
}

RobotParameters read_robot(const SceneSection& s) {
  RobotParameters robot;
  robot.m = s.number("body_mass", robot.m, kPositive);
  robot.m_1 = s.number("wheel_mass", robot.m_1, kPositive);
  robot.I_s = s.number("total_inertia", robot.I_s, kPositive);
  robot.J_1 = s.number("wheel_inertia", robot.J_1, kPositive);
  robot.J_2 = s.number("roller_inertia", robot.J_2, kNotNegative);
  const std::vector<double> com = s.numbers("com", 2, {robot.a_X, robot.a_Y}, kAnyNumber);
  robot.a_X = com[0];
  robot.a_Y = com[1];
  robot.h = s.number("half_wheelbase", robot.h, kPositive);
  robot.l = s.number("half_track", robot.l, kPositive);
  robot.R = s.number("wheel_radius", robot.R, kPositive);
  robot.R_d = s.number("roller_axis_radius", robot.R_d, kPositive);
  robot.rollers = s.whole_number("rollers_per_wheel", robot.rollers, 3, 255);
  robot.mu_1 = s.number_or_wheels("wheel_damping", robot.mu_1, kNotNegative);
  robot.mu_2 = s.number_or_wheels("roller_damping", robot.mu_2, kNotNegative);
  const std::string rate = s.text("roller_rate_at_switch", "continuous");
  if (rate != "continuous" && rate != "at_rest") s.refuse("roller_rate_at_switch", "continuous or at_rest");
  robot.roller_rate_at_switch = rate == "at_rest" ? RollerRateAtSwitch::kAtRest : RollerRateAtSwitch::kContinuous;

  if (robot.R_d >= robot.R) {
    s.refuse("roller_axis_radius", fmt::format("less than wheel_radius, {}", robot.R));
  }
  const double offset = robot.m * robot.m * (robot.a_X * robot.a_X + robot.a_Y * robot.a_Y) / robot.m_s();
  if (robot.I_s <= offset) {
    s.refuse("total_inertia", fmt::format("more than {:.6g}, which body_mass and com alone make up", offset));
  }
  return robot;
}

FloorParameters read_floor(const SceneSection& s) {
  FloorParameters floor;
  floor.f = s.number("friction", floor.f, kNotNegative);
  floor.nu = s.number("slip_regularization", floor.nu, kPositive);
  floor.viscous_friction = s.number("viscous_friction", floor.viscous_friction, kNotNegative);
  floor.g = s.number("gravity", floor.g, kPositive);
  return floor;
}

void check_standing(const SceneSection& robot_section, const RobotParameters& robot, const FloorParameters& floor) {
  const Wheels N = normal_reactions(robot, floor);
  int least = 0;
  if (N.minCoeff(&least) > 0) return;
  robot_section.refuse("com", fmt::format("such that every wheel presses on the floor; {} would with {:.4g} N",
                                          kWheelNames[least], N[least]));
}

SolverSettings read_solver(const SceneSection& file, const SceneOverrides& overrides) {
  const SceneSection s = file.section("solver", {"relative_tolerance", "absolute_tolerance", "control_period"});
  const Range tolerance{1e-14, 0.1, true, "a number from 1e-14 to 0.1"};
  SolverSettings solver;
  solver.relative_tolerance = s.number("relative_tolerance", solver.relative_tolerance, tolerance);
  if (overrides.relative_tolerance >= 0) solver.relative_tolerance = overrides.relative_tolerance;
  solver.absolute_tolerance = s.number("absolute_tolerance", 1e-3 * solver.relative_tolerance, kPositive);
  solver.control_period = s.number("control_period", 0, kNotNegative);
  if (overrides.control_period >= 0) solver.control_period = overrides.control_period;
  return solver;
}

Harmonic read_harmonic(const SceneSection& motion, const std::string& key) {
  const SceneSection s = motion.section(key, {"constant", "cos", "sin"});
  return {s.number("constant", 0, kAnyNumber), s.number("cos", 0, kAnyNumber), s.number("sin", 0, kAnyNumber)};
}

ReferenceMotion read_reference_motion(const SceneSection& drive) {
  const SceneSection s = drive.section("reference_motion", {"period", "V_X", "V_Y", "Omega"});
  s.require("period");
  return {s.number("period", 1, kPositive), read_harmonic(s, "V_X"), read_harmonic(s, "V_Y"),
          read_harmonic(s, "Omega")};
}

TorqueSegments read_torque(const SceneSection& drive) {
  TorqueSegments segments;
  for (const SceneSection& s : drive.sections("torque", {"start", "constant", "cos", "sin", "period"})) {
    s.require("start");
    if (s.has("cos") || s.has("sin")) s.require("period");
    TorqueSegment segment;
    segment.start = s.number("start", 0, kAnyNumber);
    segment.constant = s.wheels("constant", segment.constant, kAnyNumber);
    segment.cos = s.wheels("cos", segment.cos, kAnyNumber);
    segment.sin = s.wheels("sin", segment.sin, kAnyNumber);
    segment.period = s.number("period", segment.period, kPositive);
    if (!segments.empty() && segment.start <= segments.back().start) {
      s.refuse("start", fmt::format("after the start of the piece before, {}", segments.back().start));
    }
    segments.push_back(segment);
  }
  return segments;
}

WheelTable read_table(const SceneSection& drive, const std::string& key, const std::string& scene_path) {
  const std::string name = drive.text(key, "");
  if (name.empty()) drive.refuse(key, "the name of a CSV file");
  const auto slash = scene_path.find_last_of('/');
  const bool absolute = name.front() == '/';
  return read_wheel_table(absolute || slash == std::string::npos ? name : scene_path.substr(0, slash + 1) + name);
}

void read_drive(const SceneSection& file, const std::string& scene_path, Scene& scene) {
  if (!file.has("drive")) return;
  const std::vector<std::string> kinds = {"reference_motion", "torque", "torque_table", "velocity_table"};
  const SceneSection drive = file.section("drive", kinds);
  int given = 0;
  for (const std::string& kind : kinds) given += drive.has(kind);
  if (given != 1) file.refuse("drive", "exactly one of reference_motion, torque, torque_table, velocity_table");

  if (drive.has("reference_motion")) scene.drive = read_reference_motion(drive);
  if (drive.has("torque")) scene.drive = read_torque(drive);
  if (drive.has("torque_table")) scene.drive = read_table(drive, "torque_table", scene_path);
  if (drive.has("velocity_table")) {
    scene.drive = VelocityTable{read_table(drive, "velocity_table", scene_path)};
    // The velocity loop is a sampled one; the driver runs it at 1 kHz.
    if (scene.solver.control_period == 0) scene.solver.control_period = 1e-3;
  }
}

void read_initial(const SceneSection& file, Scene& scene) {
  const SceneSection s = file.section("initial", {"pose", "twist", "wheel_angles", "wheel_rates", "roller_rates"});
  State& x = scene.initial;
  const std::vector<double> pose = s.numbers("pose", 3, {0, 0, 0}, kAnyNumber);
  x.values.col(0) << pose[0], pose[1], pose[2], 0;

  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  if (const auto* motion = std::get_if<ReferenceMotion>(&scene.drive)) v = motion->velocity(0);
  const std::vector<double> twist = s.numbers("twist", 3, {v[0], v[1], v[2]}, kAnyNumber);
  v << twist[0], twist[1], twist[2];
  x.values.col(1) << v.array(), 0;

  const NoSlipModel no_slip(scene.robot);
  x.phi() = s.wheels("wheel_angles", Wheels::Zero(), kAnyNumber);
  x.dphi() = s.wheels("wheel_rates", no_slip.dphi(v), kAnyNumber);
  x.dgamma() = s.wheels("roller_rates", no_slip.dgamma(v), kAnyNumber);
  if (scene.model == Model::kNoSlip) {
    const auto rolls = [](const Wheels& given, const Wheels& rolling) {
      return ((given - rolling).abs() <= 1e-6 * (1 + rolling.abs())).all();
    };
    if (!rolls(x.dphi(), no_slip.dphi(v)))
      s.refuse("wheel_rates", "left out for no_slip, where the twist decides them");
    if (!rolls(x.dgamma(), no_slip.dgamma(v))) {
      s.refuse("roller_rates", "left out for no_slip, where the twist decides them");
    }
    no_slip.constrain(x);
  }
}

Scene read_scene(const std::string& path, const YAML::Node& root, const SceneOverrides& overrides) {
  const SceneSection file(path, "", root,
                          {"model", "duration", "output_rate", "robot", "floor", "initial", "solver", "drive"});
  Scene scene;
  if (!find_model(file.text("model", name_of(scene.model)), scene.model)) file.refuse("model", kModelNames);
  if (!overrides.model.empty()) scene.model = model_from_name(overrides.model);
  file.require("duration");
  scene.duration = file.number("duration", 0, kPositive);
  scene.output_rate = file.number("output_rate", scene.output_rate, kPositive);
  const SceneSection robot =
      file.section("robot", {"body_mass", "wheel_mass", "total_inertia", "wheel_inertia", "roller_inertia", "com",
                             "half_wheelbase", "half_track", "wheel_radius", "roller_axis_radius", "rollers_per_wheel",
                             "wheel_damping", "roller_damping", "roller_rate_at_switch"});
  scene.robot = read_robot(robot);
  scene.floor = read_floor(file.section("floor", {"friction", "slip_regularization", "viscous_friction", "gravity"}));
  check_standing(robot, scene.robot, scene.floor);
  scene.solver = read_solver(file, overrides);
  read_drive(file, path, scene);
  read_initial(file, scene);
  return scene;
}

}  // namespace

const char* name_of(Model model) {
  switch (model) {
    case Model::kNoSlip:
      return "no_slip";
    case Model::kViscous:
      return "viscous";
    default:
      return "coulomb";
  }
}

Model model_from_name(const std::string& name) {
  Model model;
  if (!find_model(name, model)) throw SceneError(fmt::format("model = {}: must be {}", name, kModelNames));
  return model;
}

Scene load_scene(const std::string& path, const SceneOverrides& overrides) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(path);
  } catch (const YAML::BadFile&) {
    throw SceneError(fmt::format("{}: cannot be read; must be a scene file", path));
  } catch (const YAML::Exception& error) {
    throw SceneError(
        fmt::format("{}:{}:{}: is not YAML: {}", path, error.mark.line + 1, error.mark.column + 1, error.msg));
  }
  try {
    return read_scene(path, root, overrides);
  } catch (const YAML::Exception& error) {
    throw SceneError(fmt::format("{}: {}", path, error.what()));
  }
}

std::unique_ptr<TorqueProfile> make_torque_profile(const Scene& scene) {
  struct Maker {
    const Scene& scene;
    std::unique_ptr<TorqueProfile> operator()(std::monostate) { return nullptr; }
    std::unique_ptr<TorqueProfile> operator()(const ReferenceMotion& motion) {
      return std::make_unique<ReferenceTorque>(scene.robot, motion);
    }
    std::unique_ptr<TorqueProfile> operator()(const TorqueSegments& segments) {
      return std::make_unique<PiecewiseTorque>(segments);
    }
    std::unique_ptr<TorqueProfile> operator()(const WheelTable& table) { return std::make_unique<TableTorque>(table); }
    std::unique_ptr<TorqueProfile> operator()(const VelocityTable&) { return nullptr; }
  };
  return std::visit(Maker{scene}, scene.drive);
}

}  // namespace youbot_base_sim
