// Runs the simulation where it is hard, and says what does not hold there.

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "stress_report.h"
#include "youbot_base_sim/record/atomic_file.h"
#include "youbot_base_sim/scene/scene.h"

namespace {

using namespace youbot_base_sim;

enum ExitStatus { kAllHolds = 0, kSomethingFails = 1, kRefused = 2 };

class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Arguments {
  std::string folder;
  std::set<std::string> only;
  std::vector<double> tolerances{1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
  bool list = false;
  bool quick = false;

  double longest() const { return quick ? 2 : 1e9; }  // s of simulated time
};

std::vector<double> read_tolerances(const std::string& text) {
  std::vector<double> tolerances;
  std::istringstream stream(text);
  for (std::string item; std::getline(stream, item, ',');) {
    char* end = nullptr;
    const double value = std::strtod(item.c_str(), &end);
    // A hundredth of the least one is run too, where a wheel is held.
    if (item.empty() || *end || !(value >= 1e-12 && value <= 0.1)) {
      throw Refusal(fmt::format("--tolerances = {}: must be numbers from 1e-12 to 0.1, with commas between", text));
    }
    tolerances.push_back(value);
  }
  if (tolerances.empty()) throw Refusal("--tolerances: must be numbers from 1e-12 to 0.1, with commas between");
  return tolerances;
}

/// Reads the command line; false if all that was wanted was help. Throws boost::program_options::error or Refusal.
bool read_arguments(int argc, char** argv, Arguments& arguments) {
  namespace po = boost::program_options;
  std::vector<std::string> only;
  std::string tolerances;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("only", po::value(&only)->value_name("GROUP[/CELL]")->composing(), "run this group or cell; may be repeated")
    ("tolerances", po::value(&tolerances)->value_name("X,..."), "relative tolerances; 1e-3 to 1e-10 unless given")
    ("quick", po::bool_switch(&arguments.quick), "a smoke test: few cells, 2 s each, at 1e-4 and 1e-7 unless given")
    ("list", po::bool_switch(&arguments.list), "print the names of the cells and run nothing")
    ("help", "print this");
  // clang-format on
  po::options_description all;
  all.add(options).add_options()("folder", po::value(&arguments.folder));
  po::positional_options_description positional;
  positional.add("folder", 1);
  po::variables_map given;
  po::store(po::command_line_parser(argc, argv).options(all).positional(positional).run(), given);
  po::notify(given);
  if (given.count("help")) {
    std::cout << "Usage: stress FOLDER [options]\n\nRuns hard motions and writes stress.csv, stress.md and the scenes "
                 "to FOLDER.\n\n"
              << options << "\nExit status: 0 all holds, 1 something does not, 2 refused input.\n";
    return false;
  }
  arguments.only = {only.begin(), only.end()};
  if (arguments.quick) arguments.tolerances = {1e-4, 1e-7};
  if (!tolerances.empty()) arguments.tolerances = read_tolerances(tolerances);
  if (!arguments.list && arguments.folder.empty()) throw Refusal("no folder given; usage: stress FOLDER [options]");
  return true;
}

std::vector<StressCell> chosen_cells(const Arguments& arguments) {
  std::vector<StressCell> chosen;
  std::set<std::string> unknown = arguments.only;
  for (const StressCell& cell : stress_cells(arguments.longest())) {
    const std::string full = cell.group + "/" + cell.name;
    unknown.erase(cell.group);
    unknown.erase(full);
    if (!arguments.only.empty() && !arguments.only.count(cell.group) && !arguments.only.count(full)) continue;
    if (!arguments.quick || cell.quick) chosen.push_back(cell);
  }
  if (!unknown.empty()) throw Refusal(fmt::format("--only = {}: must be a group or cell of --list", *unknown.begin()));
  if (chosen.empty()) throw Refusal("--quick: none of the chosen cells is part of it");
  return chosen;
}

void make_folder(const std::string& path) {
  for (std::size_t end = path.find('/', 1);; end = path.find('/', end + 1)) {
    const std::string part = path.substr(0, end);
    struct stat status;
    if (mkdir(part.c_str(), 0777) != 0 && (stat(part.c_str(), &status) != 0 || !S_ISDIR(status.st_mode))) {
      throw Refusal(fmt::format("folder = {}: cannot be made", part));
    }
    if (end == std::string::npos) return;
  }
}

void write_file(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

/// Writes the cell's scene into `folder` and returns the file's name.
std::string write_scene(const std::string& folder, const StressCell& cell) {
  const std::string stem = folder + "/" + cell.file_name();
  if (!cell.table.empty()) write_file(stem + ".csv", cell.table);
  write_file(stem + ".yaml", cell.scene);
  return stem + ".yaml";
}

/// One line on the terminal that says how far the suite has come.
class Progress {
 public:
  explicit Progress(std::size_t total) : total_(total), shown_(isatty(STDERR_FILENO)) {}
  ~Progress() {
    if (shown_) std::fputs("\r\033[K", stderr);
  }

  void show(const std::string& what, std::size_t failures) {
    ++count_;
    if (!shown_) return;
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - start_);
    fmt::print(stderr, "\r\033[K[{}/{}] {} s, {} failed: {}", count_, total_, seconds.count(), failures, what);
    std::fflush(stderr);
  }

 private:
  std::size_t total_;
  bool shown_;
  std::size_t count_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Runs all cells, one after the other, since they are timed.
std::vector<StressResult> run(const Arguments& arguments, const std::vector<StressCell>& cells) {
  const std::string folder = arguments.folder + "/scenes";
  make_folder(folder);
  const std::string base_scene = write_scene(folder, base_cell(arguments.longest()));
  Progress progress(cells.size() * arguments.tolerances.size());
  std::vector<StressResult> results;
  std::size_t failures = 0;
  std::map<double, BaseCost> base;
  const std::string* group = nullptr;
  for (const StressCell& cell : cells) {
    const std::string scene = write_scene(folder, cell);
    // The yardstick is taken anew for each group: the machine may be slower or faster by then.
    if (!group || *group != cell.group) base.clear();
    group = &cell.group;
    for (const double tolerance : arguments.tolerances) {
      progress.show(fmt::format("{}/{} at {:g}", cell.group, cell.name, tolerance), failures);
      if (!base.count(tolerance)) base[tolerance] = measure_base(base_scene, tolerance, arguments.quick ? 1 : 3);
      Wanted wanted;
      wanted.hundredth = cell.group == kRandomGroup && tolerance == SolverSettings().relative_tolerance;
      const Measurement m = measure(scene, tolerance, base[tolerance], wanted);
      results.push_back({&cell, tolerance, base[tolerance], m, judge(m, tolerance, base[tolerance])});
      failures += !results.back().verdict.holds();
    }
  }
  return results;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  try {
    if (!read_arguments(argc, argv, arguments)) return kAllHolds;
    const std::vector<StressCell> cells = chosen_cells(arguments);
    if (arguments.list) {
      for (const StressCell& cell : cells) fmt::print("{}/{}\n", cell.group, cell.name);
      return kAllHolds;
    }
    const std::vector<StressResult> results = run(arguments, cells);
    write_file(arguments.folder + "/stress.csv", csv(results));
    write_file(arguments.folder + "/stress.md", markdown(results));
    const auto holds = [](const StressResult& result) { return result.verdict.holds(); };
    const auto failed = std::count_if(results.begin(), results.end(), [&](const auto& r) { return !holds(r); });
    fmt::print("{} of {} runs hold all requirements; see {}/stress.md\n", results.size() - failed, results.size(),
               arguments.folder);
    return failed == 0 ? kAllHolds : kSomethingFails;
  } catch (const boost::program_options::error& error) {
    fmt::print(stderr, "stress: {}; see stress --help\n", error.what());
    return kRefused;
  } catch (const Refusal& error) {
    fmt::print(stderr, "stress: {}\n", error.what());
    return kRefused;
  } catch (const std::exception& error) {
    fmt::print(stderr, "stress: {}\n", error.what());
    return kSomethingFails;
  }
}
