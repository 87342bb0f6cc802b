#include "youbot_base_sim/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "wheel_table.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/scene/scene_value.h"
#include "youbot_base_sim/scene/yaml_file.h"
#include "youbot_base_sim/text/hash.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/text/text_file.h"
#include "youbot_base_sim/text/version.h"

namespace youbot_base_sim {

namespace {

constexpr Named<Model> kModels[] = {
    {"no_slip", Model::kNoSlip}, {"viscous", Model::kViscous}, {"coulomb", Model::kCoulomb}};

constexpr Named<RollerRateAtSwitch> kRollerRates[] = {{"continuous", RollerRateAtSwitch::kContinuous},
                                                      {"at_rest", RollerRateAtSwitch::kAtRest}};

constexpr Named<bool> kContacts[] = {{"located", false}, {"averaged", true}};
constexpr Named<NormalReactions> kReactions[] = {{"static", NormalReactions::kStatic},
                                                 {"dynamic", NormalReactions::kDynamic}};
constexpr Named<bool> kPlacements[] = {{"moving", false}, {"at_rest", true}};
constexpr Named<bool> kFrames[] = {{"platform", false}, {"fixed", true}};
constexpr Named<LoadSharing> kSharings[] = {{"equal_wheels", LoadSharing::kEqualWheels},
                                            {"rocking_front", LoadSharing::kRockingFront},
                                            {"rocking_rear", LoadSharing::kRockingRear}};

constexpr double kMaxRows = 1e8, kMaxPeriods = 1e9;
constexpr double kMinInterval = 1e-6;     // s, between rows of wheel angles
constexpr double kMaxRowsInPeriod = 1e5;  // closer ones are one instant to the simulation

constexpr Range kMass{1e-6, 1e6, "kg"};
constexpr Range kInertia{1e-12, 1e6, "kg m^2"};
constexpr Range kLength{1e-3, 1e3, "m"};
constexpr Range kRollerAngle{-90, 90, "degrees"};
constexpr Range kDamping{0, 1e9, "N m s"};
constexpr Range kDryFriction{0, 1e6, "N m"};
constexpr Range kSmoothing{1e-6, 1e6, "rad/s"};
constexpr Range kFriction{0, 100, ""};
constexpr Range kRate{-1e6, 1e6, "rad/s"};
constexpr Range kTorque{-3e6, 3e6, "N m"};
constexpr Range kTime{-1e9, 1e9, "s"};
constexpr Range kHarmonicPeriod{1e-4, 1e9, "s"};

/// Values of a profile: the robot's friction, the holding speed of a parked base, m/s, and gains of its motors.
struct Defaults {
  RobotParameters robot;
  double holding_speed = 0;
  std::optional<VelocityGains> gains = {};  // empty: the youBot driver's
};

/// A name, or a section with the name and what the profile takes besides.
Defaults read_profile(const SceneValue& value) {
  std::string profile = "paper";
  double scale = 1;
  if (value.is_section()) {
    SceneValue s = value;
    s.required("name").choice(profile, profile_names());
    const SceneValue friction_scale = s["friction_scale"];
    s.finish();
    const bool scales = profile == "measured";
    if (!scales && friction_scale.given()) friction_scale.refuse("left out unless name is measured");
    if (scales) friction_scale.number(scale, kFrictionScales);
  } else {
    value.choice(profile, profile_names());
  }
  if (profile == "paper") return {};
  constexpr double kHoldingSpeed = 1e-8;  // creeps by 0.1 mm an hour at 0.9 of the friction limit
  if (profile == "measured") return {measured_robot(scale), kHoldingSpeed};
  if (profile == "measured_b") return {measured_robot(0.76), kHoldingSpeed, VelocityGains{0.33, 0.5}};
  Defaults measured_a{measured_robot(1.3), kHoldingSpeed, VelocityGains{0.2, 1.5}};
  measured_a.robot.J_1 = 0.015;  // with the motor's rotor, 0.009 behind its gear
  return measured_a;
}

/// Refuses what the model would ignore.
void refuse_for_model(const SceneValue& value, bool ignored, Model model) {
  if (ignored) value.refuse(fmt::format("left out for {}, which has no use for it", name_of(model)));
}

void check_reactions(const RobotParameters& robot, Model model, const SceneValue& reactions, const SceneValue& sharing,
                     const SceneValue& preload, const SceneValue& com_height) {
  const bool dynamic = robot.normal_reactions == NormalReactions::kDynamic;
  refuse_for_model(reactions, dynamic && !limits_friction(model), model);
  refuse_for_model(preload, robot.q != 0 && !limits_friction(model), model);
  refuse_for_model(com_height, robot.a_Z != 0 && !limits_friction(model), model);
  if (robot.a_Z <= -robot.R) com_height.refuse(fmt::format("more than -wheel_radius, {}", -robot.R));
  if (robot.load_sharing == LoadSharing::kEqualWheels) return;
  if (!dynamic) sharing.refuse("equal_wheels unless normal_reactions is dynamic");
  if (robot.q != 0) preload.refuse("left out for a rocking axle, which evens it out");
}

void check_rollers(const RobotParameters& robot, const FloorParameters& floor, const SceneValue& roller_inertia,
                   const SceneValue& axis_radius) {
  const auto frictionless = [](const FloorPatch& patch) { return patch.friction == 0; };
  const bool floor_may_not_hold = robot.normal_reactions == NormalReactions::kDynamic || floor.f.minCoeff() == 0 ||
                                  floor.viscous_friction == 0 ||
                                  std::any_of(floor.patches.begin(), floor.patches.end(), frictionless);
  if (robot.J_2 == 0 && (robot.mu_2 + robot.roller_dry_friction).minCoeff() == 0 && floor_may_not_hold) {
    roller_inertia.refuse(
        "a finite number > 0 where neither friction nor roller_damping nor roller_dry_friction holds the rollers");
  }
  if (robot.R_d >= robot.R)
    axis_radius.refuse(fmt::format("less than wheel_radius, {}; left out it is {}", robot.R, RobotParameters().R_d));
}

void check_kinematics(const RobotParameters& robot, const SceneValue& roller_angle) {
  constexpr double kLeastLever = 1e-3;  // m
  const Wheels angles = robot.roller_angle.abs();
  if (angles.minCoeff() == 0 || angles.maxCoeff() == 90) roller_angle.refuse("neither 0 nor 90 or -90 degrees");
  const double lever = Rolling(robot).lever();
  if (lever >= kLeastLever) return;
  roller_angle.refuse(
      fmt::format("such that the wheels' rates decide V_X, V_Y and Omega: |half_track + half_wheelbase "
                  "tan(roller_angle)|, where all angles are alike, must be at least {:g} m, and is {:.3g} m",
                  kLeastLever, std::max(0.0, lever)));
}

/// Says what must be if a wheel would leave the floor at rest; else empty.
std::string lifted_wheel(const RobotParameters& robot, const FloorParameters& floor) {
  const Wheels N = normal_reactions(robot, floor);
  int lightest = 0;
  if (N.minCoeff(&lightest) > 0) return "";
  return fmt::format("such that every wheel presses on the floor; {} would with {:.4g} N", kWheelNames[lightest],
                     N[lightest]);
}

void check_masses(const RobotParameters& robot, const FloorParameters& floor, const SceneValue& inertia,
                  const SceneValue& com, const SceneValue& preload) {
  // I_s is about O; about the centre of mass of all it is less by m^2 (a_X^2 + a_Y^2) / m_s, and must be positive.
  const double least = robot.m * robot.m * (robot.a_X * robot.a_X + robot.a_Y * robot.a_Y) / robot.m_s();
  if (robot.I_s <= least) {
    inertia.refuse(fmt::format("more than {:.6g}, which body_mass and com alone make up", least));
  }
  const std::string lifted = lifted_wheel(robot, floor);
  if (lifted.empty()) return;
  RobotParameters even = robot;
  even.q = 0;
  (lifted_wheel(even, floor).empty() ? preload : com).refuse(lifted);
}

/// Reads into `robot`, which has the profile's values, and checks it against `floor` and `model` too.
void read_robot(SceneValue s, RobotParameters& robot, const FloorParameters& floor, Model model) {
  s["body_mass"].number(robot.m, kMass);
  s["wheel_mass"].number(robot.m_1, kMass);
  const SceneValue inertia = s["total_inertia"].number(robot.I_s, kInertia);
  s["wheel_inertia"].number(robot.J_1, kInertia);
  const SceneValue roller_inertia = s["roller_inertia"].number(robot.J_2, {1e-15, 1e3, "kg m^2", true});
  Eigen::Array2d a{robot.a_X, robot.a_Y};
  const SceneValue com = s["com"].numbers(a, {-1e3, 1e3, "m"});
  robot.a_X = a[0];
  robot.a_Y = a[1];
  s["half_wheelbase"].number(robot.h, kLength);
  s["half_track"].number(robot.l, kLength);
  s["wheel_radius"].number(robot.R, kLength);
  const SceneValue axis_radius = s["roller_axis_radius"].number(robot.R_d, kLength);
  s["rollers_per_wheel"].whole_number(robot.rollers, 3, 255);
  const SceneValue roller_angle = s["roller_angle"].number_or_wheels(robot.roller_angle, kRollerAngle);
  s["wheel_damping"].number_or_wheels(robot.mu_1, kDamping);
  s["roller_damping"].number_or_wheels(robot.mu_2, kDamping);
  s["dry_friction"].number_or_wheels(robot.dry_friction, kDryFriction);
  s["dry_friction_rate"].number(robot.dry_friction_rate, kSmoothing);
  s["roller_dry_friction"].number_or_wheels(robot.roller_dry_friction, kDryFriction);
  s["roller_dry_friction_rate"].number(robot.roller_dry_friction_rate, kSmoothing);
  s["roller_rate_at_switch"].choice(robot.roller_rate_at_switch, kRollerRates);
  const SceneValue contacts = s["contacts"].choice(robot.averaged_contacts, kContacts);
  const SceneValue reactions = s["normal_reactions"].choice(robot.normal_reactions, kReactions),
                   sharing = s["load_sharing"].choice(robot.load_sharing, kSharings),
                   preload = s["diagonal_preload"].number(robot.q, {-1e6, 1e6, "N"}),
                   com_height = s["com_height"].number(robot.a_Z, {-1e3, 1e3, "m"});
  s.finish();

  refuse_for_model(contacts, robot.averaged_contacts && !slips(model), model);
  check_reactions(robot, model, reactions, sharing, preload, com_height);
  check_rollers(robot, floor, roller_inertia, axis_radius);
  check_kinematics(robot, roller_angle);
  check_masses(robot, floor, inertia, com, preload);
}

/// Reads the sections of a list that may be left out.
template <class Entry>
void read_list(const SceneValue& value, std::vector<Entry>& entries, Entry (*read)(SceneValue s)) {
  if (!value.given()) return;
  for (const SceneValue& section : value.sections()) entries.push_back(read(section));
}

FloorPatch read_patch(SceneValue s) {
  FloorPatch patch;
  Eigen::Array4d corners = Eigen::Array4d::Zero();
  const SceneValue rectangle = s.required("rectangle").numbers(corners, {-1e6, 1e6, "m"});
  s.required("friction").number(patch.friction, kFriction);
  s["edge"].number(patch.edge, {1e-4, 1e3, "m"});
  s.finish();
  patch.x0 = corners[0];
  patch.y0 = corners[1];
  patch.x1 = corners[2];
  patch.y1 = corners[3];
  if (!(patch.x0 < patch.x1 && patch.y0 < patch.y1)) rectangle.refuse("[x0, y0, x1, y1] with x0 < x1 and y0 < y1");
  return patch;
}

FloorParameters read_floor(SceneValue s, Model model, double holding_speed) {
  FloorParameters floor;
  if (limits_friction(model)) floor.holding_speed = holding_speed;
  const SceneValue friction = s["friction"].number_or_wheels(floor.f, kFriction),
                   spin = s["spin_radius"].number(floor.spin_radius, {0, 1, "m"}), patches = s["patches"];
  read_list(patches, floor.patches, read_patch);
  SceneValue slope = s["slope"];
  slope["angle"].number(floor.slope, {-0.5, 0.5, "rad"});
  slope["uphill"].number(floor.uphill, {-1e3, 1e3, "rad"});
  slope.finish();
  s["holding_speed"].number(floor.holding_speed, {1e-12, 1e3, "m/s", true});
  refuse_for_model(friction, (floor.f != floor.f[0]).any() && !slips(model), model);
  refuse_for_model(spin, floor.spin_radius != 0 && !limits_friction(model), model);
  refuse_for_model(patches, !floor.patches.empty() && !limits_friction(model), model);
  s["slip_regularization"].number(floor.nu, {1e-15, 1e3, "m/s"});
  s["viscous_friction"].number(floor.viscous_friction, {0, 1e15, "N s/m"});
  s["gravity"].number(floor.g, {1e-6, 1e6, "m/s^2"});
  s.finish();
  return floor;
}

void read_stretch(SceneValue& s, LoadSchedule::Stretch& stretch) {
  s["start"].number(stretch.start, {0, 1e9, "s"});
  const SceneValue end = s["end"].number(stretch.end, {0, 1e9, "s"});
  if (stretch.end <= stretch.start) end.refuse(fmt::format("after start, {}", stretch.start));
}

LoadSchedule::PlannedLoad read_load(SceneValue s) {
  LoadSchedule::PlannedLoad planned;
  s.required("mass").number(planned.load.mass, kLoadMasses);
  s.required("position").numbers(planned.load.position.array(), kLoadPositions);
  s["inertia"].number(planned.load.inertia, kLoadInertias);
  read_stretch(s, planned);
  s["placed"].choice(planned.at_rest, kPlacements);
  s.finish();
  return planned;
}

LoadSchedule::PlannedWrench read_wrench(SceneValue s) {
  LoadSchedule::PlannedWrench planned;
  const SceneValue force = s["force"], torque = s["torque"].number(planned.wrench.torque, kWrenchTorques);
  force.numbers(planned.wrench.force.array(), kWrenchForces);
  s["point"].numbers(planned.wrench.point.array(), kLoadPositions);
  read_stretch(s, planned);
  s["frame"].choice(planned.wrench.fixed, kFrames);
  s.finish();
  if (!force.given() && !torque.given()) force.refuse("given where torque is not");
  return planned;
}

void check_control_period(const SceneValue& value, double period, const Scene& scene) {
  if (period > 0 && scene.duration / period > kMaxPeriods) {
    value.refuse(fmt::format("such that the duration has at most {:g} of them; it would have {:g}", kMaxPeriods,
                             scene.duration / period));
  }
  if (scene.output_rate * period > kMaxRowsInPeriod) {
    value.refuse(fmt::format("such that it has at most {:g} rows of output; it would have {:g}", kMaxRowsInPeriod,
                             scene.output_rate * period));
  }
}

/// Refuses a control period at which the velocity loops of the motors would swing up.
void check_velocity_loops(const std::string& file, const Scene& scene) {
  if (!std::holds_alternative<VelocityTable>(scene.drive)) return;
  const std::string limit = stable_period(scene, scene.motors.value_or(MotorSettings()).gains);
  if (limit.empty()) return;
  SceneValue(file, "solver.control_period", YAML::Node(fmt::format("{:g}", scene.solver.control_period))).refuse(limit);
}

/// True if the drive cannot be continuous in time: commands, or a loop of motors.
bool is_sampled(const Scene& scene, SceneUse use) {
  return use == SceneUse::kCommands || scene.motors || std::holds_alternative<VelocityTable>(scene.drive);
}

/// The `scene` so far limits the methods and the control period.
SolverSettings read_solver(SceneValue s, SceneUse use, const Scene& scene) {
  SolverSettings solver;
  const SceneValue method = s["method"].choice(solver.method, method_names());
  s["relative_tolerance"].number(solver.relative_tolerance, kRelativeTolerances);
  solver.absolute_tolerance = 1e-3 * solver.relative_tolerance;
  s["absolute_tolerance"].number(solver.absolute_tolerance, {1e-18, 1, ""});
  const SceneValue period = s["control_period"].number(solver.control_period, kControlPeriods);
  check_control_period(period, solver.control_period, scene);
  if (solver.control_period == 0 && is_sampled(scene, use)) solver.control_period = 1e-3;  // the driver's
  period.resolve(solver.control_period);
  if (std::holds_alternative<std::shared_ptr<const WheelMotion>>(scene.drive)) {
    if (solver.control_period > 0) period.refuse("0 with a wheel_angle_table");
    if (find_method(solver.method)->is_explicit) method.refuse("radau or rosenbrock4 with a wheel_angle_table");
  }
  s.finish();
  const std::string reason = refusal(*find_method(solver.method), scene.robot, scene.model);
  if (!reason.empty()) method.refuse(reason);
  return solver;
}

// Reads a setting of the motors; an empty one stays empty where the file leaves it out.
void read_setting(const SceneValue& value, double& number, const Range& range) { value.number(number, range); }
void read_setting(const SceneValue& value, std::optional<double>& number, const Range& range) {
  if (value.given()) value.number(number.emplace(), range);
}
void read_setting(const SceneValue& value, std::optional<bool>& flag) {
  if (value.given()) value.choice(flag.emplace(), kFlags);
}

/// `gains` are the profile's.
MotorSettings read_motors(SceneValue s, const std::optional<VelocityGains>& gains) {
  MotorSettings motors;
  motors.gains = gains.value_or(motors.gains);
  visit_settings(
      motors, [&](const char* name, auto& setting, const auto&... range) { read_setting(s[name], setting, range...); });
  s.finish();
  return motors;
}

Harmonic read_harmonic(SceneValue s) {
  Harmonic harmonic;
  s["constant"].number(harmonic.constant, kSpeeds);
  s["cos"].number(harmonic.cos, kSpeeds);
  s["sin"].number(harmonic.sin, kSpeeds);
  s.finish();
  return harmonic;
}

ReferenceMotion read_reference_motion(SceneValue s) {
  ReferenceMotion motion;
  s.required("period").number(motion.period, kHarmonicPeriod);
  motion.V_X = read_harmonic(s["V_X"]);
  motion.V_Y = read_harmonic(s["V_Y"]);
  motion.Omega = read_harmonic(s["Omega"]);
  s.finish();
  return motion;
}

TorqueSegments read_torque(const std::vector<SceneValue>& sections) {
  TorqueSegments segments;
  for (SceneValue s : sections) {
    TorqueSegment segment;
    const SceneValue start = s.required("start").number(segment.start, kTime);
    s["constant"].numbers(segment.constant, kTorque);
    const bool cos = s["cos"].numbers(segment.cos, kTorque).given(),
               sin = s["sin"].numbers(segment.sin, kTorque).given();
    (cos || sin ? s.required("period") : s["period"]).number(segment.period, kHarmonicPeriod);
    s.finish();
    if (!segments.empty() && segment.start <= segments.back().start) {
      start.refuse(fmt::format("after the start of the segment before, {}", segments.back().start));
    }
    segments.push_back(segment);
  }
  return segments;
}

WheelTable read_table(const SceneValue& value, Scene& scene, const Range& range) {
  std::string name;
  value.text(name, "the name of a CSV file");
  scene.files.push_back(std::filesystem::path(scene.files.front()).parent_path() / name);
  try {
    return read_wheel_table(scene.files.back(), kTime, range);
  } catch (const UnreadableFile& error) {
    value.refuse_for(fmt::format("{}; must be a CSV file with {}", error.what(), kTableColumns));
  }
}

std::shared_ptr<const WheelMotion> read_wheel_angles(const SceneValue& value, double resolution, Scene& scene) {
  WheelTable table = read_table(value, scene, kWheelAngles);
  const std::vector<double>& t = table.t;
  if (t.size() < 2 || t.front() > 0 || t.back() < scene.duration) {
    value.refuse(fmt::format("a table from t = 0 to the duration, {} s; it has {} to {} s", scene.duration, t.front(),
                             t.back()));
  }
  for (std::size_t k = 1; k < t.size(); ++k) {
    const double rate = ((table.values[k] - table.values[k - 1]) / (t[k] - t[k - 1])).abs().maxCoeff();
    if (t[k] - t[k - 1] >= kMinInterval && contains(kRate, rate)) continue;
    value.refuse(
        fmt::format("a table with rows at least {:g} s apart and angular velocities of {}; from t = {} s to "
                    "{} s there is {:.3g} rad/s",
                    kMinInterval, text_of(kRate), t[k - 1], t[k], rate));
  }
  if (!slips(scene.model)) value.refuse("left out for no_slip, whose wheels cannot follow any four angles");
  if (scene.motors) value.refuse("left out where motors are given");
  return std::make_shared<WheelSpline>(std::move(table), resolution);
}

void read_drive(const SceneValue& value, Scene& scene) {
  if (!value.given()) return;
  SceneValue s = value;
  const SceneValue motion = s["reference_motion"], torque = s["torque"], torque_table = s["torque_table"],
                   velocity_table = s["velocity_table"], angle_table = s["wheel_angle_table"];
  const std::vector<std::string> drives = s.known();
  const SceneValue file_resolution = s["resolution"];
  s.finish();
  double resolution = 0;
  if (file_resolution.given() || angle_table.given()) file_resolution.number(resolution, {1e-9, 1, "rad", true});
  if (motion.given() + torque.given() + torque_table.given() + velocity_table.given() + angle_table.given() != 1) {
    value.refuse(fmt::format("exactly one of {}", fmt::join(drives, ", ")));
  }
  if (motion.given()) scene.drive = read_reference_motion(motion);
  if (torque.given()) scene.drive = read_torque(torque.sections());
  if (torque_table.given()) scene.drive = read_table(torque_table, scene, kTorque);
  if (velocity_table.given()) scene.drive = VelocityTable{read_table(velocity_table, scene, kRate)};
  if (angle_table.given()) scene.drive = read_wheel_angles(angle_table, resolution, scene);
  if (file_resolution.given() && !angle_table.given()) file_resolution.refuse("left out without a wheel_angle_table");
}

void read_initial(SceneValue s, Scene& scene) {
  State& x = scene.initial;
  auto place = x.values.col(0).head<3>();
  s["pose"].numbers(place, kPoses);
  auto twist = x.values.col(1).head<3>();
  if (const auto* motion = std::get_if<ReferenceMotion>(&scene.drive)) twist = motion->velocity(0).array();
  std::optional<Wheels> prescribed_dphi;
  if (const auto* motion = std::get_if<std::shared_ptr<const WheelMotion>>(&scene.drive)) {
    x.phi() = (*motion)->angle(0);
    prescribed_dphi = (*motion)->rate(0);
    twist = Rolling(scene.robot).velocity(*prescribed_dphi).array();
  }
  s["twist"].numbers(twist, kSpeeds);

  s["wheel_angles"].numbers(x.phi(), kWheelAngles);
  const NoSlipModel no_slip(scene.robot);
  const Wheels dphi = no_slip.dphi(x.velocity()), dgamma = no_slip.dgamma(x.velocity());
  x.dphi() = prescribed_dphi.value_or(dphi);
  x.dgamma() = dgamma;
  const SceneValue wheel_rates = s["wheel_rates"].numbers(x.dphi(), kRate),
                   roller_rates = s["roller_rates"].numbers(x.dgamma(), kRate);
  s.finish();
  if (prescribed_dphi && (x.dphi() != *prescribed_dphi).any())
    wheel_rates.refuse("left out with a wheel_angle_table, which decides them");
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

Scene read_scene(const std::string& path, const YAML::Node& root, SceneUse use, bool resolve) {
  SceneValue file(quote_path(path), "", root, "scene", resolve);
  Scene scene;
  scene.files = {path};
  file["model"].choice(scene.model, kModels);
  (use == SceneUse::kCommands ? file["duration"] : file.required("duration")).number(scene.duration, {1e-9, 1e6, "s"});
  const SceneValue output_rate = file["output_rate"].number(scene.output_rate, {1e-9, 1e6, "Hz"});
  SceneValue robot = file["robot"], floor = file["floor"], initial = file["initial"], solver = file["solver"],
             motors = file["motors"], output = file["output"], drive = file["drive"], loads = file["loads"],
             wrenches = file["wrenches"];
  file.finish();
  if (const double rows = scene.duration * scene.output_rate; rows > kMaxRows) {
    output_rate.refuse(fmt::format("such that there are at most {:g} rows; there would be {:g}", kMaxRows, rows));
  }
  const Defaults defaults = read_profile(robot["profile"]);
  scene.floor = read_floor(floor, scene.model, defaults.holding_speed);
  scene.robot = defaults.robot;
  read_robot(robot, scene.robot, scene.floor, scene.model);
  read_list(loads, scene.load_schedule.loads, read_load);
  read_list(wrenches, scene.load_schedule.wrenches, read_wrench);
  const std::string lifted = scene.load_schedule.loads.empty() ? "" : lifted_wheel(scene, {}, 0);
  if (!lifted.empty()) loads.refuse(lifted);
  output["contacts"].choice(scene.contacts_in_bags, kFlags);
  output.finish();
  if (motors.given()) scene.motors = read_motors(motors, defaults.gains);
  read_drive(drive, scene);
  if (defaults.gains && !scene.motors && is_sampled(scene, use)) scene.motors = read_motors(motors, defaults.gains);
  // An ignored drive gives the initial velocity, but prescribed wheels limit neither solver nor initial state.
  const bool prescribes = std::holds_alternative<std::shared_ptr<const WheelMotion>>(scene.drive);
  if (use == SceneUse::kCommands && prescribes) scene.drive = std::monostate();
  scene.solver = read_solver(solver, use, scene);
  check_velocity_loops(quote_path(path), scene);
  read_initial(initial, scene);
  if (use == SceneUse::kCommands) {
    drive.unresolve();
    scene.drive = std::monostate();
  }
  scene.resolved = file.resolved();
  return scene;
}

/// Turns yaml-cpp's exceptions into SceneError.
template <class Read>
auto guarded(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const YAML::Exception& error) {
    throw SceneError(fmt::format("{}: {}", quote_path(path), quote(error.what(), kMaxMessage)));
  }
}

}  // namespace

std::string lifted_wheel(const Scene& scene, const std::vector<Load>& more, double t) {
  for (; std::isfinite(t); t = scene.load_schedule.next_change(t)) {
    std::vector<Load> loads = scene.load_schedule.at(t).loads;
    loads.insert(loads.end(), more.begin(), more.end());
    const std::string lifted = lifted_wheel(loaded(scene.robot, loads), scene.floor);
    if (!lifted.empty()) return fmt::format("{}, from t = {:g} s on", lifted, t);
  }
  return "";
}

std::string stable_period(const Scene& scene, const VelocityGains& gains) {
  const double unstable = gains.unstable_period(scene.robot.J_1);
  if (scene.solver.control_period < unstable) return "";
  return fmt::format(
      "less than {:.4g} s, such as {:.1g} s: with these gains and the scene's wheel_inertia the velocity loops of the "
      "motors are unstable from there on",
      unstable, unstable / 2);
}

bool beyond_the_paper(const Scene& scene) {
  return scene.robot.normal_reactions != NormalReactions::kStatic || scene.floor.slope != 0 ||
         scene.floor.spin_radius != 0 || !scene.floor.patches.empty() || !scene.load_schedule.empty();
}

std::vector<std::string> model_names() { return names_of(kModels); }
std::vector<std::string> profile_names() { return {"paper", "measured", "measured_a", "measured_b"}; }

const char* name_of(Model model) {
  for (const Named<Model>& candidate : kModels) {
    if (candidate.value == model) return candidate.name;
  }
  return "";
}

Scene load_scene(const std::string& path, const SceneSettings& settings, SceneUse use) {
  return load_scene(read_scene_file(path), settings, use);
}

SceneFile read_scene_file(const std::string& path) { return {path, read_yaml_text(path)}; }

Scene load_scene(const SceneFile& file, const SceneSettings& settings, SceneUse use, bool resolve) {
  return guarded(file.path, [&] {
    return read_scene(file.path, with_settings(quote_path(file.path), YAML::Load(file.text), settings), use, resolve);
  });
}

std::string text_of(const SceneFile& file, const SceneSettings& settings) {
  return guarded(file.path, [&] {
    YAML::Emitter emitter;
    emitter << with_settings(quote_path(file.path), YAML::Load(file.text), settings);
    return std::string(emitter.c_str()) + "\n";
  });
}

std::string id_of(const Scene& scene) {
  std::string text = scene.resolved;
  const auto append = [&](const WheelTable& table) {
    text.append(reinterpret_cast<const char*>(table.t.data()), table.t.size() * sizeof(double));
    text.append(reinterpret_cast<const char*>(table.values.data()), table.values.size() * sizeof(Wheels));
  };
  if (const auto* torques = std::get_if<WheelTable>(&scene.drive)) append(*torques);
  if (const auto* rates = std::get_if<VelocityTable>(&scene.drive)) append(rates->table);
  if (const auto* motion = std::get_if<std::shared_ptr<const WheelMotion>>(&scene.drive)) {
    if (const auto* spline = dynamic_cast<const WheelSpline*>(motion->get())) append(spline->table());
  }
  return hash(text);
}

std::string provenance(const Scene& scene) {
  return fmt::format("# youbot_base_sim {}, scene {}\n", version(), id_of(scene));
}

Scene default_scene(const SceneSettings& settings, SceneUse use) {
  // No file is complete without a duration.
  Scene scene = load_scene(SceneFile{"", use == SceneUse::kRun ? "duration: 1" : "{}"}, settings, use);
  scene.files.clear();
  return scene;
}

std::unique_ptr<TorqueProfile> make_torque_profile(const Scene& scene) {
  if (const auto* motion = std::get_if<ReferenceMotion>(&scene.drive))
    return std::make_unique<ReferenceTorque>(scene.robot, *motion);
  if (const auto* segments = std::get_if<TorqueSegments>(&scene.drive))
    return std::make_unique<PiecewiseTorque>(*segments);
  if (const auto* motion = std::get_if<std::shared_ptr<const WheelMotion>>(&scene.drive))
    return std::make_unique<PrescribedWheels>(scene.robot, *motion);
  if (const auto* table = std::get_if<WheelTable>(&scene.drive)) return std::make_unique<TableTorque>(*table);
  return nullptr;
}

}  // namespace youbot_base_sim
