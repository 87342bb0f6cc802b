// Runs one solver on one scene, repeats quick runs, and prints rows, counts and run time as JSON.
// scripts/work_precision drives it.

#include <fmt/format.h>
#include <sundials/sundials_config.h>

#include <boost/program_options.hpp>
#include <boost/version.hpp>
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>

#include "solver.h"
#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/simulation.h"

namespace {

using namespace youbot_base_sim;
using namespace youbot_base_sim::bench;

/// Any method of Simulation.
Run run_simulation(const Task& task) {
  Simulation simulation(task.scene);
  Run run;
  for (const double t : task.times) {
    simulation.advance_to(t);
    if (!simulation.state().values.allFinite()) throw RunFailure(fmt::format("not finite at t = {} s", t));
    if (task.is_spent(simulation.statistics())) throw RunFailure(fmt::format("too much work by t = {} s", t));
    run.rows.push_back(simulation.state());
  }
  run.statistics = simulation.statistics();
  return run;
}

/// All solvers by their names: those of SUNDIALS, and every method of the scenes' `solver`.
std::map<std::string, Solver> solvers() {
  std::map<std::string, Solver> all = sundials_solvers();
  for (const Method& method : methods()) all[method.name] = run_simulation;
  return all;
}

/// What the solvers were built with and for; SUNDIALS itself comes from the system.
nlohmann::json about() {
  nlohmann::json json;
  for (const auto& [name, solver] : solvers()) json["solvers"].push_back(name);
  json["compiler"] = "g++ " __VERSION__;
  json["flags"] = YOUBOT_BASE_SIM_BENCH_FLAGS;
  json["libraries"] =
      fmt::format("Boost {}.{}, SUNDIALS {}", BOOST_VERSION / 100000, BOOST_VERSION / 100 % 1000, SUNDIALS_VERSION);
  return json;
}

/// Run time is the least of the repeats.
nlohmann::json measure(Solver solver, const Task& task) {
  constexpr double kLong = 1, kEnough = 1;  // s: of a run that is not repeated, and of all runs
  constexpr int kMinRepeats = 3, kMaxRepeats = 10;
  double least = std::numeric_limits<double>::infinity(), total = 0;
  std::clock_t start = 0;
  const auto taken = [&] { return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC; };
  int repeats = 0;
  Run run;
  try {
    do {
      start = std::clock();
      run = solver(task);
      const double run_time = taken();
      total += run_time;
      least = std::min(least, run_time);
      ++repeats;
    } while (least < kLong && (repeats < kMinRepeats || (total < kEnough && repeats < kMaxRepeats)));
  } catch (const RunFailure& failure) {
    return {{"failure", failure.what()}, {"run_time", taken()}};
  }
  nlohmann::json counts;
  for (const StatisticsField& field : kStatisticsFields) counts[field.name] = run.statistics.*field.value;
  counts["jacobians"] = run.jacobians;
  return {{"rows", run.rows}, {"run_time", least}, {"repeats", repeats}, {"counts", counts}};
}

}  // namespace

int main(int argc, char** argv) {
  namespace po = boost::program_options;
  std::string path, name;
  SceneOverrides overrides;
  Task task;
  double span = 0, rate = 20, step = 0;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("scene", po::value(&path)->required(), "scene file")
    ("solver", po::value(&name)->required(), "name of the solver")
    ("tolerance", po::value(&overrides.relative_tolerance), "relative, in place of the scene's")
    ("step", po::value(&step), "s, of a method with fixed steps")
    ("model", po::value(&overrides.model), "viscous or coulomb, in place of the scene's")
    ("span", po::value(&span), "s to simulate; the scene's duration unless given")
    ("rate", po::value(&rate), "rows a second")
    ("max-evaluations", po::value(&task.max_evaluations), "of the right-hand side, after which to give up")
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
    const auto all = solvers();
    if (!all.count(name)) throw SceneError(fmt::format("--solver = {}: must be one of those that --list prints", name));
    task.scene = load_scene(path, overrides);
    task.scene.solver.method = name;
    task.scene.solver.step = step;
    const double end = span > 0 ? std::min(span, task.scene.duration) : task.scene.duration;
    for (int k = 0; k <= end * rate * (1 + 1e-12); ++k) task.times.push_back(k / rate);
    std::cout << measure(all.at(name), task).dump() << '\n';
  } catch (const std::exception& error) {
    fmt::print(stderr, "solve: {}\n", error.what());
    return 2;
  }
  return 0;
}
