// The equations beyond the paper: right-hand sides by an independent program (test/data/beyond/golden_rhs.json), and
// laws of mechanics that they must obey.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <type_traits>

#include "temporary_folder.h"
#include "youbot_base_sim/integration/slip_system.h"
#include "youbot_base_sim/physics/power_balance.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {
namespace {

using Json = nlohmann::json;
using System = SlipSystem<ExtendedModel<CoulombLaw>>;

Wheels wheels(const Json& json) {
  const auto numbers = json.get<std::array<double, kWheels>>();
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

// JSON is YAML.
Scene scene_of(const Json& keys) {
  static const TemporaryFolder folder;
  Json json = keys;
  json["duration"] = 1;
  return load_scene(folder.write("scene.yaml", json.dump()));
}

struct Motion {
  explicit Motion(const Json& golden, const Scene& scene)
      : model(scene.robot, scene.floor, scene.load_schedule.at(0)), torque(golden), state(state_of(golden)) {}

  static State state_of(const Json& golden) {
    State x;
    const Json& u = golden["velocities"];
    for (int k = 0; k < 3; ++k) {
      x.values(k, 0) = golden["pose"][k].get<double>();
      x.values(k, 1) = u[k].get<double>();
    }
    for (int i = 0; i < kWheels; ++i) {
      x.dphi()[i] = u[3 + i].get<double>();
      x.dgamma()[i] = u[7 + i].get<double>();
    }
    x.phi() = wheels(golden["phi_tilde"]);
    return x;
  }

  struct Torque : HeldTorque {
    explicit Torque(const Json& golden) { set(wheels(golden["torques"])); }
  };
  ExtendedModel<CoulombLaw> model;
  Torque torque;
  State state;
};

Json golden() {
  Json cases;
  for (const char* name : {"golden_rhs.json", "golden_rhs_angle.json"}) {
    std::ifstream file(std::string(YOUBOT_BASE_SIM_SOURCE_DIR "/test/data/beyond/") + name);
    const Json read = Json::parse(file);
    for (const Json& golden : read["cases"]) cases.push_back(golden);
  }
  return cases;
}

// The largest entries set the scale: friction and accelerations of rollers are differences of large numbers.
void expect_near(const Wheels& value, const Json& expected, double scale, const std::string& what) {
  for (int i = 0; i < kWheels; ++i) EXPECT_NEAR(value[i], expected[i].get<double>(), 1e-12 * scale) << what << i;
}

TEST(BeyondModelTest, MeetsRightHandSidesOfAnIndependentProgram) {
  int cases = 0;
  for (const Json& golden : golden()) {
    const std::string name = golden["feature"].get<std::string>() + " " + golden["scene"].dump();
    SCOPED_TRACE(name);
    Motion motion(golden, scene_of(golden["scene"]));
    State x = motion.state;
    System system(motion.model, motion.torque, x);
    if (golden.contains("wheel")) {
      system.enter_sliding(golden["wheel"].get<int>(), 0, x, 0);
      EXPECT_NEAR(system.sharing(golden["wheel"].get<int>(), x, 0).alpha, golden["alpha"].get<double>(), 1e-11);
    }
    const ExtendedContacts c = system.contacts(x, 0);
    State dxdt;
    system(x, dxdt, 0);
    // Slip is a difference of velocities of 1 m/s, and friction turns over nu = 1e-3 m/s.
    const double F_scale = 2000 * c.N.maxCoeff();
    expect_near(c.N, golden["N"], F_scale, "N");
    expect_near(c.F_X, golden["F_X"], F_scale, "F_X");
    expect_near(c.F_Y, golden["F_Y"], F_scale, "F_Y");
    expect_near(c.M_S, golden["M_S"], F_scale * 1e-2, "M_S");
    if (!golden.contains("wheel")) {
      expect_near(c.V_PX, golden["V_PX"], 1, "V_PX");
      expect_near(c.V_PY, golden["V_PY"], 1, "V_PY");
      if (golden.contains("friction")) expect_near(c.f, golden["friction"], 1, "f");
    }
    const Json& accelerations = golden["accelerations"];
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(dxdt.values(k, 1), accelerations[k].get<double>(), 1e-12 * F_scale) << k;
    const RobotParameters& robot = motion.model.robot();
    for (int i = 0; i < kWheels; ++i) {
      EXPECT_NEAR(dxdt.dphi()[i], accelerations[3 + i].get<double>(), 1e-12 * F_scale * robot.R / robot.J_1) << i;
      EXPECT_NEAR(dxdt.dgamma()[i], accelerations[7 + i].get<double>(), 1e-12 * F_scale * robot.R / robot.J_2) << i;
    }
    ++cases;
  }
  EXPECT_EQ(cases, 80);
}

// Of all forces on base and wheels, those of inertia included, about any point on the floor. Gyroscopic moments of the
// wheels and the change of their spin count; nothing of this is in the code in this form.
TEST(BeyondModelTest, MomentsAboutAnyPointOfTheFloorVanish) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  for (const Json& golden : golden()) {
    const Scene scene = scene_of(golden["scene"]);
    if (scene.robot.normal_reactions != NormalReactions::kDynamic || golden.contains("wheel")) continue;
    const Motion motion(golden, scene);
    const System system(motion.model, motion.torque, motion.state);
    const ExtendedContacts c = system.contacts(motion.state, 0);
    if (c.tipping != Side::kNone) continue;
    State dxdt;
    system(motion.state, dxdt, 0);
    const RobotParameters& robot = motion.model.robot();  // with its loads
    using Vector = Eigen::Vector3d;
    const double Omega = motion.state.Omega();
    const Vector v{motion.state.V_X(), motion.state.V_Y(), 0}, turn{0, 0, Omega};
    const Vector dv{dxdt.V_X(), dxdt.V_Y(), 0}, dturn{0, 0, dxdt.Omega()};
    const Vector point{coordinate(random), coordinate(random), -robot.R};
    const double g = scene.floor.g, along = g * std::sin(scene.floor.slope),
                 heading = scene.floor.uphill - motion.state.psi();
    const Vector gravity{-along * std::cos(heading), -along * std::sin(heading), -g * std::cos(scene.floor.slope)};
    const auto acceleration = [&](const Vector& r) {
      return Vector(dv + turn.cross(v) + dturn.cross(r) + turn.cross(turn.cross(r)));
    };
    Vector moment = Vector::Zero(), force = Vector::Zero();
    const auto add = [&](const Vector& at, const Vector& F) {
      force += F;
      moment += (at - point).cross(F);
    };
    const Vector com{robot.a_X, robot.a_Y, robot.a_Z};
    add(com, robot.m * (gravity - acceleration(com)));
    for (int i = 0; i < kWheels; ++i) {
      const Vector hub{robot.rho_X()[i], robot.rho_Y()[i], 0};
      add(hub, robot.m_1 * (gravity - acceleration(hub)));
      add({hub[0], hub[1] + c.Delta_Y[i], -robot.R}, {c.F_X[i], c.F_Y[i], c.N[i]});
      // d/dt of J_1 dphi about the axle, which turns with the platform
      moment -= Vector{-robot.J_1 * Omega * motion.state.dphi()[i], robot.J_1 * dxdt.dphi()[i], 0};
    }
    const AppliedLoads applied = scene.load_schedule.at(0);
    for (const Wrench& wrench : applied.wrenches) {
      Vector W = wrench.force;
      if (wrench.fixed) W = Eigen::AngleAxisd(-motion.state.psi(), Vector::UnitZ()) * W;
      add(wrench.point, W);
    }
    const double scale = robot.m_s() * g;
    EXPECT_NEAR(force[2], 0, 1e-11 * scale) << golden["scene"].dump();
    EXPECT_NEAR(moment[0], 0, 1e-11 * scale) << golden["scene"].dump();
    EXPECT_NEAR(moment[1], 0, 1e-11 * scale) << golden["scene"].dump();
  }
}

// The power of all forces is that of drives, bearings, rollers, floor and what acts from outside, each by itself.
TEST(BeyondModelTest, PowerBalances) {
  for (const Json& golden : golden()) {
    const Motion motion(golden, scene_of(golden["scene"]));
    const System system(motion.model, motion.torque, motion.state);
    State dxdt;
    system(motion.state, dxdt, 0);
    const Wheels M = motion.torque.value(0);
    const PowerBalance balance =
        power_balance(motion.model.robot(), motion.state, motion.model.details(system.contacts(motion.state, 0)), M);
    EXPECT_NEAR(dxdt.work(), balance.net(), 1e-10 * (1 + std::abs(dxdt.work()))) << golden["scene"].dump();
  }
}

// Newton's matrix: minus the derivative of the forces, where normal reactions stay.
TEST(BeyondModelTest, DampingIsTheDerivativeOfTheForces) {
  for (const Json& golden : golden()) {
    const Scene scene = scene_of(golden["scene"]);
    if (scene.robot.normal_reactions == NormalReactions::kDynamic || golden.contains("wheel")) continue;
    const Motion motion(golden, scene);
    const System system(motion.model, motion.torque, motion.state);
    const State& x = motion.state;
    const Wheels M = motion.torque.value(0);
    const ExtendedContacts c = system.contacts(x, 0);
    DampingMatrix G;
    motion.model.damping(x.velocities(), c, G);
    const auto forces = [&](const Velocities& u) {
      return motion.model.forces(u, system.contacts(u, x.phi(), x.pose(), M), M);
    };
    const double step = 1e-7;
    const double scale = 2e-5 * (G.platform_platform[0][0] + G.platform_platform[1][1]).maxCoeff();
    for (int k = 0; k < 3; ++k) {
      Velocities above = x.velocities(), below = above;
      above.v[k] += step;
      below.v[k] -= step;
      const Velocities slope = (1 / (2 * step)) * (forces(below) - forces(above));
      const PlatformMatrix C = motion.model.inertia().coriolis_derivative(x.velocities().v);
      for (int row = 0; row < 3; ++row) EXPECT_NEAR(G.platform_platform[row][k].sum(), slope.v[row] + C[k][row], scale);
      EXPECT_LT((G.dphi_platform[k] - slope.dphi).abs().maxCoeff(), scale);
      EXPECT_LT((G.dgamma_platform[k] - slope.dgamma).abs().maxCoeff(), scale);
    }
    for (int i = 0; i < kWheels; ++i) {
      Velocities above = x.velocities(), below = above;
      above.dgamma[i] += step;
      below.dgamma[i] -= step;
      const Velocities slope = (1 / (2 * step)) * (forces(below) - forces(above));
      for (int row = 0; row < 3; ++row) EXPECT_NEAR(G.platform_dgamma[row][i], slope.v[row], scale);
      EXPECT_NEAR(G.dphi_dgamma[i], slope.dphi[i], scale);
      EXPECT_NEAR(G.dgamma_dgamma[i], slope.dgamma[i], scale);
    }
  }
}

// What inertia adds to the moments that the reactions balance, about OY, about OX and about the axle that rocks, N m,
// while no force acts on the platform: -m a_Z times the acceleration of the body's centre, and gyroscopic moments.
Wheels inertial_moments(const RobotParameters& robot, const Inertia& inertia, const Velocities& u) {
  const double V_X = u.v[0], V_Y = u.v[1], Omega = u.v[2];
  const Eigen::Vector3d dv = inertia.M_v_inverse * inertia.coriolis(u.v).head<3>().matrix();
  const double w_X = dv[0] - robot.a_Y * dv[2] - Omega * (V_Y + robot.a_X * Omega);
  const double w_Y = dv[1] + robot.a_X * dv[2] + Omega * (V_X - robot.a_Y * Omega);
  const Wheels gyroscopic = -robot.J_1 * Omega * u.dphi;
  const double rocking = robot.load_sharing == LoadSharing::kRockingFront  ? gyroscopic[0] + gyroscopic[1]
                         : robot.load_sharing == LoadSharing::kRockingRear ? gyroscopic[2] + gyroscopic[3]
                                                                           : 0;
  return {-robot.m * robot.a_Z * w_X, -robot.m * robot.a_Z * w_Y + gyroscopic.sum(), rocking, 0};
}

// Where reactions follow the motion, minus the derivative of the forces is the damping less the coupling, and less what
// both leave out: the derivatives of Coriolis forces, and of inertial_moments in the balances that the coupling's
// columns answer. All are quadratic in the velocities, so that their central differences are exact. Those of friction
// are off by (step / nu)^2 / 2 of the stiffness: no third derivative of friction exceeds 3 stiffness / nu^2.
TEST(BeyondModelTest, CouplingCompletesTheDerivativeOfTheForces) {
  constexpr double kRounding = 1e-8;  // of the stiffness: slips are differences of 1 m/s, and steps of 1e-7 m/s
  int rocking = 0, lifted = 0, cases = 0;
  Json all = golden();
  for (Json& golden : all) {
    // None of these has spin friction besides: every other one gets it.
    if (cases % 2 == 1) golden["scene"]["floor"]["spin_radius"] = 1e-3;
    const Scene scene = scene_of(golden["scene"]);
    if (scene.robot.normal_reactions != NormalReactions::kDynamic || golden.contains("wheel")) continue;
    const Motion motion(golden, scene);
    const System system(motion.model, motion.torque, motion.state);
    const State& x = motion.state;
    const Wheels M = motion.torque.value(0);
    const ExtendedContacts c = system.contacts(x, 0);
    if (c.tipping != Side::kNone) continue;
    ++cases;
    rocking += scene.robot.load_sharing != LoadSharing::kEqualWheels;
    lifted += (c.N == 0).any();
    DampingMatrix G;
    motion.model.damping(x.velocities(), c, G);
    ReactionCoupling coupling;
    system.couple(x.velocities(), c, M, G, coupling);
    const auto forces = [&](const Velocities& u) {
      return motion.model.forces(u, system.contacts(u, x.phi(), x.pose(), M), M);
    };
    const auto damped = [&](const Velocities& du) {  // G du
      Velocities Q = {Wheels::Zero(), G.dphi_dphi * du.dphi + G.dphi_dgamma * du.dgamma,
                      G.dgamma_dphi * du.dphi + G.dgamma_dgamma * du.dgamma};
      for (int row = 0; row < 3; ++row) {
        Q.v[row] = (G.platform_dphi[row] * du.dphi + G.platform_dgamma[row] * du.dgamma).sum();
        for (int k = 0; k < 3; ++k) Q.v[row] += G.platform_platform[row][k].sum() * du.v[k];
        Q.dphi += G.dphi_platform[row] * du.v[row];
        Q.dgamma += G.dgamma_platform[row] * du.v[row];
      }
      return Q;
    };
    const RobotParameters& robot = motion.model.robot();
    const Inertia& inertia = motion.model.inertia();
    const Velocities u = x.velocities();
    const double step = 1e-7, stiffness = (G.platform_platform[0][0] + G.platform_platform[1][1]).maxCoeff();
    const double allowed = (std::pow(step / motion.model.regularization_speed(), 2) + kRounding) * stiffness;
    for (int k = 0; k < 11; ++k) {
      Velocities du = {Wheels::Zero(), Wheels::Zero(), Wheels::Zero()};
      (k < 3 ? du.v[k] : k < 7 ? du.dphi[k - 3] : du.dgamma[k - 7]) = step;
      const auto slope = [&](const auto& function) {
        const auto above = function(u + du), below = function(u - du);
        return std::decay_t<decltype(above)>((1 / (2 * step)) * (above - below));
      };
      const Velocities by_difference = slope(forces);
      const Wheels moments = slope([&](const Velocities& at) { return inertial_moments(robot, inertia, at); });
      Velocities by_formula = (-1 / step) * damped(du);
      by_formula.v += slope([&](const Velocities& at) { return inertia.coriolis(at.v); });
      for (int m = 0; m < 3; ++m) {
        const Velocities& row = coupling.balance[m];
        const double moment = (row.v * du.v + row.dphi * du.dphi + row.dgamma * du.dgamma).sum() / step;
        by_formula = by_formula + (moment + moments[m]) * coupling.forces[m];
      }
      const Velocities apart = by_difference - by_formula;
      EXPECT_LT(apart.v.abs().maxCoeff(), allowed) << k << ' ' << golden["scene"].dump();
      EXPECT_LT(apart.dphi.abs().maxCoeff(), allowed) << k << ' ' << golden["scene"].dump();
      EXPECT_LT(apart.dgamma.abs().maxCoeff(), allowed) << k << ' ' << golden["scene"].dump();
    }
  }
  EXPECT_GT(cases, 10);
  EXPECT_GT(rocking, 0);
  EXPECT_GT(lifted, 0);
}

// A limit surface without spin is Coulomb's law, and everything switched off is the paper's model.
TEST(BeyondModelTest, IsThePapersWithEverythingOff) {
  for (const Json& golden : golden()) {
    if (golden["feature"] != "paper") continue;
    const Scene scene = scene_of(golden["scene"]);
    const Motion motion(golden, scene);
    const SlipSystem<PaperModel<CoulombLaw>> paper(PaperModel<CoulombLaw>(scene.robot, scene.floor), motion.torque,
                                                   motion.state);
    const System beyond(motion.model, motion.torque, motion.state);
    State a, b;
    paper(motion.state, a, 0);
    beyond(motion.state, b, 0);
    EXPECT_LT(((a.values - b.values).abs() / (1 + a.values.abs())).maxCoeff(), 1e-12);
  }
}

}  // namespace
}  // namespace youbot_base_sim
