// Prints what each mechanism of Radau is worth: the work and the error of runs without it, relative to those with all.
// Usage: mechanism_worth FIRST COUNT [SCENE.yaml ...]: the scenes, or COUNT random scenes from number FIRST on.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "random_scenes/scene_generator.h"
#include "temporary_folder.h"
#include "youbot_base_sim/integration/radau_options.h"
#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/simulation.h"

namespace {

using namespace youbot_base_sim;

constexpr double kOff = std::numeric_limits<double>::infinity();

struct Variant {
  const char* name;
  std::function<void(RadauOptions&)> change;
};

const std::vector<Variant> kVariants = {
    {"all", [](RadauOptions&) {}},
#define OPTION(text, change)              \
  {                                       \
    text, [](RadauOptions& o) { change; } \
  }
    OPTION("no primal-dual stiffness", o.primal_dual = false),
    OPTION("no damping of corrections", o.free_corrections = 99; o.free_growth = kOff),
    OPTION("no free corrections", o.free_corrections = 0),
    OPTION("no reuse of a matrix", o.reuses_matrix = false),
    OPTION("friction mismatch not looked at", o.friction_mismatch = kOff),
    OPTION("no early estimate after one iteration", o.early_estimate_correction = kOff),
    OPTION("no early rejection", o.early_reject_error = kOff),
    OPTION("early rejection above 1", o.early_reject_error = 1),
    OPTION("no quadratic acceptance", o.curvature_margin = kOff),
    OPTION("quadratic margin 3", o.curvature_margin = 3),
    OPTION("curvature kept for ever", o.curvature_memory = 1),
    OPTION("curvature of the last correction", o.curvature_memory = 0),
    OPTION("rate not kept", o.min_rate = o.max_rate = o.first_rate),
    OPTION("kept rate at least 0.1", o.min_rate = 0.1),
    OPTION("kept rate up to 1", o.max_rate = 0.999),
    OPTION("any correction predicts", o.predictable_fraction = kOff),
    OPTION("kappa 0.01", o.convergence = 0.01),
    OPTION("kappa 0.1", o.convergence = 0.1),
    OPTION("rollers as for other methods", o.roller_scale = 1),
    OPTION("rims as the tolerance says", o.rim_scale = 0),
    OPTION("damping at the end", o.weakest_damping = false),
    OPTION("stiffness ratio 2", o.transient_stiffness_ratio = 2),
    OPTION("stiffness ratio 10", o.transient_stiffness_ratio = 10),
    OPTION("filtered once", o.second_filter = false),
    OPTION("filtered twice whatever the energy", o.unseen_energy = kOff),
    OPTION("no estimate of the pose", o.pose_estimate = false),
    OPTION("pose never counts in full", o.pose_in_full = false),
    OPTION("pose always counts in full", o.pose_share = 1),
    OPTION("no prediction", o.predicts = false),
    OPTION("no friction-led prediction", o.follows_friction = false),
    OPTION("no line after a switch", o.line_after_switch = false),
    OPTION("start always in the polynomial", o.far = kOff),
    OPTION("friction always leads", o.small_error = 0),
    OPTION("friction ends at switches", o.switch_transient = kOff),
    OPTION("friction always crosses switches", o.switch_transient = 0),
    OPTION("gripping below 0.7", o.gripping_share = 0.7),
    OPTION("gripping below 0.98", o.gripping_share = 0.98),
    OPTION("start evaluated anew", o.start_by_motion = false),
    OPTION("start: friction of the slip", o.start_by_motion = false; o.reuses_friction = false),
    OPTION("dense output without friction", o.dense_friction = false),
    OPTION("dense output: gripping below 0.9", o.dense_gripping_share = 0.9),
    OPTION("failed step times 0.2", o.failure_shrinkage = 0.2),
    OPTION("failed step times 0.5", o.failure_shrinkage = 0.5),
    OPTION("no trend of the error", o.trend = false),
    OPTION("safety 0.7", o.safety = 0.7),
    OPTION("safety 0.9", o.safety = 0.9),
    OPTION("growth at most 5", o.max_growth = 5),
    OPTION("shrinkage at least 0.1", o.max_shrinkage = 0.1),
    OPTION("damping down to 1/4", o.min_damping = 0.25),
    OPTION("at most 15 iterations", o.max_iterations = 15),
    OPTION("at most 50 iterations", o.max_iterations = 50),
#undef OPTION
};

struct Run {
  std::vector<Eigen::Vector3d> rows;  // x, y, psi at the wheels' centres, m
  IntegrationStatistics counts;
  double promised = 0;  // m
  bool reliable = false;
};

std::optional<Run> run(Scene scene, double tolerance, const RadauOptions& options) {
  scene.solver.method = "radau";
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  scene.solver.radau = &options;
  Run run;
  const double arm = std::hypot(scene.robot.h, scene.robot.l);
  try {
    Simulation simulation(scene);
    RowLoop rows(simulation);
    try {
      while (rows.next()) {
        const State& x = simulation.state();
        run.rows.emplace_back(x.x(), x.y(), arm * x.psi());
      }
    } catch (const TippedOver&) {
    }
    run.counts = simulation.statistics();
    run.promised = promised_error(simulation, rows.path());
    run.reliable = unreliability_reason(simulation, rows, nullptr).empty();
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return run;
}

double distance(const Run& a, const Run& b) {
  double most = 0;
  for (std::size_t k = 0; k < std::min(a.rows.size(), b.rows.size()); ++k) {
    most = std::max(most, (a.rows[k] - b.rows[k]).norm());
  }
  return most;
}

// Instructions by a fit to callgrind's, in thousands: a try of a step, an iteration, a factorization.
double work(const IntegrationStatistics& s) {
  return 2.3 * static_cast<double>(s.steps + s.rejected_steps + s.location_steps) +
         1.3 * static_cast<double>(s.newton_iterations) + 2.5 * static_cast<double>(s.factorizations);
}

// Sums over the runs of a variant.
struct Sums {
  double evaluations = 0, iterations = 0, factorizations = 0, work = 0, error = 0;  // logarithms of ratios to "all"
  double worst_error = 0;                                                           // over what is promised
  int runs = 0, broken = 0, unreliable = 0, failed = 0;
};

class Worth {
 public:
  void add(const Scene& scene, const std::vector<double>& tolerances) {
    const std::optional<Run> exact = run(scene, kExact, RadauOptions());
    if (!exact || !exact->reliable) return;
    ++scenes_;
    for (const double tolerance : tolerances) {
      std::optional<Run> with_all;
      for (std::size_t k = 0; k < kVariants.size(); ++k) {
        RadauOptions options;
        kVariants[k].change(options);
        const std::optional<Run> tried = run(scene, tolerance, options);
        if (k == 0) with_all = tried;
        if (!with_all) return;
        add(tried, *with_all, *exact, sums_[k]);
      }
      logs_.push_back({std::log(work(with_all->counts)), std::log(floored(distance(*with_all, *exact)))});
    }
  }

  void print() const {
    fmt::print("{} scenes; work goes with the error to the power of -{:.2f}\n\n", scenes_, kPower);
    fmt::print(
        "| without or with | evaluations | iterations | factorizations | work | error | work at equal error | "
        "worst error / promise | broken promises | unreliable | failed "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t k = 0; k < kVariants.size(); ++k) {
      const Sums& s = sums_[k];
      const auto mean = [&](double sum) { return std::exp(sum / std::max(1, s.runs)); };
      fmt::print("| {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.2g} | {} | {} | {} |\n",
                 kVariants[k].name, mean(s.evaluations), mean(s.iterations), mean(s.factorizations), mean(s.work),
                 mean(s.error), mean(s.work + kPower * s.error), s.worst_error, s.broken, s.unreliable, s.failed);
    }
  }

 private:
  static constexpr double kExact = 1e-10;
  static constexpr double kPower = 0.2;  // of errors by work, as Cases 1 and 2 show
  static double floored(double error) { return std::max(error, 1e-12); }

  static void add(const std::optional<Run>& tried, const Run& with_all, const Run& exact, Sums& sums) {
    if (!tried) {
      ++sums.failed;
      return;
    }
    const IntegrationStatistics &a = tried->counts, &b = with_all.counts;
    const auto ratio = [](std::uint64_t x, std::uint64_t y) {
      return std::log(static_cast<double>(std::max<std::uint64_t>(x, 1)) /
                      static_cast<double>(std::max<std::uint64_t>(y, 1)));
    };
    const double error = distance(*tried, exact);
    ++sums.runs;
    sums.evaluations += ratio(a.evaluations, b.evaluations);
    sums.iterations += ratio(a.newton_iterations, b.newton_iterations);
    sums.factorizations += ratio(a.factorizations, b.factorizations);
    sums.work += std::log((1 + work(a)) / (1 + work(b)));
    sums.error += std::log(floored(error) / floored(distance(with_all, exact)));
    sums.unreliable += !tried->reliable;
    sums.broken += tried->reliable && error > tried->promised;
    if (tried->reliable && tried->promised > 0) sums.worst_error = std::max(sums.worst_error, error / tried->promised);
  }

  int scenes_ = 0;
  std::vector<Sums> sums_ = std::vector<Sums>(kVariants.size());
  std::vector<std::pair<double, double>> logs_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: mechanism_worth FIRST COUNT [SCENE.yaml ...]\n");
    return 2;
  }
  Worth worth;
  if (argc > 3) {
    std::vector<double> tolerances;
    for (double exponent = 3; exponent <= 9.01; exponent += 1) tolerances.push_back(std::pow(10, -exponent));
    for (int k = 3; k < argc; ++k) worth.add(load_scene(argv[k]), tolerances);
  }
  const TemporaryFolder folder;
  const auto first = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  const auto count = static_cast<std::uint32_t>(argc > 3 ? 0 : std::strtoul(argv[2], nullptr, 10));
  for (std::uint32_t number = first; number < first + count; ++number) {
    const std::string path = folder.path("scene.yaml");
    const RandomScene made = random_scene_file(number, "table.csv");
    std::ofstream(path) << made.text;
    std::ofstream(folder.path("table.csv")) << made.table;
    try {
      const Scene scene = load_scene(path);
      if (slips(scene.model)) worth.add(scene, {1e-4, 1e-5, 3e-7});
    } catch (const SceneError&) {
    }
  }
  worth.print();
}
