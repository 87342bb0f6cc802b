// Simulates a scene offline and writes what was asked for; needs no ROS master.

#include <fmt/format.h>
#include <unistd.h>

#include <boost/program_options.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <vector>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/record/csv.h"
#include "youbot_base_sim/record/summary.h"
#ifdef YOUBOT_BASE_SIM_ROS
#include "youbot_base_sim/ros/bag.h"
#endif

namespace {

using namespace youbot_base_sim;
using Clock = std::chrono::steady_clock;

enum ExitStatus { kDone = 0, kNotCompleted = 1, kRefused = 2 };

struct Arguments {
  std::string scene;
  SceneOverrides overrides;
  std::string csv, switches, bag, summary;
  double cpu_limit = 0;  // s; 0: none
  bool quiet = false;
};

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// What --help says of the methods.
std::string method_help() {
  std::string text = "how to integrate, in place of the scene's solver.method:";
  for (const Method& method : methods()) text += fmt::format("\n{}: {}", method.name, method.description);
  return text;
}

/// Reads the command line; false if all that was wanted was help. Throws boost::program_options::error or SceneError.
bool read_arguments(int argc, char** argv, Arguments& arguments) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("csv", po::value(&arguments.csv)->value_name("FILE"), "write the motion, a row each 1/output_rate")
    ("switches", po::value(&arguments.switches)->value_name("FILE"), "write the roller switches as CSV")
    ("bag", po::value(&arguments.bag)->value_name("FILE"), "write a bag with the topics of base_node")
    ("summary", po::value(&arguments.summary)->value_name("FILE"), "write the final state and statistics as JSON")
    ("model", po::value(&arguments.overrides.model)->value_name("NAME"),
     "no_slip, viscous or coulomb, in place of the scene's")
    ("method", po::value(&arguments.overrides.method)->value_name("NAME"), method_help().c_str())
    ("relative-tolerance", po::value(&arguments.overrides.relative_tolerance)->value_name("X"),
     "in place of the scene's, 1e-14 to 0.1; the default, 3e-7, keeps the paper's Cases 1 and 2 within 1e-5 m and "
     "1e-5 rad of the exact motion over 30 s")
    ("cpu-limit", po::value(&arguments.cpu_limit)->value_name("SECONDS"),
     "stop at the first row after this much processor time; writes the summary alone and exits with status 1")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors")
    ("help", "print this");
  // clang-format on
  po::options_description all;
  all.add(options).add_options()("scene", po::value(&arguments.scene));
  po::positional_options_description positional;
  positional.add("scene", 1);
  po::variables_map given;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), given);
  po::notify(given);
  if (given.count("help")) {
    std::cout << "Usage: simulate SCENE.yaml [options]\n\nSimulates the scene and writes what is asked for.\n\n"
              << options << "\nExit status: 0 done, 2 refused input, 1 the run could not be completed.\n";
    return false;
  }
  if (arguments.scene.empty()) throw SceneError("no scene given; usage: simulate SCENE.yaml [options]");
  const double tolerance = arguments.overrides.relative_tolerance;
  if (given.count("relative-tolerance") && !(tolerance >= 1e-14 && tolerance <= 0.1)) {
    throw SceneError(fmt::format("--relative-tolerance = {}: must be a number from 1e-14 to 0.1", tolerance));
  }
  if (given.count("cpu-limit") && !(arguments.cpu_limit > 0)) {
    throw SceneError(fmt::format("--cpu-limit = {}: must be a number > 0", arguments.cpu_limit));
  }
#ifndef YOUBOT_BASE_SIM_ROS
  if (!arguments.bag.empty()) throw SceneError("--bag: this simulate was built without ROS");
#endif
  return true;
}

/// A bar on the terminal for a run that takes longer than a second.
class Progress {
 public:
  Progress(double duration, bool quiet) : duration_(duration), shown_(!quiet && isatty(STDERR_FILENO)) {}
  ~Progress() {
    if (drawn_) std::fputs("\r\033[K", stderr);
  }
  void show(double t) {
    if (!shown_ || seconds_since(start_) < 1 || seconds_since(last_) < 0.1) return;
    constexpr int kWidth = 40;
    const int filled = static_cast<int>(kWidth * t / duration_);
    fmt::print(stderr, "\r[{:<{}}] {:.4g} of {:g} s", std::string(static_cast<std::size_t>(filled), '#'), kWidth, t,
               duration_);
    std::fflush(stderr);
    last_ = Clock::now();
    drawn_ = true;
  }

 private:
  double duration_;
  bool shown_;
  bool drawn_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_ = start_;
};

/// Everything that a run writes; complete files appear when it is committed.
class Outputs {
 public:
  explicit Outputs(const Arguments& arguments) {
    if (!arguments.csv.empty()) recorders_.push_back(std::make_unique<StateCsv>(arguments.csv));
    if (!arguments.switches.empty()) recorders_.push_back(std::make_unique<SwitchCsv>(arguments.switches));
#ifdef YOUBOT_BASE_SIM_ROS
    if (!arguments.bag.empty()) recorders_.push_back(std::make_unique<BagRecorder>(arguments.bag));
#endif
    if (!arguments.summary.empty()) summary_ = std::make_unique<AtomicFile>(arguments.summary);
  }

  void write_row(double t, Simulation& simulation) {
    const std::vector<RollerSwitch> switches = simulation.take_switches();
    for (const auto& recorder : recorders_) recorder->write(t, simulation, switches);
  }

  void commit() {
    for (const auto& recorder : recorders_) recorder->commit();
  }

  void commit_summary(const Simulation& simulation, double wall_time, const RunAudit& audit) {
    if (!summary_) return;
    summary_->write(summary_json(simulation, wall_time, audit));
    summary_->commit();
  }

 private:
  std::vector<std::unique_ptr<Recorder>> recorders_;
  std::unique_ptr<AtomicFile> summary_;
};

void run(const Arguments& arguments, const Scene& scene) {
  const std::string told =
      advice(scene.robot, scene.floor, scene.model, integration_settings(scene.solver), scene.duration);
  for (const std::string& warning : {doubts(scene.robot), told}) {
    if (!arguments.quiet && !warning.empty()) fmt::print(stderr, "simulate: {}\n", warning);
  }
  Outputs outputs(arguments);
  Progress progress(scene.duration, arguments.quiet);
  Simulation simulation(scene);
  double wall_time = 0;  // of the simulation alone
  RunAudit audit;
  const bool audited = !arguments.summary.empty() || arguments.cpu_limit > 0;
  const auto advance = [&](double t) {
    if (audited) audit.cost.start(simulation.time());
    const Clock::time_point start = Clock::now();
    simulation.advance_to(t);
    wall_time += seconds_since(start);
    if (audited) audit.cost.stop(simulation.time());
    if (!simulation.state().values.allFinite()) {
      throw std::runtime_error(fmt::format("the state is no longer finite at t = {} s", t));
    }
    outputs.write_row(t, simulation);
    if (audited) audit.add_row(simulation);
    if (arguments.cpu_limit > 0 && audit.cost.cpu_time() > arguments.cpu_limit && t < scene.duration) {
      outputs.commit_summary(simulation, wall_time, audit);
      throw std::runtime_error(
          fmt::format("stopped at t = {} s: more than {} s of processor time", t, arguments.cpu_limit));
    }
    progress.show(t);
  };
  outputs.write_row(0, simulation);
  if (audited) audit.add_row(simulation);
  // Rows at k / output_rate, and one at the end; the last of the first kind may be the end but for rounding.
  for (std::int64_t k = 1;; ++k) {
    const double t = static_cast<double>(k) / scene.output_rate;
    if (t >= scene.duration * (1 - 1e-12)) break;
    advance(t);
  }
  advance(scene.duration);
  audit.completed = true;
  outputs.commit();
  outputs.commit_summary(simulation, wall_time, audit);
  if (!arguments.quiet) fmt::print("{}", summary_text(simulation, wall_time));
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  Scene scene;
  try {
    if (!read_arguments(argc, argv, arguments)) return kDone;
    scene = load_scene(arguments.scene, arguments.overrides);
    if (std::holds_alternative<std::monostate>(scene.drive)) {
      throw SceneError(fmt::format("{}: drive is left out; simulate needs one", arguments.scene));
    }
  } catch (const boost::program_options::error& error) {
    fmt::print(stderr, "simulate: {}; see simulate --help\n", error.what());
    return kRefused;
  } catch (const SceneError& error) {
    fmt::print(stderr, "simulate: {}\n", error.what());
    return kRefused;
  }
  try {
    run(arguments, scene);
  } catch (const std::exception& error) {
    fmt::print(stderr, "simulate: {}\n", error.what());
    return kNotCompleted;
  }
  return kDone;
}
