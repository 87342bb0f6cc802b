// Runs one solver on one scene, repeats quick runs, and prints rows, counts and run time as JSON. Its argument is JSON
// too: scene (a file), model, solver, tolerance or step (s), span (s), rate (rows a second), and max_evaluations unless
// they are the usual. Without one it prints what it was built with. scripts/work_precision drives it.

#include <fmt/format.h>
#include <sundials/sundials_config.h>

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

Task read_task(const nlohmann::json& argument) {
  SceneOverrides overrides;
  overrides.model = argument.at("model");
  if (argument.contains("tolerance")) overrides.relative_tolerance = argument.at("tolerance").get<double>();
  Task task;
  task.scene = load_scene(argument.at("scene"), overrides);
  task.scene.solver.method = argument.at("solver");
  task.scene.solver.step = argument.value("step", 0.0);
  task.max_evaluations = argument.value("max_evaluations", task.max_evaluations);
  const double rate = argument.at("rate"), end = std::min(argument.at("span").get<double>(), task.scene.duration);
  for (int k = 0; k <= end * rate * (1 + 1e-12); ++k) task.times.push_back(k / rate);
  return task;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc == 1) {
    std::cout << about().dump() << '\n';
    return 0;
  }
  const Task task = read_task(nlohmann::json::parse(argv[1]));
  const auto all = solvers();
  const auto solver = all.find(task.scene.solver.method);
  if (solver == all.end())
    throw SceneError("solver = " + task.scene.solver.method + ": is none of those it is built with");
  std::cout << measure(solver->second, task).dump() << '\n';
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "solve: {}\n", error.what());
  return 2;
}
