// Runs one solver on one scene, once or, while that is quick, some times, and prints as JSON what came of it: see
// scripts/work_precision.

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <boost/version.hpp>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>

#include "odeint.h"
#include "run.h"
#include "youbot_base_sim/simulation.h"
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
#include "sundials.h"
#endif

namespace {

using namespace youbot_base_sim;
using namespace youbot_base_sim::bench;

Run run_simulation(const Task& task) {
  Scene scene = task.scene;
  scene.solver.relative_tolerance = task.setting;
  scene.solver.absolute_tolerance = 1e-3 * task.setting;
  Simulation simulation(scene);
  Run run;
  for (const double t : task.times) {
    simulation.advance_to(t);
    run.rows.push_back(numbers_of(simulation.state()));
  }
  const IntegrationStatistics& statistics = simulation.statistics();
  run.counts.steps = static_cast<std::int64_t>(statistics.steps + statistics.fallback_steps);
  run.counts.rejected = static_cast<std::int64_t>(statistics.rejected_steps);
  run.counts.location_steps = static_cast<std::int64_t>(statistics.location_steps);
  run.counts.factorizations = static_cast<std::int64_t>(statistics.factorizations);
  run.counts.switches = static_cast<std::int64_t>(statistics.switches);
  run.counts.evaluations = run.counts.jacobians = -1;
  return run;
}

struct Solver {
  const char* name;
  Run (*run)(const Task& task);
};

constexpr Solver kSolvers[] = {
    {"radau", run_simulation},
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
    {"cvode", run_cvode},
    {"arkode_4", run_arkode_4},
    {"arkode_5", run_arkode_5},
#endif
    {"rosenbrock4", run_rosenbrock4},
    {"rosenbrock4_as_shipped", run_rosenbrock4_as_shipped},
    {"implicit_euler", run_implicit_euler},
    {"dopri5", run_dopri5},
    {"runge_kutta4", run_runge_kutta4},
};

const Solver& solver_of(const std::string& name) {
  for (const Solver& solver : kSolvers) {
    if (name == solver.name) return solver;
  }
  throw SceneError(fmt::format("--solver = {}: must be one of those that --list prints", name));
}

/// What the solvers were built with and for; SUNDIALS itself comes from the system.
nlohmann::json about() {
  nlohmann::json json;
  for (const Solver& solver : kSolvers) json["solvers"].push_back(solver.name);
  json["compiler"] = "g++ " __VERSION__;
  json["flags"] = YOUBOT_BASE_SIM_BENCH_FLAGS;
#if defined(__AVX512F__)
  json["instruction_set"] = "AVX-512";
#elif defined(__AVX2__)
  json["instruction_set"] = "AVX2";
#elif defined(__AVX__)
  json["instruction_set"] = "AVX";
#else
  json["instruction_set"] = "without AVX";
#endif
  json["libraries"] = fmt::format("Boost {}.{}", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000);
#ifdef YOUBOT_BASE_SIM_BENCH_SUNDIALS
  json["libraries"] = json["libraries"].get<std::string>() + ", SUNDIALS " + sundials_version();
#endif
  return json;
}

// Of this process and no other: what else the machine does then disturbs least.
double processor_time() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Run time is the least of the repeats.
nlohmann::json measure(const Solver& solver, const Task& task) {
  constexpr double kLong = 1, kEnough = 1;  // s: of a run that is not repeated, and of all runs
  constexpr int kMinRepeats = 3, kMaxRepeats = 10;
  double least = std::numeric_limits<double>::infinity(), total = 0, start = 0;
  int repeats = 0;
  Run run;
  try {
    do {
      start = processor_time();
      run = solver.run(task);
      const double taken = processor_time() - start;
      if (run.rows.size() != task.times.size()) throw RunFailure("rows are missing");
      total += taken;
      least = std::min(least, taken);
      ++repeats;
    } while (least < kLong && (repeats < kMinRepeats || (total < kEnough && repeats < kMaxRepeats)));
  } catch (const RunFailure& failure) {
    return {{"failure", failure.what()}, {"run_time", processor_time() - start}};
  }
  return {{"rows", run.rows},
          {"run_time", least},
          {"repeats", repeats},
          {"counts",
           {{"steps", run.counts.steps},
            {"rejected_steps", run.counts.rejected},
            {"location_steps", run.counts.location_steps},
            {"evaluations", run.counts.evaluations},
            {"jacobians", run.counts.jacobians},
            {"factorizations", run.counts.factorizations},
            {"switches", run.counts.switches}}}};
}

std::vector<double> row_times(double span, double rate) {
  std::vector<double> times;
  for (int k = 0; k <= span * rate * (1 + 1e-12); ++k) times.push_back(k / rate);
  return times;
}

}  // namespace

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  std::string path, name;
  SceneOverrides overrides;
  Task task;
  double span = 0, rate = 20;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("scene", po::value(&path)->required(), "scene file")
    ("solver", po::value(&name)->required(), "name of the solver")
    ("setting", po::value(&task.setting)->required(), "relative tolerance, or step (s) of a method with fixed steps")
    ("model", po::value(&overrides.model), "viscous or coulomb, in place of the scene's")
    ("span", po::value(&span), "s to simulate; the scene's duration unless given")
    ("rate", po::value(&rate), "rows a second")
    ("max-evaluations", po::value(&task.limits.max_evaluations), "of the right-hand side, after which to give up")
    ("list", "print the solvers and what they were built with");
  // clang-format on
  try {
    po::variables_map given;
    po::store(po::parse_command_line(argc, argv, options), given);
    if (given.count("list")) {
      std::cout << about().dump() << '\n';
      return 0;
    }
    po::notify(given);
    task.scene = load_scene(path, overrides);
    task.times = row_times(span > 0 ? std::min(span, task.scene.duration) : task.scene.duration, rate);
    std::cout << measure(solver_of(name), task).dump() << '\n';
  } catch (const std::exception& error) {
    fmt::print(stderr, "solve: {}\n", error.what());
    return 2;
  }
  return 0;
}
