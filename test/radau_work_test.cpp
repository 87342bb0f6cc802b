// Work and error of Radau in motions of independent solvers (test/data/reference): what each of its mechanisms is worth
// (docs/tuning/tuning.md) shows here once it is lost.

#include <gtest/gtest.h>

#include <cmath>

#include "reference_rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {
namespace {

/// Geometric means over motions and tolerances.
struct Means {
  double evaluations = 1, factorizations = 1, error = 1;  // error: the largest of a motion's poses, m
};

Means means() {
  const std::pair<std::string, std::string> cases[] = {
      {"case1_counter_clockwise_coulomb", "/config/scenes/case1_counter_clockwise.yaml"},
      {"case2_coulomb", "/config/scenes/case2.yaml"},
      {"small_regularization", ""},
      {"torque_reversal", ""},
      {"coasting_to_rest", ""},
      {"drive_dry", ""}};
  const double tolerances[] = {1e-3, 1e-4, 1e-5, 3e-7};
  const double share = 1.0 / static_cast<double>(std::size(cases) * std::size(tolerances));
  Means means;
  for (const auto& [name, scene] : cases) {
    const std::string path =
        YOUBOT_BASE_SIM_SOURCE_DIR + (scene.empty() ? "/test/data/reference/" + name + ".yaml" : scene);
    for (const double tolerance : tolerances) {
      Simulation simulation(load_scene(
          path, {{"solver.relative_tolerance", tolerance}, {"solver.absolute_tolerance", 1e-3 * tolerance}}));
      double error = 0;
      for (const auto& row : reference_rows("reference/" + name)) {
        simulation.advance_to(std::stod(row[0]));
        const State& x = simulation.state();
        error = std::max(error, std::hypot(x.x() - std::stod(row[1]), x.y() - std::stod(row[2])));
      }
      const IntegrationStatistics& counts = simulation.statistics();
      means.evaluations *= std::pow(static_cast<double>(counts.evaluations), share);
      means.factorizations *= std::pow(static_cast<double>(counts.factorizations), share);
      means.error *= std::pow(error, share);
    }
  }
  return means;
}

TEST(RadauWork, IsNoMoreThanItsMechanismsLeave) {
  const Means now = means();
  EXPECT_LT(now.evaluations, 20380);    // 20341
  EXPECT_LT(now.factorizations, 4940);  // 4925; 4896 with matrices that are no derivative
  EXPECT_LT(now.error, 3.45e-6);        // 3.39e-6
}

}  // namespace
}  // namespace youbot_base_sim
