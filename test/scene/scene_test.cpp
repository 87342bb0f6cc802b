// Scene files: keys, defaults, tables, and one line that refuses each mistake.

#include "youbot_base_sim/scene/scene.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <yaml-cpp/yaml.h>

#include <array>
#include <fstream>
#include <map>
#include <memory>

#include "temporary_folder.h"
#include "youbot_base_sim/integration/methods.h"

namespace youbot_base_sim {
namespace {

const char kDrive[] = "duration: 1\ndrive: {torque: [{start: 0, constant: [1, 2, 3, 4]}]}\n";

class SceneTest : public testing::Test {
 protected:
  Scene load(const std::string& text) { return load_scene(folder_.write("scene.yaml", text)); }

  /// The error that refuses the scene.
  std::string refusal(const std::string& text) {
    try {
      load(text);
    } catch (const SceneError& error) {
      return error.what();
    }
    ADD_FAILURE() << "not refused: " << text;
    return "";
  }

  void expect_refused(const std::string& text, const std::string& key, const std::string& value,
                      const std::string& allowed) {
    const std::string message = refusal(text);
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    EXPECT_NE(message.find("scene.yaml"), std::string::npos) << message;
    for (const std::string& part : {key, value, allowed}) {
      EXPECT_NE(message.find(part), std::string::npos) << message << " lacks " << part;
    }
  }

  /// All warnings of a scene.
  std::string warnings(const std::string& text) {
    std::string all;
    for (const std::string& warning : warnings_of(load(text))) all += warning;
    return all;
  }

  TemporaryFolder folder_;
};

// As of a fit to encoders, whose scene the node slip_odometry takes.
TEST_F(SceneTest, ANodesSceneMayHaveATableOfAngles) {
  folder_.write("angles.csv", "t,fl,fr,bl,br\n0,0,0,0,0\n1,1,1,1,1\n");
  const std::string path = folder_.write("scene.yaml", "duration: 1\ndrive: {wheel_angle_table: angles.csv}\n");
  const Scene scene = load_scene(path, {}, SceneUse::kCommands);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(scene.drive));
  EXPECT_EQ(scene.solver.control_period, 1e-3);
}

TEST_F(SceneTest, DefaultsAreThePapers) {
  const Scene scene = load(kDrive);
  EXPECT_EQ(scene.model, Model::kCoulomb);
  EXPECT_EQ(scene.output_rate, 100);
  EXPECT_EQ(scene.robot.m, 30.0);
  EXPECT_EQ(scene.robot.J_1, 5.87e-3);
  EXPECT_EQ(scene.robot.a_Y, -0.026);
  EXPECT_EQ(scene.robot.rollers, 6);
  EXPECT_NEAR(scene.floor.mu_0(scene.robot)[0], 4.4e4, 0.04e4);  // (5.2) prints two figures
  EXPECT_EQ(scene.solver.relative_tolerance, 3e-7);
  EXPECT_DOUBLE_EQ(scene.solver.absolute_tolerance, 3e-10);
  EXPECT_EQ(scene.solver.control_period, 0);
  EXPECT_EQ(scene.solver.method, "radau");
  EXPECT_TRUE((scene.initial.values == 0).all());
}

TEST_F(SceneTest, ReadsEveryKey) {
  const Scene scene = load(R"(
model: viscous
duration: 2.5
output_rate: 50
robot: {body_mass: 31, wheel_mass: 1.5, total_inertia: 5, wheel_inertia: 6e-3, roller_inertia: 2e-6, com: [0.01, 0.02],
        half_wheelbase: 0.24, half_track: 0.16, wheel_radius: 0.06, roller_axis_radius: 0.04, rollers_per_wheel: 8, roller_angle: [44, 46, -45, 60],
        wheel_damping: 0.2, roller_damping: [1e-3, 2e-3, 3e-3, 4e-3], roller_rate_at_switch: at_rest}
floor: {friction: 0.6, slip_regularization: 2e-3, viscous_friction: 1000, gravity: 9.8}
initial: {pose: [1, 2, 3], twist: [4, 5, 6], wheel_angles: [7, 8, 9, 10], wheel_rates: [11, 12, 13, 14],
          roller_rates: [15, 16, 17, 18]}
solver: {method: dopri5, relative_tolerance: 1e-6, absolute_tolerance: 1e-8, control_period: 0.002}
motors: {velocity_proportional_gain: 0.3, velocity_integral_gain: 0.5, max_wheel_torque: 2, max_wheel_rate: 10,
         command_delay: 0.05, quantized: true, scene_kinematics: true}
output: {contacts: true}
drive: {torque: [{start: 0, constant: [1, 2, 3, 4]}, {start: 1, cos: [1, 0, 0, 0], sin: [0, 1, 0, 0], period: 3}]}
)");
  EXPECT_EQ(scene.model, Model::kViscous);
  EXPECT_EQ(scene.robot.rollers, 8);
  EXPECT_TRUE((scene.robot.roller_angle == Wheels{44, 46, -45, 60}).all());
  EXPECT_TRUE((scene.robot.mu_1 == 0.2).all());
  EXPECT_EQ(scene.robot.mu_2[3], 4e-3);
  EXPECT_EQ(scene.robot.roller_rate_at_switch, RollerRateAtSwitch::kAtRest);
  EXPECT_EQ(scene.floor.mu_0(scene.robot)[0], 1000);
  EXPECT_EQ(scene.initial.psi(), 3);
  EXPECT_EQ(scene.initial.Omega(), 6);
  EXPECT_EQ(scene.initial.phi()[3], 10);
  EXPECT_EQ(scene.initial.dphi()[0], 11);
  EXPECT_EQ(scene.initial.dgamma()[1], 16);
  EXPECT_EQ(scene.solver.method, "dopri5");
  EXPECT_EQ(scene.solver.absolute_tolerance, 1e-8);
  EXPECT_EQ(scene.motors->gains.proportional, 0.3);
  EXPECT_EQ(scene.motors->gains.integral, 0.5);
  EXPECT_EQ(scene.motors->max_wheel_torque, 2);
  EXPECT_EQ(scene.motors->max_wheel_rate, 10);
  EXPECT_EQ(scene.motors->command_delay, 0.05);
  EXPECT_EQ(scene.motors->quantized, true);
  EXPECT_EQ(scene.motors->scene_kinematics, true);
  EXPECT_TRUE(scene.contacts_in_bags);
  EXPECT_EQ(std::get<TorqueSegments>(scene.drive)[1].period, 3);
}

// Records of two bases: the drive's dry friction is 0.14 to 0.24 N m, the rollers' 0.055 to 0.095 N m.
TEST_F(SceneTest, ProfilesAreDefaultsThatOtherKeysGoBefore) {
  const std::string d = kDrive;
  EXPECT_EQ(load(d + "robot: {profile: paper}").robot.mu_1[0], 0.11);
  EXPECT_TRUE((load(d + "robot: {profile: paper}").robot.dry_friction == 0).all());
  // It also decides how a parked base is held, unless the floor does.
  EXPECT_EQ(load(d + "robot: {profile: paper}").floor.holding_speed, 0);
  EXPECT_EQ(load(d + "robot: {profile: measured}").floor.holding_speed, 1e-8);
  EXPECT_EQ(load(d + "robot: {profile: measured}\nfloor: {holding_speed: 0}").floor.holding_speed, 0);
  EXPECT_EQ(load(d + "floor: {holding_speed: 1e-6}").floor.holding_speed, 1e-6);
  const RobotParameters measured = load(d + "robot: {profile: measured}").robot;
  EXPECT_TRUE((measured.dry_friction == 0.18).all());
  EXPECT_TRUE((measured.mu_1 == 0.01).all());
  EXPECT_TRUE((measured.roller_dry_friction == 0.073).all());
  EXPECT_TRUE((measured.mu_2 == 0.0025).all());
  EXPECT_EQ(measured.roller_dry_friction_rate, 2);
  EXPECT_EQ(measured.m, 30);
  const RobotParameters scaled = load(d +
                                      "robot: {wheel_damping: 0.05, profile: {name: measured, friction_scale: 0.76}, "
                                      "roller_dry_friction: [0.1, 0.2, 0.3, 0.4], dry_friction_rate: 0.5}")
                                     .robot;
  EXPECT_DOUBLE_EQ(scaled.dry_friction[3], 0.76 * 0.18);
  EXPECT_EQ(scaled.mu_1[0], 0.05);
  EXPECT_EQ(scaled.roller_dry_friction[2], 0.3);
  EXPECT_DOUBLE_EQ(scaled.mu_2[1], 0.76 * 0.0025);
  EXPECT_EQ(scaled.dry_friction_rate, 0.5);
}

TEST_F(SceneTest, RefusesWhatIsNoProfile) {
  const std::string d = kDrive;
  expect_refused(d + "robot: {profile: real}", "robot.profile", "real", "measured_a or measured_b");
  expect_refused(d + "robot: {profile: [measured]}", "robot.profile", "[measured]", "measured_a or measured_b");
  expect_refused(d + "robot: {profile: {friction_scale: 2}}", "robot.profile.name", "left out", "given");
  expect_refused(d + "robot: {profile: {name: real}}", "robot.profile.name", "real", "measured_a or measured_b");
  expect_refused(d + "robot: {profile: {name: paper, friction_scale: 2}}", "robot.profile.friction_scale", "2",
                 "left out unless name is measured");
  expect_refused(d + "robot: {profile: {name: measured, friction_scale: -1}}", "robot.profile.friction_scale", "-1",
                 ">= 0");
  expect_refused(d + "robot: {profile: {name: measured, scale: 1}}", "robot.profile.scale", "1", "friction_scale");
}

TEST_F(SceneTest, InitialVelocityDefaultsToTheReferenceMotions) {
  const Scene scene = load(
      "duration: 1\ndrive: {reference_motion: {period: 30, V_Y: {constant: 0.5, cos: 0.1}, "
      "Omega: {constant: 0.2}}}\n");
  EXPECT_DOUBLE_EQ(scene.initial.V_Y(), 0.6);
  EXPECT_DOUBLE_EQ(scene.initial.Omega(), 0.2);
  // (V_X - V_Y - (h + l) Omega) / R for the front-left wheel
  EXPECT_NEAR(scene.initial.dphi()[0], (-0.6 - 0.385 * 0.2) / 0.05, 1e-12);
}

// refused_scenes_test.cpp tries each key alone with values of no use, the others of its section, and no files.
TEST_F(SceneTest, RefusesInOneLineThatNamesKeyValueAndWhatIsAllowed) {
  const std::string d = kDrive;
  expect_refused(d + "robot: {body_mass: 3, body_mass: 4}", "robot.body_mass", "4", "once");
  expect_refused(d + "robot: {roller_axis_radius: 0.05}", "robot.roller_axis_radius", "0.05", "wheel_radius");
  expect_refused(d + "robot: {roller_angle: [45, 45, 0, 45]}", "robot.roller_angle", "45, 45, 0, 45", "neither 0 nor");
  // A square base in O-configuration does not turn; nor do two wheels of the wrong hand tell V_X from V_Y.
  expect_refused(d + "robot: {roller_angle: -45, half_track: 0.2345}", "robot.roller_angle", "-45",
                 "at least 0.001 m, and is 0.0005");
  expect_refused(d + "robot: {roller_angle: -45, half_track: 0.235}", "robot.roller_angle", "-45", "and is 0 m");
  expect_refused(d + "robot: {roller_angle: [-45, 45, 45, -45]}", "robot.roller_angle", "-45, 45, 45, -45", "V_X, V_Y");
  expect_refused(d + "robot: {com: [0.4, 0]}", "robot.com", "[0.4, 0]", "presses on the floor");
  expect_refused(d + "robot: {total_inertia: 0.001}", "robot.total_inertia", "0.001", "more than");
  expect_refused(d + "model: rigid", "model", "rigid", "no_slip, viscous or coulomb");
  expect_refused(d + "model: no_slip\ninitial: {wheel_rates: [1, 0, 0, 0]}", "initial.wheel_rates", "[1, 0, 0, 0]",
                 "left out");
  expect_refused(d + "robot: {<<: {wheel_radius: 0.05}}", "robot.<<", "", "a merge key: must be left out");
  expect_refused("drive: {torque: [{start: 0}]}", "duration", "left out", "must be given");
  expect_refused("duration: 1\ndrive: {}", "drive", "{}", "exactly one");
  expect_refused("duration: 1\ndrive: {torque: [{start: 0}], torque_table: x.csv}", "drive", "torque", "exactly one");
  expect_refused("duration: 1\ndrive: {torque: [{constant: [1, 1, 1, 1]}]}", "drive.torque[0].start", "left out",
                 "must be given");
  expect_refused("duration: 1\ndrive: {torque: [{start: 1}, {start: 1}]}", "drive.torque[1].start", "1", "after");
  expect_refused("duration: 1\ndrive: {torque: [{start: 0, sin: [1, 1, 1, 1]}]}", "drive.torque[0].period", "left out",
                 "must be given");
  expect_refused("duration: 1\ndrive: {reference_motion: {V_X: {sin: 1}}}", "drive.reference_motion.period", "left out",
                 "must be given");
  EXPECT_THROW(load_scene(folder_.path("missing.yaml")), SceneError);
}

TEST_F(SceneTest, SuggestsTheKeyThatIsMeant) {
  const std::string d = kDrive;
  expect_refused(d + "robot: {body_mas: 3}", "robot.body_mas", "3", "; did you mean body_mass?");
  expect_refused(d + "robto: {}", "robto", "{}", "; did you mean robot?");
  expect_refused(d + "model: columb", "model", "columb", "; did you mean coulomb?");
  // The misspelling is the error, not the required key that is missing because of it.
  expect_refused("durtion: 1", "durtion", "1", "; did you mean duration?");
  expect_refused("duration: 1\ndrive: {torqe: [{start: 0}]}", "drive.torqe", "start", "; did you mean torque?");
  EXPECT_EQ(refusal(d + "robot: {colour: 3}").find("did you mean"), std::string::npos);
}

TEST_F(SceneTest, MethodIsAnyOfTheTableOfMethods) {
  const std::string d = kDrive;
  for (const std::string& name : method_names()) {
    EXPECT_EQ(load(d + "solver: {method: " + name + "}").solver.method, name);
    EXPECT_EQ(load_scene(folder_.write("scene.yaml", d), {{"solver.method", name}}).solver.method, name);
  }
  for (const std::string& name : method_names()) {
    expect_refused(d + "solver: {method: leapfrog}", "solver.method", "leapfrog", name);
  }
  expect_refused(d + "robot: {roller_inertia: 0, roller_damping: 0}\nfloor: {friction: 0}", "robot.roller_inertia", "0",
                 "> 0 where neither friction nor roller_damping");
  expect_refused(d + "solver: {method: [radau]}", "solver.method", "[radau]", method_names().back());
}

TEST_F(SceneTest, RefusesAMethodThatCannotIntegrateTheRobot) {
  const std::string massless = kDrive + std::string("robot: {roller_inertia: 0}\n");
  EXPECT_EQ(load(massless).solver.method, "radau");
  expect_refused(massless + "solver: {method: dopri5}", "solver.method", "dopri5", "roller_inertia is 0");
  EXPECT_EQ(load(massless + "model: no_slip\nsolver: {method: dopri5}").solver.method, "dopri5");
  EXPECT_THROW(load_scene(folder_.write("scene.yaml", massless), {{"solver.method", "rosenbrock4"}}), SceneError);
}

TEST_F(SceneTest, SettingsStandInPlaceOfTheFile) {
  const std::string path = folder_.write(
      "scene.yaml", kDrive + std::string("model: viscous\nsolver: {relative_tolerance: 1e-3, control_period: 1}"));
  const Scene scene =
      load_scene(path, {{"model", "no_slip"}, {"solver.relative_tolerance", 1e-5}, {"solver.control_period", 0}});
  EXPECT_EQ(scene.model, Model::kNoSlip);
  EXPECT_EQ(scene.solver.relative_tolerance, 1e-5);
  EXPECT_DOUBLE_EQ(scene.solver.absolute_tolerance, 1e-8);
  EXPECT_EQ(scene.solver.control_period, 0);

  const auto refusal_of = [&](const SceneSettings& bad) {
    try {
      load_scene(path, bad);
    } catch (const SceneError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(refusal_of({{"model", "rigid"}}), path + ": model = rigid: must be no_slip, viscous or coulomb");
  EXPECT_EQ(refusal_of({{"solver.method", "leapfrog"}}).find(path + ": solver.method = leapfrog: must be radau"), 0u);
  EXPECT_EQ(refusal_of({{"robot.profile", "{name: paper, friction_scale: 2}"}}),
            path + ": robot.profile.friction_scale = 2: must be left out unless name is measured");
  EXPECT_EQ(refusal_of({{"model", "[viscous"}}).find(path + ": model = [viscous: is not YAML: "), 0u);
  const Scene measured = load_scene(path, {{"robot.profile", "{name: measured, friction_scale: 2}"}});
  EXPECT_TRUE((measured.robot.mu_1 == measured_robot(2).mu_1).all());
}

TEST_F(SceneTest, ResolvesDefaultsAndSettings) {
  const std::string path = folder_.write("scene.yaml", kDrive);
  const SceneSettings settings = {{"model", "viscous"},
                                  {"solver.method", "dopri5"},
                                  {"solver.relative_tolerance", 1e-5},
                                  {"solver.control_period", 0.002},
                                  {"robot.profile", "measured"},
                                  {"robot.dry_friction", 0.1},
                                  {"initial.pose", Eigen::Array3d(1, 2, 3)},
                                  {"output.contacts", "true"}};
  const YAML::Node resolved = YAML::Load(load_scene(path, settings).resolved), robot = resolved["robot"];
  EXPECT_EQ(resolved["model"].as<std::string>(), "viscous");
  EXPECT_EQ(resolved["solver"]["method"].as<std::string>(), "dopri5");
  EXPECT_EQ(resolved["solver"]["relative_tolerance"].as<double>(), 1e-5);
  EXPECT_EQ(resolved["solver"]["absolute_tolerance"].as<double>(), 1e-8);
  EXPECT_EQ(resolved["solver"]["control_period"].as<double>(), 0.002);
  EXPECT_EQ(robot["profile"].as<std::string>(), "measured");
  EXPECT_EQ(robot["dry_friction"].as<std::vector<double>>(), std::vector<double>(4, 0.1));
  EXPECT_EQ(robot["body_mass"].as<double>(), 30);
  EXPECT_EQ(resolved["initial"]["pose"].as<std::vector<double>>(), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(resolved["floor"]["holding_speed"].as<double>(), 0) << "the profile's, in model coulomb only";
  EXPECT_TRUE(resolved["output"]["contacts"].as<bool>());
}

TEST_F(SceneTest, HasAnIdOfItsContents) {
  const std::string id = id_of(load(kDrive));
  EXPECT_EQ(id, id_of(load(std::string("# the same\nfloor: {friction: [0.5, 0.5, 0.5, 0.5]}\n") + kDrive)));
  EXPECT_NE(id, id_of(load(std::string("output_rate: 99\n") + kDrive)));
  const char table[] = "duration: 1\ndrive: {torque_table: table.csv}";
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,2,3,4\n");
  const std::string of_table = id_of(load(table));
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,2,3,5\n");
  EXPECT_NE(id_of(load(table)), of_table);
}

TEST_F(SceneTest, NeedsNoDurationForCommands) {
  const auto load = [](const std::string& path) { return load_scene(path, {}, SceneUse::kCommands); };
  const Scene scene = load(folder_.write("scene.yaml", "robot: {body_mass: 20}\nsolver: {control_period: 0.01}"));
  EXPECT_EQ(scene.duration, 0);
  EXPECT_EQ(scene.robot.m, 20);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(load(folder_.write("scene.yaml", kDrive)).drive));
}

TEST_F(SceneTest, StartsForCommandsWithTheVelocityOfItsReferenceMotion) {
  const Scene scene = load_scene(
      folder_.write("scene.yaml", "drive: {reference_motion: {period: 1, V_Y: {cos: -0.5}, Omega: {constant: 0.25}}}"),
      {}, SceneUse::kCommands);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(scene.drive));
  EXPECT_EQ(scene.initial.V_Y(), -0.5);
  EXPECT_EQ(scene.initial.Omega(), 0.25);
}

TEST_F(SceneTest, OfNoFileHasTheDefaultsAndTheSettings) {
  const Scene of_file = load("duration: 1");
  const Scene scene = default_scene({});
  EXPECT_TRUE((scene.initial.values == of_file.initial.values).all());
  EXPECT_EQ(scene.robot.m, of_file.robot.m);
  EXPECT_EQ(scene.solver.relative_tolerance, of_file.solver.relative_tolerance);
  EXPECT_TRUE(std::holds_alternative<std::monostate>(scene.drive));
  EXPECT_TRUE(scene.files.empty());
  const Scene other = default_scene({{"solver.relative_tolerance", 1e-4},
                                     {"solver.control_period", 2e-3},
                                     {"robot.profile", "measured"},
                                     {"solver.method", "dopri5"}});
  EXPECT_DOUBLE_EQ(other.solver.absolute_tolerance, 1e-7);
  EXPECT_EQ(other.solver.control_period, 2e-3);
  EXPECT_GT(other.robot.dry_friction.minCoeff(), 0);
  EXPECT_EQ(other.floor.holding_speed, 1e-8);
  EXPECT_EQ(other.solver.method, "dopri5");
}

TEST_F(SceneTest, TablesHoldFromRowToRow) {
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,2,3,4\n0.5,5,6,7,8\n");
  const Scene scene = load("duration: 1\ndrive: {torque_table: table.csv}");
  const auto torque = make_torque_profile(scene);
  EXPECT_EQ(torque->begin_segment(0), 0.5);
  EXPECT_EQ(torque->value(0.5)[1], 2);  // the segment that was begun, also at its end
  EXPECT_TRUE(std::isinf(torque->begin_segment(0.5)));
  EXPECT_EQ(torque->value(9)[1], 6);
}

TEST_F(SceneTest, BoundsTheWork) {
  const std::string d = "drive: {torque: [{start: 0}]}\n";
  EXPECT_EQ(load(d + "duration: 1e6").output_rate, 100);  // 1e8 rows
  expect_refused(d + "duration: 1e6\noutput_rate: 101", "output_rate", "101",
                 "at most 1e+08 rows; there would be 1.01e+08");
  EXPECT_EQ(load(d + "duration: 1e3\nsolver: {control_period: 1e-6}").solver.control_period, 1e-6);
  expect_refused(d + "duration: 1001\nsolver: {control_period: 1e-6}", "solver.control_period", "1e-6",
                 "at most 1e+09 of them; it would have 1.001e+09");
  // A row that follows the beginning of a long period too closely would show the state at the beginning.
  EXPECT_EQ(load(d + "duration: 1e-3\noutput_rate: 1e4\nsolver: {control_period: 10}").output_rate, 1e4);
  expect_refused(d + "duration: 1e-3\noutput_rate: 1.1e4\nsolver: {control_period: 10}", "solver.control_period", "10",
                 "at most 100000 rows of output; it would have 110000");
}

TEST_F(SceneTest, DoubtsRollersThatTaperToAPoint) {
  EXPECT_EQ(warnings(kDrive), "");
  EXPECT_EQ(warnings(kDrive + std::string("robot: {roller_axis_radius: 0.0433}")), "");  // R cos(30 deg)
}

TEST_F(SceneTest, WarnsAsTheTableSays) {
  std::ifstream rows(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/warnings.txt");
  for (std::string row; std::getline(rows, row);) {
    const auto bar = row.find(" | ");
    const std::string scene =
        row.find("drive") < bar ? "duration: 1, " : "duration: 1, drive: {torque: [{start: 0}]}, ";
    EXPECT_NE(warnings("{" + scene + row.substr(1, bar - 1)).find(row.substr(bar + 3)), std::string::npos) << row;
  }
}

TEST_F(SceneTest, SaysWhereAHoldingSpeedHasNoEffect) {
  const std::string held = std::string(kDrive) + "floor: {holding_speed: 1e-6}\n";
  const auto finds = [&](const std::string& text) {
    return warnings(text).find("floor.holding_speed = ") != std::string::npos;
  };
  EXPECT_FALSE(finds(held));
  EXPECT_TRUE(finds(held + "model: viscous\n"));
  EXPECT_TRUE(finds(held + "model: no_slip\n"));
  EXPECT_TRUE(finds(held + "solver: {method: dopri5}\n"));
  EXPECT_FALSE(finds(held + "solver: {method: rosenbrock4}\n"));
  EXPECT_TRUE(finds(std::string(kDrive) + "floor: {holding_speed: 1e-3}\n")) << "as slip_regularization";
  EXPECT_TRUE(finds(std::string(kDrive) + "floor: {slip_regularization: 0.1, holding_speed: 2e-3}\n"));
  // The profile's own goes with model coulomb.
  EXPECT_FALSE(finds(std::string(kDrive) + "robot: {profile: measured}\nmodel: no_slip\n"));
}

TEST_F(SceneTest, TellsWhatHasNoEffectUnderStaticReactions) {
  const std::string up =
      std::string(kDrive) + "wrenches: [{force: [1, 2, 0], point: [0, 0, 1]}, {force: [0, 0, -20]}]\n";
  EXPECT_EQ(warnings(up + "robot: {normal_reactions: dynamic, com_height: 0.1}\n"), "");
}

TEST_F(SceneTest, RefusesWhatIsNoSceneFile) {
  expect_refused(kDrive + std::string("---\nduration: 3\n"), "scene.yaml:3:1", "---", "a scene is one");
  EXPECT_EQ(load(std::string("---\n") + kDrive + "...\n").duration, 1);
  EXPECT_EQ(load(std::string("\xEF\xBB\xBF") + kDrive).duration, 1);
  const auto refusal_of = [](const std::string& path) {
    try {
      load_scene(path);
    } catch (const SceneError& error) {
      return std::string(error.what());
    }
    return std::string("not refused");
  };
  EXPECT_EQ(refusal_of(folder_.path("")), folder_.path("") + ": is a folder; must be a scene file");
  EXPECT_EQ(refusal_of("/dev/zero"), "/dev/zero: is neither a file nor a pipe; must be a scene file");
  const std::string text = folder_.write("text", "root:x:0:0\n"), list = folder_.write("list", "- secret\n");
  EXPECT_EQ(refusal_of(text), text + ": scene = (text): must be keys with values");
  EXPECT_EQ(refusal_of(list), list + ": scene = (list): must be keys with values");
  const std::string twice = folder_.write("twice", "secret: 1\nsecret: 2\n");
  EXPECT_EQ(refusal_of(twice).find(twice + ": is not a scene: must have some of "), 0u) << refusal_of(twice);
  expect_refused(kDrive + std::string("duration: 3\n"), "duration", "3", "given twice; allowed once");
}

TEST_F(SceneTest, LargeOrDeepScenesAreRefusedBeforeTheyTakeMemory) {
  expect_refused(std::string(1'000'001, ' '), "scene.yaml", "", "longer than 1000000 bytes");
  expect_refused("duration: " + std::string(100'000, '['), "scene.yaml:1:", "", "more than 32");
  std::string dashes = "duration:\n  ";
  for (int k = 0; k < 100'000; ++k) dashes += "- ";
  expect_refused(dashes, "scene.yaml:2:65", "", "more than 32");
  EXPECT_EQ(load("duration: 1\n" + std::string(900'000, '\n')).duration, 1);
}

TEST_F(SceneTest, AliasesThatStandForMuchAreShownInShort) {
  std::string laughs = "duration: [&a0 [ha, ha]";
  for (int k = 1; k < 30; ++k) {
    const std::string before = "*a" + std::to_string(k - 1);
    laughs += ", &a" + std::to_string(k) + " [" + before + ", " + before + ", " + before + "]";
  }
  expect_refused(laughs + "]", "duration", "[&1 [ha, ha], &2 [*1, *1, *1], ", "...: must be a finite number");
  expect_refused("duration: &a [*a]", "duration", "&1 [*1]: must be a finite number", "");
}

TEST_F(SceneTest, QuotesWhatStandsInTheFile) {
  const std::string d = kDrive;
  expect_refused(d + R"("a\nb\e[31m": "c\r\td")", R"(: a\nb\x1b[31m = c\r\td: unknown key)", "", "");
  expect_refused(d + "robot: {\"\\e\": [\"\\a\", {\"\\n\": \"\\0\"}]}",
                 R"(robot.\x1b = ["\\x07", {"\\n": "\\x00"}]: unknown)", "", "");
  expect_refused(d + "\xff: \xfe", R"(: \xff = \xfe: unknown key)", "", "");
  expect_refused(d + "model: \"\"", "model = \"\": must be", "", "");
  const std::string long_text(50'000, 'x');
  EXPECT_LT(refusal(d + "model: " + long_text).size(), 300u);
  EXPECT_LT(refusal(d + "? " + long_text + "\n: " + long_text).size(), 400u);
  try {
    default_scene({{"model", "\"a\\nb" + long_text + '"'}});
    ADD_FAILURE() << "not refused";
  } catch (const SceneError& error) {
    EXPECT_EQ(std::string(error.what()).find("model = a\\nbxxx"), 0u);
    EXPECT_LT(std::string(error.what()).size(), 200u);
  }
}

TEST_F(SceneTest, TablesAreReadWholeOrNotAtAll) {
  const std::string scene = "duration: 1\ndrive: {torque_table: ";
  const auto refusal_of = [&](const std::string& table) {
    return refusal(scene + folder_.write("table.csv", table) + "}");
  };
  const std::string allowed = "; must be a CSV file with the columns t,fl,fr,bl,br";
  expect_refused(scene + "/proc/self/mem}", "drive.torque_table", "/proc/self/mem: cannot be read (Input/output error)",
                 allowed);
  expect_refused(scene + ".}", "drive.torque_table", ".: is a folder", allowed);
  expect_refused(scene + "/dev/zero}", "drive.torque_table", "/dev/zero: is neither a file nor a pipe", allowed);
  expect_refused(scene + "gone.csv}", "drive.torque_table", "gone.csv: cannot be read (No such file or directory)",
                 allowed);
  for (const char* header : {"t,fl,fl,bl,br", "t,fl,fr,bl,br,fl"}) {
    EXPECT_NE(
        refusal_of(header + std::string("\n0,1,2,3,4\n")).find("table.csv:1: header: column fl twice; must be the "),
        std::string::npos);
  }
  EXPECT_NE(refusal_of("root:x:0:0:root\n").find("table.csv:1: header: no column t; must be"), std::string::npos);
  EXPECT_EQ(refusal_of("root:x:0:0:root\n").find("root:"), std::string::npos) << "shows a file that is no table";
  EXPECT_NE(refusal_of("t,fl,fr,bl,br,\n0,1,2,3,4,\n").find("header: 6 columns"), std::string::npos);
  // What the shell's programs write: a byte order mark, Windows' line ends, quotes, an empty line, no newline at the
  // end.
  folder_.write("table.csv", "\xEF\xBB\xBF\"br\", t,fl,fr,bl\r\n4,0,1,2,3\r\n\r\n-1, 1 ,-1,-1,-1");
  const auto torque = make_torque_profile(load(scene + "table.csv}"));
  EXPECT_EQ(torque->begin_segment(0), 1);
  EXPECT_TRUE((torque->value(0.5) == Wheels(1, 2, 3, 4)).all());
}

// A row of commas takes no more memory than its file does, as it is read.
TEST_F(SceneTest, TablesTakeMemoryForWhatMattersAlone) {
  const auto most_memory = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss / 1024;  // MiB
  };
  const std::string commas(10'000'000, ',');
  for (const std::string& table : {"t,fl,fr,bl,br\n0,1,1,1,1\n1" + commas, "t,fl,fr,bl,br" + commas + "\n"}) {
    folder_.write("table.csv", table);
    const long before = most_memory();
    EXPECT_NE(refusal("duration: 1\ndrive: {torque_table: table.csv}").find("table.csv:"), std::string::npos);
    EXPECT_LT(most_memory() - before, 200);
  }
}

TEST_F(SceneTest, NumbersOfTablesHaveLimits) {
  const auto refusal_of = [&](const std::string& kind, const std::string& row) {
    folder_.write("table.csv", "t,fl,fr,bl,br\n" + row);
    return refusal("duration: 1\ndrive: {" + kind + ": table.csv}");
  };
  const auto expect_ends = [](const std::string& message, const std::string& end) {
    EXPECT_NE(message.find("table.csv:2: " + end), std::string::npos) << message;
  };
  expect_ends(refusal_of("torque_table", "0,0,0,3.1e6,0"),
              "bl = 3.1e6: must be a finite number from -3e+06 to 3e+06 N m");
  expect_ends(refusal_of("velocity_table", "0,-1.1e6,0,0,0"),
              "fl = -1.1e6: must be a finite number from -1e+06 to 1e+06 rad/s");
  expect_ends(refusal_of("torque_table", "1.1e9,0,0,0,0"), "t = 1.1e9: must be a finite number from -1e+09 to 1e+09 s");
  expect_ends(refusal_of("torque_table", "0,0x1p3,0,0,0"), "fl = 0x1p3: must be a finite number");
  expect_ends(refusal_of("torque_table", "0,0,0,0,nan"), "br = nan: must be a finite number");
  expect_ends(refusal_of("torque_table", std::string("0,1\0x,0,0,0", 12)), "fl = 1\\x00x: must be a finite number");
  expect_ends(refusal_of("torque_table", "0,\x1b" + std::string(50'000, 'x')), "0,\\x1bxxx");
  EXPECT_LT(refusal_of("torque_table", "0,\x1b" + std::string(50'000, 'x')).size(), 300u);
}

TEST_F(SceneTest, MotorsAreSampledAt1kHz) {
  folder_.write("table.csv", "t,fl,fr,bl,br\n0,1,1,1,1\n");
  EXPECT_EQ(load("duration: 1\ndrive: {velocity_table: table.csv}").solver.control_period, 1e-3);
  EXPECT_EQ(load("duration: 1\ndrive: {torque_table: table.csv}").solver.control_period, 0);
  EXPECT_EQ(load("duration: 1\ndrive: {torque_table: table.csv}\nmotors: {}").solver.control_period, 1e-3);
  EXPECT_EQ(load("duration: 1\ndrive: {torque_table: table.csv}\nmotors: {}\nsolver: {control_period: 0.02}")
                .solver.control_period,
            0.02);
}

// Keys beyond the paper.

/// The keys of a document below `above`; values are YAML.
void collect_keys(const YAML::Node& node, const std::string& above, SceneSettings& keys) {
  for (const auto& entry : node) {
    const std::string key = (above.empty() ? "" : above + ".") + entry.first.Scalar();
    keys.emplace_back(key, YAML::Dump(entry.second));
    if (entry.second.IsMap()) collect_keys(entry.second, key, keys);
  }
}

/// How far the extended equations take a scene from the paper's within 50 ms, the largest difference of its state.
double effect_of_extended_equations(const Scene& scene) {
  std::array<State, 2> ends{scene.initial, scene.initial};
  for (const bool extended : {false, true}) {
    const std::unique_ptr<TorqueProfile> torque = make_torque_profile(scene);
    torque->begin_segment(0);
    make_integrator({scene.model, scene.robot, scene.floor, scene.initial, *torque, scene.solver, extended})
        ->advance(ends[extended], 0, 0.05, 0.05);
  }
  return (ends[0].values - ends[1].values).abs().maxCoeff();
}

// A key that the paper's equations do not know has no effect unless `beyond_the_paper` names it. Each key of a scene
// that has all of them, alone, in a motion that slips.
TEST_F(SceneTest, KeysThatThePaperLacksChooseTheExtendedEquations) {
  const SceneFile base{folder_.path("scene.yaml"),
                       "{duration: 1, solver: {relative_tolerance: 1e-9}, initial: {twist: [0.3, 0.2, 1]}, "
                       "drive: {torque: [{start: 0, constant: [3, -2, 1, 3]}]}}"};
  SceneSettings keys;
  collect_keys(YAML::LoadFile(YOUBOT_BASE_SIM_SOURCE_DIR "/test/fuzz/scene/every_key.yaml"), "", keys);
  std::map<std::string, double> known;
  int compared = 0;
  for (const SceneSetting& key : keys) {
    Scene scene;
    try {
      scene = load_scene(base, {key});
    } catch (const SceneError&) {
      continue;  // makes sense with others only
    }
    if (std::holds_alternative<VelocityTable>(scene.drive) || !scene.load_schedule.empty()) continue;
    const double effect = effect_of_extended_equations(scene);
    if (beyond_the_paper(scene)) {
      known[key.key] = effect;
    } else {
      EXPECT_LT(effect, 1e-6) << key.key << " = " << key.value << " has an effect that a scene with it does not have";
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
  for (const char* key : {"robot.normal_reactions", "floor.slope", "floor.spin_radius", "floor.patches"}) {
    EXPECT_GT(known[key], 1e-5) << key;
  }
}

}  // namespace
}  // namespace youbot_base_sim
