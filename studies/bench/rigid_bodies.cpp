// A scene from rest by the Open Dynamics Engine, with a body for each roller, beside this package: error against run
// time; then mean velocities of other bases by both. See scripts/study rigid_bodies.

#include <fmt/format.h>
#include <ode/ode.h>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include "youbot_base_sim/simulation.h"

namespace {

using namespace youbot_base_sim;

constexpr double kDuration = 10, kRow = 0.05;     // s
constexpr double kRollerMass = 0.02;              // kg
constexpr double kUpright = 1e3, kAcross = 1e-3;  // kg m^2, of the body about axes that the floor holds; of wheels

struct Wheel {
  dBodyID body;
  dJointID hinge;
  std::vector<dBodyID> rollers;
  double X, Y, delta, limit;  // m, m, rad, f N in N
};

/// The base of a scene, at rest at x = y = psi = 0, in a world of ODE.
class World {
 public:
  explicit World(const Scene& scene) : scene_(scene), robot_(scene.robot) {
    const double carried = kWheels * (robot_.m_1 * (robot_.h * robot_.h + robot_.l * robot_.l) + kAcross);
    const double own = robot_.I_s - carried - robot_.m * (robot_.a_X * robot_.a_X + robot_.a_Y * robot_.a_Y);
    platform_ = body(robot_.a_X, robot_.a_Y, 0, robot_.m, kUpright, kUpright, own);
    const dJointID floor = dJointCreatePlane2D(world_, nullptr);
    dJointAttach(floor, platform_, nullptr);
    const Wheels rho_X = robot_.rho_X(), rho_Y = robot_.rho_Y(), N = Simulation(scene).contacts().N;
    for (int i = 0; i < kWheels; ++i) {
      Wheel wheel{
          nullptr, nullptr, {}, rho_X[i], rho_Y[i], (i == 0 || i == 3 ? -1 : 1) * M_PI / 4, scene.floor.f[i] * N[i]};
      const double rim = robot_.rollers * kRollerMass * robot_.R_d * robot_.R_d;
      wheel.body =
          body(wheel.X, wheel.Y, 0, robot_.m_1 - robot_.rollers * kRollerMass, kAcross, robot_.J_1 - rim, kAcross);
      wheel.hinge = hinge(platform_, wheel.body, wheel.X, wheel.Y, 0, {0, 1, 0}, robot_.mu_1[i]);
      for (int k = 0; k < robot_.rollers; ++k) {
        // From straight down, about the axle; forward rotation takes a roller at the bottom backward.
        const double angle = scene.initial.phi()[i] + k * pitch();
        const double px = wheel.X - robot_.R_d * std::sin(angle), pz = -robot_.R_d * std::cos(angle);
        wheel.rollers.push_back(body(px, wheel.Y, pz, kRollerMass, robot_.J_2, robot_.J_2, robot_.J_2));
        const Eigen::Vector3d axis(std::cos(wheel.delta) * std::cos(angle), std::sin(wheel.delta),
                                   -std::cos(wheel.delta) * std::sin(angle));
        hinge(wheel.body, wheel.rollers.back(), px, wheel.Y, pz, axis, robot_.mu_2[i]);
      }
      wheels_.push_back(wheel);
    }
  }
  ~World() { dWorldDestroy(world_); }

  void step(const Wheels& torque, double h, bool quick) {
    for (int i = 0; i < kWheels; ++i) {
      dJointAddHingeTorque(wheels_[i].hinge, torque[i]);
      touch(wheels_[i]);
    }
    quick ? dWorldQuickStep(world_, h) : dWorldStep(world_, h);
    dJointGroupEmpty(contacts_);
  }

  Eigen::Vector2d place() const {
    dVector3 O;
    dBodyGetRelPointPos(platform_, -robot_.a_X, -robot_.a_Y, 0, O);
    return {O[0], O[1]};
  }

  /// V_X, V_Y, Omega.
  Eigen::Vector3d velocity() const {
    dVector3 O, own;
    dBodyGetRelPointVel(platform_, -robot_.a_X, -robot_.a_Y, 0, O);
    dBodyVectorFromWorld(platform_, O[0], O[1], O[2], own);
    return {own[0], own[1], dBodyGetAngularVel(platform_)[2]};
  }

 private:
  double pitch() const { return 2 * M_PI / robot_.rollers; }

  dBodyID body(double x, double y, double z, double mass, double I_x, double I_y, double I_z) {
    const dBodyID made = dBodyCreate(world_);
    dMass inertia;
    dMassSetParameters(&inertia, mass, 0, 0, 0, I_x, I_y, I_z, 0, 0, 0);
    dBodySetMass(made, &inertia);
    dBodySetPosition(made, x, y, z);
    return made;
  }

  /// With a bearing of viscous friction mu, N m s, implicit in time.
  dJointID hinge(dBodyID a, dBodyID b, double x, double y, double z, const Eigen::Vector3d& axis, double mu) {
    const dJointID joint = dJointCreateHinge(world_, nullptr);
    dJointAttach(joint, b, a);
    dJointSetHingeAnchor(joint, x, y, z);
    dJointSetHingeAxis(joint, axis[0], axis[1], axis[2]);
    dJointSetHingeParam(joint, dParamVel, 0);
    dJointSetHingeParam(joint, dParamFMax, 1e6);
    dJointSetHingeParam(joint, dParamCFM, 1 / mu);
    return joint;
  }

  /// A contact at the roller that stands on the floor: friction up to f N, reached at slip nu.
  void touch(const Wheel& wheel) {
    for (dBodyID roller : wheel.rollers) {
      const dReal* p = dBodyGetPosition(roller);
      dVector3 at;
      dBodyGetPosRelPoint(platform_, p[0], p[1], p[2], at);
      const double angle = std::atan2(wheel.X - robot_.a_X - at[0], -at[2]);
      if (std::abs(angle) > pitch() / 2) continue;
      dContact contact{};
      contact.surface.mode = dContactFDir1 | dContactMu2 | dContactSlip1 | dContactSlip2 | dContactSoftCFM;
      contact.surface.mu = contact.surface.mu2 = wheel.limit;  // a force, without dContactApprox1
      contact.surface.slip1 = contact.surface.slip2 = scene_.floor.nu / wheel.limit;
      contact.surface.soft_cfm = 1;  // pressed on by gravity, not by the engine
      dBodyVectorToWorld(platform_, 1, 0, 0, contact.fdir1);
      dBodyGetRelPointPos(platform_, wheel.X - robot_.a_X,
                          wheel.Y - robot_.a_Y + robot_.R_d * std::tan(angle) * std::tan(wheel.delta), -robot_.R,
                          contact.geom.pos);
      contact.geom.normal[2] = 1;
      const dJointID joint = dJointCreateContact(world_, contacts_, &contact);
      dJointAttach(joint, roller, nullptr);
      return;
    }
  }

  const Scene& scene_;
  const RobotParameters& robot_;
  dWorldID world_ = dWorldCreate();
  dJointGroupID contacts_ = dJointGroupCreate(0);
  dBodyID platform_ = nullptr;
  std::vector<Wheel> wheels_;
};

/// Where O is at each row, m, and the run time, s; `advance(t)` goes to a row and returns its O.
struct Path {
  template <class Advance>
  explicit Path(const Advance& advance) {
    const std::clock_t start = std::clock();
    for (int k = 1; k * kRow <= kDuration + 1e-9; ++k) rows.push_back(advance(k * kRow));
    time = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  }

  void report(const std::string& method, const Path& reference) const {
    double error = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) error = std::max(error, (rows[k] - reference.rows[k]).norm());
    fmt::print("| {} | {:.2g} | {:.2g} |\n", method, 1e3 * error, kDuration / time);
    std::fflush(stdout);
  }

  std::vector<Eigen::Vector2d> rows;
  double time;
};

Path simulated(Scene scene, double tolerance) {
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  Simulation simulation(scene);
  return Path([&](double t) {
    simulation.advance_to(t);
    return Eigen::Vector2d(simulation.state().x(), simulation.state().y());
  });
}

/// Mean velocities of a base with viscous bearings alone, under constant torques to the left and in yaw, from 3 to 6 s
/// after it stood.
void compare_velocities(const char* path) {
  Scene scene = load_scene(path, {}, SceneUse::kCommands);
  RobotParameters& robot = scene.robot;
  robot.dry_friction.setZero();
  robot.roller_dry_friction.setZero();
  scene.motors.reset();
  const double lever = robot.R / (robot.R - robot.R_d), resistance = robot.mu_1[0] + 2 * lever * lever * robot.mu_2[0];
  const Wheels torque = resistance * Wheels(-3, 3, 1, -1);  // N m: about 3 and 1 rad/s
  Simulation simulation(scene);
  simulation.set_torque(torque);
  World world(scene);
  constexpr int kSteps = 6000;
  constexpr double kStep = 1e-3;  // s
  Eigen::Vector3d ours = Eigen::Vector3d::Zero(), theirs = ours;
  for (int k = 1; k <= kSteps; ++k) {
    simulation.advance_to(k * kStep);
    world.step(torque, kStep, false);
    if (2 * k <= kSteps) continue;
    const State& x = simulation.state();
    ours += 2.0 / kSteps * Eigen::Vector3d(x.V_X(), x.V_Y(), x.Omega());
    theirs += 2.0 / kSteps * world.velocity();
  }
  fmt::print("| {} | {:.4f}, {:.4f} | {:.4f}, {:.4f} | {:+.2f}, {:+.2f} |\n", path, ours[1], ours[2], theirs[1],
             theirs[2], 100 * (theirs[1] / ours[1] - 1), 100 * (theirs[2] / ours[2] - 1));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  dInitODE();
  const Scene scene = load_scene(argv[1], {{"initial.pose", "[0, 0, 0]"}, {"initial.twist", "[0, 0, 0]"}});
  const Wheels torque = Simulation(scene).torque();
  const Path reference = simulated(scene, 1e-10);
  fmt::print("| method | off by, mm | times real time |\n|---|---|---|\n");
  for (const double tolerance : {1e-2, 1e-3, 1e-5})
    simulated(scene, tolerance).report(fmt::format("youbot_base_sim, tolerance {:g}", tolerance), reference);
  for (const bool quick : {true, false}) {
    for (const double h : {5e-3, 1e-3, 2e-4}) {
      World world(scene);
      const Path path([&](double /*t*/) {
        for (double left = kRow; left > 0.5 * h; left -= h) world.step(torque, h, quick);
        return world.place();
      });
      path.report(fmt::format("ODE, {} solver, steps of {:g} ms", quick ? "iterative" : "direct", 1e3 * h), reference);
    }
  }
  fmt::print("\n| base | V_Y (m/s), Omega (rad/s) | by ODE | off by, % |\n|---|---|---|---|\n");
  for (int k = 2; k < argc; ++k) compare_velocities(argv[k]);
}
