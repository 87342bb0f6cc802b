// Prints, to the last bit, what the library computes for a program. library_test compiles it by different flags, and
// the library's functions must not be replaced by what these make of the headers' inline ones.

#include <youbot_base_sim/drive/base_driver.h>
#include <youbot_base_sim/physics/no_slip_model.h>
#include <youbot_base_sim/physics/shared_contact.h>
#include <youbot_base_sim/sensors/imu.h>
#include <youbot_base_sim/sensors/wheel_odometry.h>
#include <youbot_base_sim/simulation.h>

#include <cstdio>

using namespace youbot_base_sim;

namespace {

template <class Values>
void print(const char* name, const Values& values) {
  std::printf("%s", name);
  for (int i = 0; i < values.size(); ++i) std::printf(" %a", values.data()[i]);
  std::printf("\n");
}

Scene scene_of(Model model, bool reacting) {
  Scene scene = default_scene({});
  scene.model = model;
  scene.solver.control_period = 1e-3;
  if (reacting) {
    scene.robot.normal_reactions = NormalReactions::kDynamic;
    scene.robot.a_Z = 0.1;
  }
  return scene;
}

void drive(Model model, bool reacting) {
  const Scene scene = scene_of(model, reacting);
  BaseDriver driver({});
  Simulation simulation(scene);
  WheelOdometry odometry({}, scene.initial.phi(), 0.03);
  Imu imu({}, scene.floor, 0, scene.initial);
  driver.command(0, DriveCommand{SetPoint{DriveMode::kVelocity, 3.1}, SetPoint{DriveMode::kVelocity, -2.3},
                                 SetPoint{DriveMode::kTorque, 0.7}, SetPoint{DriveMode::kVelocity, 4.7}});
  for (int k = 1; k <= 100; ++k) {
    advance_to(simulation, 0.02 * k, [&](double t, const State& state) { return driver.sample(t, state.dphi()); });
    odometry.update(simulation.state().phi());
    imu.update(simulation.time(), simulation.state());
  }
  print("state", simulation.state().values);
  print("odometry", odometry.pose());
  print("covariance", odometry.pose_covariance());
  print("imu", imu.acceleration());
  print("friction", simulation.contacts().F_X);
  print("energy", Eigen::Vector2d(simulation.kinetic_energy(), simulation.power_balance().net()));
}

}  // namespace

int main() {
  // Inline functions that the library uses too, so that this program has bodies of its own.
  const RobotParameters robot = measured_robot();
  const Inertia inertia(robot);
  const Wheels own = sums(robot.rho_X(), robot.rho_Y(), robot.tan_delta()) + inertia.coriolis({0.1, 0.2, 0.3, 0}) +
                     Wheels::Constant(NoSlipModel(robot).max_decay_rate());
  if (!own.allFinite()) std::printf("not finite\n");

  print("reactions", normal_reactions(robot, {}));
  drive(Model::kNoSlip, false);
  drive(Model::kViscous, false);
  drive(Model::kCoulomb, false);
  drive(Model::kCoulomb, true);
}
