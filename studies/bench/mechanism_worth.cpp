// Prints what each mechanism of Radau is worth: the work and the error of runs without it, relative to those with all.
// Usage: mechanism_worth FIRST COUNT [SCENE.yaml ...]: the scenes, or COUNT random scenes from number FIRST on.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "random_scenes/scene_generator.h"
#include "random_scenes/verdict.h"
#include "temporary_folder.h"
#include "youbot_base_sim/integration/radau_options.h"

namespace {

using namespace youbot_base_sim;

constexpr double kOff = std::numeric_limits<double>::infinity();

struct Variant {
  const char* name;
  std::function<void(RadauOptions&)> change;
};

const std::vector<Variant> kVariants = {
    {"all", [](auto&) {}},
    {"no primal-dual stiffness", [](auto& o) { o.primal_dual = false; }},
    {"at most 7 iterations", [](auto& o) { o.max_iterations = 7; }},
    {"at most 25 iterations", [](auto& o) { o.max_iterations = 25; }},
    {"no reuse of a matrix", [](auto& o) { o.reuses_matrix = false; }},
    {"friction mismatch not looked at", [](auto& o) { o.friction_mismatch = kOff; }},
    {"friction mismatch 0.1", [](auto& o) { o.friction_mismatch = 0.1; }},
    {"matrix mismatch not looked at", [](auto& o) { o.matrix_mismatch = kOff; }},
    {"kappa 0.01", [](auto& o) { o.convergence = 0.01; }},
    {"kappa 0.1", [](auto& o) { o.convergence = 0.1; }},
    {"first rate 0.1", [](auto& o) { o.first_rate = 0.1; }},
    {"curvature kept for ever", [](auto& o) { o.curvature_memory = 1; }},
    {"curvature of the last correction", [](auto& o) { o.curvature_memory = 0; }},
    {"no quadratic acceptance", [](auto& o) { o.curvature_margin = kOff; }},
    {"quadratic margin 3", [](auto& o) { o.curvature_margin = 3; }},
    {"rollers as for other methods", [](auto& o) { o.roller_scale = 1; }},
    {"roller scale 10", [](auto& o) { o.roller_scale = 10; }},
    {"filtered once", [](auto& o) { o.unseen_energy = -1; }},
    {"filtered twice whatever the energy", [](auto& o) { o.unseen_energy = kOff; }},
    {"no estimate of the pose", [](auto& o) { o.pose_time = kOff; }},
    {"pose: 1 ms", [](auto& o) { o.pose_time = 1e-3; }},
    {"pose: 2 ms", [](auto& o) { o.pose_time = 2e-3; }},
    {"no prediction", [](auto& o) { o.predicts = false; }},
    {"no line after a switch", [](auto& o) { o.line_after_switch = false; }},
    {"start always in the polynomial", [](auto& o) { o.far = kOff; }},
    {"start in the polynomial up to 1", [](auto& o) { o.far = 1; }},
    {"friction ends at switches", [](auto& o) { o.switch_transient = kOff; }},
    {"friction never leads", [](auto& o) { o.gripping_share = 0; }},
    {"gripping below 0.7", [](auto& o) { o.gripping_share = 0.7; }},
    {"gripping below 0.98", [](auto& o) { o.gripping_share = 0.98; }},
    {"start evaluated anew", [](auto& o) { o.start_by_motion = false; }},
    {"dense output without friction", [](auto& o) { o.dense_gripping_share = 0; }},
    {"no trend of the error", [](auto& o) { o.trend = false; }},
    {"safety 0.9", [](auto& o) { o.safety = 0.9; }},
    {"growth at most 5", [](auto& o) { o.max_growth = 5; }},
    {"shrinkage at least 0.1", [](auto& o) { o.max_shrinkage = 0.1; }},
};

Motion run(Scene scene, double tolerance, const RadauOptions& options = {}) {
  scene.solver.method = "radau";
  scene.solver.relative_tolerance = tolerance;
  scene.solver.absolute_tolerance = 1e-3 * tolerance;
  radau_options = options;
  return run(scene);
}

// Evaluations, factorizations, work and error (m) of a motion. Work is a fit to callgrind's instructions, in thousands:
// a try of a step, an iteration, a factorization.
using Figures = std::array<double, 4>;
Figures figures(const Motion& motion, const Motion& exact) {
  const IntegrationStatistics& s = motion.counts;
  const auto tries = static_cast<double>(s.steps + s.rejected_steps + s.location_steps);
  const auto iterations = static_cast<double>(s.newton_iterations), matrices = static_cast<double>(s.factorizations);
  return {1 + static_cast<double>(s.evaluations), 1 + matrices, 1 + 2.3 * tries + 1.3 * iterations + 2.5 * matrices,
          std::max(distance(motion, exact), 1e-12)};
}

// Of the runs of a variant.
struct Sums {
  Figures logs{};          // of ratios to "all"
  double worst_error = 0;  // over what is promised
  int runs = 0, broken = 0, unreliable = 0, failed = 0;
};

class Worth {
 public:
  void add(const Scene& scene, const std::vector<double>& tolerances) {
    const Motion exact = run(scene, kExact);
    if (!exact.failure.empty() || !exact.doubt.empty()) return;
    ++scenes_;
    for (const double tolerance : tolerances) {
      Motion with_all;
      for (std::size_t k = 0; k < kVariants.size(); ++k) {
        RadauOptions options;
        kVariants[k].change(options);
        const Motion tried = run(scene, tolerance, options);
        if (k == 0) with_all = tried;
        if (!with_all.failure.empty()) return;
        add(tried, with_all, exact, sums_[k]);
      }
    }
  }

  void print() const {
    fmt::print("{} scenes; work goes with the error to the power of -{:.2f}\n\n", scenes_, kPower);
    fmt::print(
        "| without or with | evaluations | factorizations | work | error | work at equal error | worst error / promise "
        "| "
        "broken promises | unreliable | failed |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t k = 0; k < kVariants.size(); ++k) {
      const Sums& s = sums_[k];
      Figures mean = s.logs;
      for (double& figure : mean) figure = std::exp(figure / std::max(1, s.runs));
      fmt::print("| {} | {:.3f} | {:.3f} | {:.2g} | {} | {} | {} |\n", kVariants[k].name, fmt::join(mean, " | "),
                 mean[2] * std::pow(mean[3], kPower), s.worst_error, s.broken, s.unreliable, s.failed);
    }
  }

 private:
  static constexpr double kExact = 1e-10;
  static constexpr double kPower = 0.2;  // of errors by work, as Cases 1 and 2 show

  static void add(const Motion& tried, const Motion& with_all, const Motion& exact, Sums& sums) {
    sums.failed += !tried.failure.empty();
    if (!tried.failure.empty()) return;
    const Figures now = figures(tried, exact), all = figures(with_all, exact);
    ++sums.runs;
    for (std::size_t k = 0; k < now.size(); ++k) sums.logs[k] += std::log(now[k] / all[k]);
    sums.unreliable += !tried.doubt.empty();
    if (!tried.doubt.empty() || !(tried.promised > 0)) return;
    sums.broken += now.back() > tried.promised;
    sums.worst_error = std::max(sums.worst_error, now.back() / tried.promised);
  }

  int scenes_ = 0;
  std::vector<Sums> sums_ = std::vector<Sums>(kVariants.size());
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: mechanism_worth FIRST COUNT [SCENE.yaml ...]\n");
    return 2;
  }
  Worth worth;
  for (int k = 3; k < argc; ++k) worth.add(load_scene(argv[k]), {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9});
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
