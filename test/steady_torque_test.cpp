// Torques at constant speed as two real bases have them, under the profile `measured` (docs/validation.md): figures
// aggregated from public records of a base A and a base B.

#include <gtest/gtest.h>

#include <cmath>

#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

struct Record {
  const char* motion;
  double scale;              // of the profile's friction: which base it is
  double V_X, V_Y, Omega;    // m/s, rad/s
  double duration, skipped;  // s: A at constant speed, B as it was driven, 4 s from rest
  double torque;             // mean over the wheels of the mean torque's size, N m
};

constexpr double kA = 1.3, kB = 0.76;
const Record kRecords[] = {
    {"A ahead", kA, 0.1, 0, 0, 20, 10, 0.237},
    {"A sideways", kA, 0, 0.1, 0, 20, 10, 1.024},
    {"A turning", kA, 0, 0, 0.314, 20, 10, 0.666},
    {"B ahead, slowly", kB, 0.1, 0, 0, 4, 0.5, 0.159},
    {"B ahead", kB, 0.2, 0, 0, 4, 0.5, 0.168},
    {"B at 30 degrees", kB, 0.2 * std::cos(M_PI / 6), 0.2 * std::sin(M_PI / 6), 0, 4, 0.5, 0.451},
    {"B at 45 degrees", kB, 0.2 * std::sqrt(0.5), 0.2 * std::sqrt(0.5), 0, 4, 0.5, 0.504},
    {"B at 60 degrees", kB, 0.2 * std::cos(M_PI / 3), 0.2 * std::sin(M_PI / 3), 0, 4, 0.5, 0.698},
    {"B sideways", kB, 0, 0.2, 0, 4, 0.5, 0.719},
};

double simulated(const Record& record) {
  Scene scene;
  scene.robot = measured_robot(record.scale);
  scene.solver.control_period = 1e-3;
  scene.drive = VelocityTable{{{0.0}, {NoSlipModel(scene.robot).dphi({record.V_X, record.V_Y, record.Omega})}}};
  Simulation simulation(scene);
  simulation.advance_to(record.skipped);
  constexpr double kInterval = 5e-3;  // s
  const int samples = static_cast<int>(std::lround((record.duration - record.skipped) / kInterval));
  Wheels sum = Wheels::Zero();
  for (int k = 1; k <= samples; ++k) {
    simulation.advance_to(record.skipped + k * kInterval);
    sum += simulation.torque();
  }
  return (sum / samples).abs().mean();
}

TEST(SteadyTorque, IsThatOfTwoRealBases) {
  for (const Record& record : kRecords) {
    EXPECT_NEAR(simulated(record), record.torque, std::max(0.1 * record.torque, 0.03)) << record.motion;
  }
}

/// The lateral pull, N, at which a base whose motors hold it moves at 0.1 m/s, if the pull grows by 6 N/s.
double sliding_force(double friction) {
  constexpr double kStep = 1.5, kInterval = 0.25;  // N, s
  Scene scene;
  scene.robot = measured_robot();
  scene.floor.f.setConstant(friction);
  scene.solver.control_period = 1e-3;
  scene.drive = VelocityTable{{{0.0}, {Wheels::Zero()}}};
  for (int k = 0; k < 300; ++k) {
    LoadSchedule::PlannedWrench more;
    more.start = k * kInterval;
    more.wrench.force.y() = kStep;
    scene.load_schedule.wrenches.push_back(more);
  }
  Simulation simulation(scene);
  double force = 0;
  while (simulation.state().V_Y() < 0.1 && force < 300 * kStep) {
    simulation.advance_to(simulation.time() + kInterval);
    force += kStep;
  }
  return force;
}

// The recipe of docs/howto.md.
TEST(SlowPull, TellsTheFrictionOfTheFloor) {
  for (const double friction : {0.2, 0.35, 0.5, 0.8}) {
    const double weight = RobotParameters().m_s() * FloorParameters().g;
    EXPECT_NEAR(1.41 * sliding_force(friction) / weight - 0.07, friction, 0.04);
  }
}

}  // namespace
}  // namespace youbot_base_sim
