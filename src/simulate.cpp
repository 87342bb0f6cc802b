// Simulates a scene offline and writes what was asked for; needs no ROS master. Compiled twice: `simulate` has no
// library of ROS, whose loading takes longer than many a run. With --bag it continues as `simulate_bag`, which has
// them.

#include <fmt/format.h>
#include <unistd.h>

#include <boost/program_options.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/offline/summary.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/record/recorder.h"
#ifdef YOUBOT_BASE_SIM_BAG
#include "youbot_base_sim/ros/bag.h"
#endif
#include "youbot_base_sim/text/command_line.h"
#include "youbot_base_sim/text/progress_bar.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;
using Clock = std::chrono::steady_clock;

constexpr Range kCpuLimits{1e-9, 1e9, "s"};

struct Arguments {
  std::string scene;
  SceneSettings settings;  // in place of the scene's
  std::string csv, switches, bag, summary;
  double cpu_limit = 0;  // s; 0: none
  bool print_scene = false;
  bool contacts = false;
  bool csv_comment = false;
  bool check = false;
  bool quiet = false, verbose = false;
};

/// The part of --help about the methods.
std::string method_help() {
  std::string text = "how to integrate, in place of the scene's solver.method:";
  for (const Method& method : methods()) text += fmt::format("\n{}: {}", method.name, method.description);
  return text;
}

const Usage kUsage = {"simulate SCENE.yaml [options]",
                      "Simulates the scene, or --scene SCENE.yaml, and writes the files that the options name.",
                      "\nA FILE appears when it is complete. A run that fails or is stopped leaves FILE.incomplete-*.\n"
                      "Exit status: 0 done, 2 rejected input, 1 the run could not be completed.\n",
                      "  simulate case2.yaml --csv case2.csv --summary case2.json\n"
                      "  simulate my_scene.yaml --bag my_scene.bag --contacts --quiet\n"};

/// Reads the command line and the scene; false if it only asks for help. Throws std::runtime_error.
bool prepare(int argc, char** argv, Arguments& arguments, Scene& scene) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  std::string tolerance, cpu_limit;
  const auto setting = [&](const char* key) {
    return po::value<std::string>()->value_name("NAME")->notifier(
        [&, key](const std::string& name) { arguments.settings.emplace_back(key, name, true); });
  };
  // clang-format off
  options.add_options()
    ("csv", po::value(&arguments.csv)->value_name("FILE"), "write the motion as CSV, one row per 1/output_rate")
    ("switches", po::value(&arguments.switches)->value_name("FILE"), "write the roller switches as CSV")
    ("bag", po::value(&arguments.bag)->value_name("FILE"), "write a bag with the topics of base_node")
    ("csv-comment", po::bool_switch(&arguments.csv_comment),
     "begin CSV files with a comment: # youbot_base_sim VERSION, scene HASH")
    ("contacts", po::bool_switch(&arguments.contacts),
     "write the topic contacts to the bag too, as output.contacts: true in the scene does")
    ("summary", po::value(&arguments.summary)->value_name("FILE"), "write the final state and statistics as JSON")
    ("model", setting("model"), "no_slip, viscous or coulomb, in place of the scene's")
    ("method", setting("solver.method"), method_help().c_str())
    ("relative-tolerance", po::value(&tolerance)->value_name("X"),
     "in place of the scene's, 1e-14 to 0.1; the default, 3e-7, keeps the paper's Cases 1 and 2 within 1e-5 m and "
     "1e-5 rad of the exact motion over 30 s")
    ("cpu-limit", po::value(&cpu_limit)->value_name("SECONDS"),
     "stop at the first row after this much processor time; writes the summary, keeps the rest as FILE.incomplete-*, "
     "and exits with status 1")
    ("print-scene", po::bool_switch(&arguments.print_scene),
     "print the scene with all defaults and the options above, below the comment of --csv-comment; simulate nothing")
    ("check", po::bool_switch(&arguments.check),
     "also run a twin at half the tolerance, with wheels and twist 1e-9 off at the start. The summary has the "
     "difference as an error bar; if the tolerance promises less, the result is unreliable. Takes 2.2 times as long; "
     "--cpu-limit does not count the twin")
    ("verbose", po::bool_switch(&arguments.verbose), "also print the counters of the integration")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors and warnings of an unreliable result");
  // clang-format on
  if (!parse(argc, argv, kUsage, options, {"scene", po::value(&arguments.scene), 1, true})) return false;
  if (!tolerance.empty()) {
    arguments.settings.emplace_back("solver.relative_tolerance",
                                    number_of("--relative-tolerance", tolerance, kRelativeTolerances));
  }
  if (arguments.contacts) arguments.settings.emplace_back("output.contacts", "true");
  if (!cpu_limit.empty()) arguments.cpu_limit = number_of("--cpu-limit", cpu_limit, kCpuLimits);
  if (arguments.contacts && arguments.bag.empty()) throw SceneError("--contacts: must be given with --bag");
  if (arguments.print_scene && !(arguments.csv + arguments.switches + arguments.bag + arguments.summary).empty())
    throw SceneError("--print-scene: must be given without outputs: it simulates nothing");
#ifndef YOUBOT_BASE_SIM_BAG
  if (!arguments.bag.empty()) {
    execv(std::filesystem::read_symlink("/proc/self/exe").replace_filename("simulate_bag").c_str(), argv);
    throw SceneError("--bag: this simulate was built without ROS");
  }
#endif
  scene = load_scene(arguments.scene, arguments.settings);
  if (std::holds_alternative<std::monostate>(scene.drive))
    throw SceneError(fmt::format("{}: drive is left out; simulate needs one", quote_path(arguments.scene)));
  return true;
}

/// The files that a run writes. One that fails, as on a full disk, ends alone; the others continue.
class Outputs {
 public:
  /// Opens them all before anything is written. Throws OutputError.
  Outputs(const Arguments& arguments, const Scene& scene, ProgressBar& progress) : progress_(progress) {
    OutputOpener opener(scene.files);
    const auto open = [&](const char* option, const std::string& path, auto make_recorder,
                          OutputFile::Access access = OutputFile::Access::kInOrder) {
      if (path.empty()) return;
      OutputFile file = opener.open(option, path, access);
      if (file.is_terminal()) progress.hide();
      recorders_.push_back(make_recorder(std::move(file)));
    };
    const std::string comment = arguments.csv_comment ? provenance(scene) : "";
    open("--csv", arguments.csv, [&](OutputFile file) { return state_csv(std::move(file), comment); });
    open("--switches", arguments.switches, [&](OutputFile file) { return switch_csv(std::move(file), comment); });
#ifdef YOUBOT_BASE_SIM_BAG
    open("--bag", arguments.bag, bag_recorder, OutputFile::Access::kAnywhere);
#endif
    if (!arguments.summary.empty()) summary_.emplace(opener.open("--summary", arguments.summary));
  }

  void write_row(double t, Simulation& simulation) {
    const Events events = simulation.take_events();
    for_each([&](Recorder& recorder) { recorder.write(t, simulation, events); });
  }

  void commit() {
    for_each([](Recorder& recorder) { recorder.commit(); });
  }

  /// Ends all early. Returns the names under which they are kept.
  std::vector<std::string> keep_incomplete() {
    std::vector<std::string> names;
    for (const auto& recorder : recorders_) {
      std::string name = recorder->keep_incomplete();
      if (!name.empty()) names.push_back(std::move(name));
    }
    return names;
  }

  bool failed() const { return failed_; }  ///< one of them
  std::optional<OutputFile>& summary() { return summary_; }

 private:
  template <class Action>
  void for_each(const Action& action) {
    for (auto recorder = recorders_.begin(); recorder != recorders_.end();) {
      try {
        action(**recorder);
        ++recorder;
      } catch (const OutputError& error) {
        if (error.is_interrupted()) throw;
        failed_ = true;
        recorder = recorders_.erase(recorder);
        if (recorders_.empty() && !summary_) throw;  // no output is left
        progress_.clear();
        print_error("simulate", error.what());
      }
    }
  }

  ProgressBar& progress_;
  std::vector<std::unique_ptr<Recorder>> recorders_;
  std::optional<OutputFile> summary_;
  bool failed_ = false;
};

/// A scene on its way from row to row.
class Run {
 public:
  Run(const Arguments& arguments, const Scene& scene, Outputs& outputs, ProgressBar& progress)
      : arguments_(arguments),
        outputs_(outputs),
        simulation_(scene),
        rows_(simulation_),
        progress_(progress),
        measured_(!arguments.summary.empty() || arguments.cpu_limit > 0) {
    simulation_.stop_on(stop_requested());
    if (!arguments.check) return;
    twin_ = std::make_unique<Twin>(scene);
    twin_->stop_on(stop_requested());
  }

  /// Writes and commits all outputs, prints summary and warnings. Throws and keeps incomplete outputs if it ends early.
  void complete() {
    const auto stopped = [&] {
      return fmt::format("stopped after t = {:g} s by {}", simulation_.time(), stop_reason());
    };
    try {
      write_rows();
      progress_.clear();
      outputs_.commit();
      commit_summary(true);
    } catch (const Stopped&) {
      fail(stopped());
    } catch (const OutputError& error) {
      fail(error.is_interrupted() ? stopped() : error.what());
    } catch (const std::exception& error) {
      fail(error.what());
    }
    if (!arguments_.quiet)
      fmt::print("{}", summary_text(simulation_, wall_time_, rows_, twin_.get(), arguments_.verbose));
    const std::string doubt = unreliability_reason(simulation_, rows_, twin_.get());
    if (!doubt.empty()) print_error("simulate", "warning: the result is unreliable: " + doubt);
  }

 private:
  void write_rows() {
    try {
      while (next()) {
        if (twin_) twin_->follow(simulation_);
        write_row(rows_.t());
      }
    } catch (const TippedOver&) {
      commit_summary(false);  // it has the normal reactions
      throw;
    }
  }

  /// Advances to the next row and measures the time.
  bool next() {
    const double before = simulation_.time();
    if (measured_) cost_.start(before);
    const Clock::time_point start = Clock::now();
    const bool is_row = rows_.next();
    wall_time_ += std::chrono::duration<double>(Clock::now() - start).count();
    if (measured_ && simulation_.time() > before) cost_.stop(simulation_.time());
    return is_row;
  }

  void write_row(double t) {
    const double duration = simulation_.scene().duration;
    outputs_.write_row(t, simulation_);
    if (arguments_.cpu_limit > 0 && cost_.cpu_time() > arguments_.cpu_limit && t < duration) {
      commit_summary(false);
      throw std::runtime_error(
          fmt::format("stopped at t = {} s: more than {} s of processor time", t, arguments_.cpu_limit));
    }
    if (progress_.due()) progress_.draw(t / duration, fmt::format("{:.4g} of {:g} s", t, duration));
  }

  void commit_summary(bool completed) {
    if (!outputs_.summary()) return;
    outputs_.summary()->write(summary_json(simulation_, completed, wall_time_, cost_, rows_, twin_.get()));
    outputs_.summary()->commit();
  }

  [[noreturn]] void fail(const std::string& reason) {
    progress_.clear();
    const std::vector<std::string> kept = outputs_.keep_incomplete();
    if (kept.empty()) throw std::runtime_error(reason);
    throw std::runtime_error(fmt::format("{}; what was written is kept as {}", reason, fmt::join(kept, ", ")));
  }

  const Arguments& arguments_;
  Outputs& outputs_;
  Simulation simulation_;
  RowLoop rows_;
  std::unique_ptr<Twin> twin_;  // null without --check
  ProgressBar& progress_;
  bool measured_;
  double wall_time_ = 0;  // of the simulation alone, s
  RunCost cost_;
};

/// Returns the exit status.
int simulate(const Arguments& arguments, const Scene& scene) {
  if (arguments.print_scene) {
    fmt::print("{}{}", provenance(scene), scene.resolved);
    return kDone;
  }
  ProgressBar progress(arguments.quiet);
  std::optional<Outputs> outputs;
  try {
    outputs.emplace(arguments, scene, progress);
  } catch (const OutputError& error) {
    const bool stopped = error.is_interrupted();
    print_error("simulate", stopped ? fmt::format("stopped by {}; {}", stop_reason(), error.what()) : error.what());
    return stopped || error.is_full() ? kNotCompleted : kRefused;
  }
  for (const std::string& warning : arguments.quiet ? std::vector<std::string>() : warnings_of(scene)) {
    print_error("simulate", "warning: " + warning);
  }
  Run(arguments, scene, *outputs, progress).complete();
  return outputs->failed() ? kNotCompleted : kDone;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  Scene scene;
  return run_offline_program(
      "simulate", [&] { return prepare(argc, argv, arguments, scene); }, [&] { return simulate(arguments, scene); });
}
