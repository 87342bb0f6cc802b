#include "youbot_base_sim/scene/scene.h"

#include <fmt/format.h>

#include <filesystem>

#include "scene_section.h"
#include "wheel_table.h"
#include "youbot_base_sim/integration/methods.h"

namespace youbot_base_sim {

namespace {

constexpr Named<Model> kModels[] = {
    {"no_slip", Model::kNoSlip}, {"viscous", Model::kViscous}, {"coulomb", Model::kCoulomb}};

constexpr Named<RollerRateAtSwitch> kRollerRates[] = {{"continuous", RollerRateAtSwitch::kContinuous},
                                                      {"at_rest", RollerRateAtSwitch::kAtRest}};

[[noreturn]] void refuse_override(const char* name, const std::string& value, const std::vector<std::string>& allowed) {
  throw SceneError(fmt::format("{} = {}: must be {}", name, value, alternatives(allowed)));
}

/// `floor` decides whether all four wheels press on it.
RobotParameters read_robot(SceneSection s, const FloorParameters& floor) {
  RobotParameters robot;
  s["body_mass"].number(robot.m, kPositive);
  s["wheel_mass"].number(robot.m_1, kPositive);
  const SceneValue inertia = s["total_inertia"];
  inertia.number(robot.I_s, kPositive);
  s["wheel_inertia"].number(robot.J_1, kPositive);
  const SceneValue roller_inertia = s["roller_inertia"];
  roller_inertia.number(robot.J_2, kNotNegative);
  const SceneValue com = s["com"];
  Eigen::Array2d a{robot.a_X, robot.a_Y};
  com.numbers(a, kAnyNumber);
  robot.a_X = a[0];
  robot.a_Y = a[1];
  s["half_wheelbase"].number(robot.h, kPositive);
  s["half_track"].number(robot.l, kPositive);
  s["wheel_radius"].number(robot.R, kPositive);
  const SceneValue axis_radius = s["roller_axis_radius"];
  axis_radius.number(robot.R_d, kPositive);
  s["rollers_per_wheel"].whole_number(robot.rollers, 3, 255);
  s["wheel_damping"].number_or_wheels(robot.mu_1, kNotNegative);
  s["roller_damping"].number_or_wheels(robot.mu_2, kNotNegative);
  s["roller_rate_at_switch"].choice(robot.roller_rate_at_switch, kRollerRates);
  s.finish();

  if (robot.J_2 == 0 && robot.mu_2.minCoeff() == 0 && (floor.f == 0 || floor.viscous_friction == 0)) {
    roller_inertia.refuse("a finite number > 0 where neither friction nor roller_damping holds the rollers");
  }
  if (robot.R_d >= robot.R) axis_radius.refuse(fmt::format("less than wheel_radius, {}", robot.R));
  const double offset = robot.m * robot.m * a.square().sum() / robot.m_s();
  if (robot.I_s <= offset) {
    inertia.refuse(fmt::format("more than {:.6g}, which body_mass and com alone make up", offset));
  }
  const Wheels N = normal_reactions(robot, floor);
  int lightest = 0;
  if (N.minCoeff(&lightest) <= 0) {
    com.refuse(fmt::format("such that every wheel presses on the floor; {} would with {:.4g} N", kWheelNames[lightest],
                           N[lightest]));
  }
  return robot;
}

FloorParameters read_floor(SceneSection s) {
  FloorParameters floor;
  s["friction"].number(floor.f, kNotNegative);
  s["slip_regularization"].number(floor.nu, kPositive);
  s["viscous_friction"].number(floor.viscous_friction, kNotNegative);
  s["gravity"].number(floor.g, kPositive);
  s.finish();
  return floor;
}

/// `model` and `robot` decide what the method must be able to do.
SolverSettings read_solver(SceneSection s, const SceneOverrides& overrides, Model model, const RobotParameters& robot) {
  SolverSettings solver;
  const SceneValue method = s["method"];
  method.choice(solver.method, method_names());
  if (!overrides.method.empty()) {
    if (!find_method(overrides.method)) refuse_override("method", overrides.method, method_names());
    solver.method = overrides.method;
  }
  const SceneValue step = s["step"];
  step.number(solver.step, kPositive);
  if (step.given() && overrides.method.empty() && find_method(solver.method)->default_step == 0) {
    step.refuse("left out for a method with step size control, " + solver.method);
  }
  s["relative_tolerance"].number(solver.relative_tolerance, {1e-14, 0.1, true, "a number from 1e-14 to 0.1"});
  if (overrides.relative_tolerance >= 0) solver.relative_tolerance = overrides.relative_tolerance;
  solver.absolute_tolerance = 1e-3 * solver.relative_tolerance;
  s["absolute_tolerance"].number(solver.absolute_tolerance, kPositive);
  s["control_period"].number(solver.control_period, kNotNegative);
  if (overrides.control_period >= 0) solver.control_period = overrides.control_period;
  s.finish();
  const std::string reason = refusal(*find_method(solver.method), robot, model);
  if (!reason.empty() && overrides.method.empty()) method.refuse(reason);
  if (!reason.empty()) throw SceneError(fmt::format("method = {}: must be {}", solver.method, reason));
  return solver;
}

Harmonic read_harmonic(SceneSection s) {
  Harmonic harmonic;
  s["constant"].number(harmonic.constant, kAnyNumber);
  s["cos"].number(harmonic.cos, kAnyNumber);
  s["sin"].number(harmonic.sin, kAnyNumber);
  s.finish();
  return harmonic;
}

ReferenceMotion read_reference_motion(SceneSection s) {
  ReferenceMotion motion;
  s.required("period").number(motion.period, kPositive);
  motion.V_X = read_harmonic(s["V_X"].section());
  motion.V_Y = read_harmonic(s["V_Y"].section());
  motion.Omega = read_harmonic(s["Omega"].section());
  s.finish();
  return motion;
}

TorqueSegments read_torque(const std::vector<SceneSection>& sections) {
  TorqueSegments segments;
  for (SceneSection s : sections) {
    TorqueSegment segment;
    const SceneValue start = s.required("start"), constant = s["constant"], cos = s["cos"], sin = s["sin"];
    start.number(segment.start, kAnyNumber);
    constant.numbers(segment.constant, kAnyNumber);
    cos.numbers(segment.cos, kAnyNumber);
    sin.numbers(segment.sin, kAnyNumber);
    const SceneValue period = cos.given() || sin.given() ? s.required("period") : s["period"];
    period.number(segment.period, kPositive);
    s.finish();
    if (!segments.empty() && segment.start <= segments.back().start) {
      start.refuse(fmt::format("after the start of the piece before, {}", segments.back().start));
    }
    segments.push_back(segment);
  }
  return segments;
}

WheelTable read_table(const SceneValue& value, Scene& scene) {
  std::string name;
  value.text(name, "the name of a CSV file");
  scene.files.push_back(std::filesystem::path(scene.files.front()).parent_path() / name);
  return read_wheel_table(scene.files.back());
}

void read_drive(const SceneValue& value, Scene& scene) {
  if (!value.given()) return;
  SceneSection s = value.section();
  const SceneValue motion = s["reference_motion"], torque = s["torque"], torque_table = s["torque_table"],
                   velocity_table = s["velocity_table"];
  s.finish();
  if (motion.given() + torque.given() + torque_table.given() + velocity_table.given() != 1) {
    value.refuse(fmt::format("exactly one of {}", fmt::join(s.known(), ", ")));
  }
  if (motion.given()) scene.drive = read_reference_motion(motion.section());
  if (torque.given()) scene.drive = read_torque(torque.sections());
  if (torque_table.given()) scene.drive = read_table(torque_table, scene);
  if (velocity_table.given()) {
    scene.drive = VelocityTable{read_table(velocity_table, scene)};
    // A velocity loop is sampled; the driver's runs at 1 kHz.
    if (scene.solver.control_period == 0) scene.solver.control_period = 1e-3;
  }
}

void read_initial(SceneSection s, Scene& scene) {
  State& x = scene.initial;
  s["pose"].numbers(x.values.col(0).head<3>(), kAnyNumber);
  auto twist = x.values.col(1).head<3>();
  if (const auto* motion = std::get_if<ReferenceMotion>(&scene.drive)) twist = motion->velocity(0).array();
  s["twist"].numbers(twist, kAnyNumber);

  s["wheel_angles"].numbers(x.phi(), kAnyNumber);
  const NoSlipModel no_slip(scene.robot);
  const Wheels dphi = no_slip.dphi(x.velocity()), dgamma = no_slip.dgamma(x.velocity());
  x.dphi() = dphi;
  x.dgamma() = dgamma;
  const SceneValue wheel_rates = s["wheel_rates"], roller_rates = s["roller_rates"];
  wheel_rates.numbers(x.dphi(), kAnyNumber);
  roller_rates.numbers(x.dgamma(), kAnyNumber);
  s.finish();
  if (scene.model == Model::kNoSlip) {
    const auto require_rolling = [](const SceneValue& value, const Wheels& given, const Wheels& rolling) {
      if (((given - rolling).abs() <= 1e-6 * (1 + rolling.abs())).all()) return;
      value.refuse("left out for no_slip, where the twist decides them");
    };
    require_rolling(wheel_rates, x.dphi(), dphi);
    require_rolling(roller_rates, x.dgamma(), dgamma);
    no_slip.constrain(x);
  }
}

Scene read_scene(const std::string& path, const YAML::Node& root, const SceneOverrides& overrides) {
  SceneSection file(path, "", root);
  Scene scene;
  scene.files = {path};
  file["model"].choice(scene.model, kModels);
  if (!overrides.model.empty()) scene.model = model_from_name(overrides.model);
  file.required("duration").number(scene.duration, kPositive);
  file["output_rate"].number(scene.output_rate, kPositive);
  const SceneValue robot = file["robot"], floor = file["floor"], initial = file["initial"], solver = file["solver"],
                   drive = file["drive"];
  file.finish();
  scene.floor = read_floor(floor.section());
  scene.robot = read_robot(robot.section(), scene.floor);
  scene.solver = read_solver(solver.section(), overrides, scene.model, scene.robot);
  read_drive(drive, scene);
  read_initial(initial.section(), scene);
  return scene;
}

}  // namespace

IntegrationSettings integration_settings(const SolverSettings& solver) {
  return {solver.method, {solver.relative_tolerance, solver.absolute_tolerance}, solver.step};
}

const char* name_of(Model model) {
  for (const Named<Model>& candidate : kModels) {
    if (candidate.value == model) return candidate.name;
  }
  return "";
}

Model model_from_name(const std::string& name) {
  std::vector<std::string> names;
  for (const Named<Model>& candidate : kModels) {
    if (name == candidate.name) return candidate.value;
    names.push_back(candidate.name);
  }
  refuse_override("model", name, names);
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
