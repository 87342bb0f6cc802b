// A wheel held between two rollers, by this package and by CVODE with its own root finding: where each ends, after how
// many switches, in how much time.

#include <fmt/format.h>

#include <cmath>
#include <ctime>

#include "contestants.h"
#include "measure.h"

namespace {

using namespace youbot_base_sim;
using namespace youbot_base_sim::bench;

constexpr double kEnd = 10;          // s
constexpr double kTightest = 1e-10;  // of our own runs, from which distances are told
constexpr double kTolerances[] = {1e-3, 1e-4, 1e-5, 1e-6, 1e-8};

const Contestant& contestant(const std::vector<Contestant>& list, const std::string& key) {
  for (const Contestant& one : list) {
    if (one.key == key) return one;
  }
  throw RunFailure(key + " was not built: SUNDIALS is missing");
}

}  // namespace

int main() {
  const Scene scene = load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/bench/scenes/held_wheel.yaml");
  const std::vector<Contestant> all = contestants();
  const std::vector<double> rows = row_times(kEnd);
  try {
    const Run tightest = contestant(all, "youbot_base_sim").run(scene, kTightest, rows);
    fmt::print(
        "| solver | tolerance | end off, m | largest distance, m | switches | run time, s "
        "|\n|---|---|---|---|---|---|\n");
    for (const char* key : {"youbot_base_sim", "cvode"}) {
      for (const double tolerance : kTolerances) {
        const std::clock_t start = std::clock();
        Run run;
        try {
          run = contestant(all, key).run(scene, tolerance, rows);
        } catch (const RunFailure& failure) {
          run.failure = failure.what();
        }
        const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        if (!run.failure.empty()) {
          fmt::print("| {} | {:g} | {} | | | {:.2f} |\n", key, tolerance, run.failure, seconds);
          continue;
        }
        const Numbers &a = run.rows.back(), &b = tightest.rows.back();
        fmt::print("| {} | {:g} | {:.1e} | {:.1e} | {} | {:.3f} |\n", key, tolerance,
                   std::hypot(a[0] - b[0], a[1] - b[1]), difference(run.rows, tightest.rows).position,
                   run.counts.switches, seconds);
      }
    }
  } catch (const RunFailure& failure) {
    fmt::print(stderr, "held_wheel: {}\n", failure.what());
    return 1;
  }
  return 0;
}
