#include "verdict.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/reaction_record.h"
#include "youbot_base_sim/record/run_audit.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kMinPath = 1e-3;  // m: that of a robot that moves at the speed where both tolerances meet
constexpr double kTiny = 1e-7;     // rad and m/s, between a motion and its neighbours

double cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A run of a scene.
struct Motion {
  std::vector<Eigen::Vector3d> rows;  // x, y (m), psi times the distance of the wheels' centres from O
  double path = 0;                    // of the base, or of a wheel's rim if that is longer, m
  std::string doubt;                  // why it is called unreliable
  std::string failure;                // what ended it, but for tipping over
};

Motion run(const Scene& scene) {
  Motion motion;
  const double arm = std::hypot(scene.robot.h, scene.robot.l);
  try {
    Simulation simulation(scene);
    RowLoop rows(simulation);
    try {
      while (rows.next()) {
        const State& x = simulation.state();
        motion.rows.emplace_back(x.x(), x.y(), arm * x.psi());
      }
    } catch (const TippedOver&) {
    }
    motion.path = std::max(rows.path().base, rows.path().wheels.maxCoeff());
    motion.doubt = unreliability_reason(simulation, rows.energy());
  } catch (const std::exception& error) {
    motion.failure = error.what();
  }
  return motion;
}

/// Largest distance over the rows that both have, m.
double distance(const Motion& a, const Motion& b) {
  double most = 0;
  for (std::size_t k = 0; k < std::min(a.rows.size(), b.rows.size()); ++k) {
    most = std::max(most, (a.rows[k] - b.rows[k]).norm());
  }
  return most;
}

Scene at_tolerance(Scene scene, double tolerance) {
  scene.solver.method = "radau";
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  return scene;
}

/// The scene from a start that differs by `offset`, rad and m/s, another one at each wheel.
Scene neighbour(Scene scene, double offset) {
  State& x = scene.initial;
  x.phi() += offset * Wheels{1, -0.7, 0.9, -0.8};
  x.V_X() += 0.9 * offset;
  x.V_Y() -= 0.8 * offset;
  x.Omega() += offset;
  if (scene.model == Model::kNoSlip) NoSlipModel(scene.robot).constrain(x);
  return scene;
}

/// How far an offset moves the exact motion at most, m.
double movement(const Scene& exact, const Motion& motion, double offset) {
  double most = 0;
  for (const double signed_offset : {offset, -offset}) {
    most = std::max(most, distance(motion, run(neighbour(exact, signed_offset))));
  }
  return most;
}

/// Whether the motion itself explains the error: an offset grows as much, or one that the tolerance allows does as the
/// error. The second is for jumps, as of quantised set points, which tiny offsets rarely cross.
bool is_sensitive(const Scene& exact, const Motion& motion, double tolerance, double path, double error) {
  const double amplification = movement(exact, motion, kTiny) / (exact.robot.R * kTiny);
  if (error <= amplification * tolerance * path) return true;
  return movement(exact, motion, tolerance) > error / 3;
}

}  // namespace

Verdict judge(const Scene& scene) {
  Verdict verdict;
  const double start = cpu_time();
  const Motion motion = run(scene);
  verdict.cpu_time = cpu_time() - start;
  verdict.reason = motion.failure.empty() ? motion.doubt : motion.failure;
  if (!motion.failure.empty()) {
    verdict.outcome = Outcome::kFailed;
    return verdict;
  }

  Scene exact_scene = at_tolerance(scene, 1e-10);
  Motion exact = run(exact_scene);
  const double tolerance = scene.solver.relative_tolerance,
               path = motion.path + std::max(kMinPath, scene.solver.absolute_tolerance / tolerance);
  verdict.error = distance(motion, exact);
  verdict.allowed = kAllowed * tolerance * path;
  if (verdict.error <= verdict.allowed) {
    verdict.outcome = motion.doubt.empty() ? Outcome::kRight : Outcome::kDoubted;
  } else if (is_sensitive(exact_scene, exact, tolerance, path, verdict.error)) {
    verdict.outcome = Outcome::kSensitive;
  } else if (!motion.doubt.empty()) {
    verdict.outcome = Outcome::kWarned;
  } else {
    const bool is_known = distance(exact, run(at_tolerance(scene, 1e-9))) < verdict.error / 3;
    verdict.outcome = is_known && exact.doubt.empty() ? Outcome::kWrong : Outcome::kUndecided;
  }
  return verdict;
}

}  // namespace youbot_base_sim
