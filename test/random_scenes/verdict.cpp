#include "verdict.h"

#include <time.h>

#include <algorithm>
#include <cmath>

#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/physics/no_slip_model.h"
#include "youbot_base_sim/physics/reaction_record.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kTiny = 1e-7;  // rad and m/s, between a motion and its neighbours

double cpu_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Explicit methods ignore the holding speed.
Scene exact_scene(Scene scene, const std::string& method, double tolerance) {
  if (find_method(scene.solver.method)->is_explicit) scene.floor.holding_speed = 0;
  scene.solver.method = method;
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

/// The motion by which a scene is judged: at 1e-10, or a hundredth of the scene's tolerance if that is less. Where that
/// is unreliable, at a looser tolerance, up to 1e-8 and a tenth of the scene's.
struct Exact {
  Exact(const Scene& judged, const std::string& by) : method(by) {
    const double most = 0.1 * judged.solver.relative_tolerance;
    for (tolerance = method == "radau" ? std::min(1e-10, 0.1 * most) : std::min(1e-8, most);; tolerance *= 10) {
      scene = exact_scene(judged, method, tolerance);
      motion = run(scene);
      if (motion.doubt.empty() || tolerance > 0.5e-8 || 10 * tolerance > 1.001 * most) break;
    }
  }

  /// Whether it is known better than the error that it shows.
  bool shows(const Scene& judged, double error) const {
    return motion.doubt.empty() && distance(motion, run(exact_scene(judged, method, 10 * tolerance))) < error / 3;
  }

  /// How far an offset of the start moves it at most, m.
  double movement(double offset) const {
    return std::max(distance(motion, run(neighbour(scene, offset))), distance(motion, run(neighbour(scene, -offset))));
  }

  std::string method;
  double tolerance;
  Scene scene;
  Motion motion;
};

/// Whether the motion itself explains the error: what the tolerance promises grows to it as a tiny offset does, or an
/// offset of that size moves the motion as far. The second is for jumps, as of quantised set points.
bool is_sensitive(const Exact& exact, double promised, double error) {
  const double offset = promised / kPromised;
  const double amplification = exact.movement(kTiny) / (exact.scene.robot.R * kTiny);
  return error <= amplification * offset || exact.movement(offset) > error / 3;
}

}  // namespace

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
    motion.counts = simulation.statistics();
    motion.promised = promised_error(simulation, rows.path());
    motion.doubt = unreliability_reason(simulation, rows, nullptr);
  } catch (const std::exception& error) {
    motion.failure = error.what();
  }
  return motion;
}

double distance(const Motion& a, const Motion& b) {
  double most = 0;
  for (std::size_t k = 0; k < std::min(a.rows.size(), b.rows.size()); ++k) {
    most = std::max(most, (a.rows[k] - b.rows[k]).norm());
  }
  return most;
}

Verdict judge(const Scene& scene, const std::string& judge_method) {
  Verdict verdict;
  const auto time_of_run = [&](Motion& motion) {
    const double start = cpu_time();
    motion = run(scene);
    return cpu_time() - start;
  };
  Motion motion;
  verdict.cpu_time = time_of_run(motion);
  for (int again = 0; again < 2 && std::abs(verdict.cpu_time / scene.duration - 1.5) < 0.5; ++again) {
    verdict.cpu_time = std::min(verdict.cpu_time, time_of_run(motion));  // other programs slow a processor down
  }
  verdict.reason = motion.failure.empty() ? motion.doubt : motion.failure;
  if (!motion.failure.empty()) {
    verdict.outcome = Outcome::kFailed;
    return verdict;
  }

  const Exact exact(scene, judge_method);
  verdict.error = distance(motion, exact.motion);
  verdict.allowed = motion.promised;
  if (!motion.doubt.empty()) {
    verdict.outcome = verdict.error <= verdict.allowed ? Outcome::kDoubted : Outcome::kWarned;
  } else if (verdict.error <= verdict.allowed) {
    verdict.outcome = Outcome::kRight;
  } else if (!exact.shows(scene, verdict.error)) {
    verdict.outcome = Outcome::kUndecided;
  } else {
    verdict.outcome = is_sensitive(exact, motion.promised, verdict.error) ? Outcome::kSensitive : Outcome::kWrong;
  }
  return verdict;
}

}  // namespace youbot_base_sim
