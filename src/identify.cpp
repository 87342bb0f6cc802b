// Fits a scene's robot and motors to bags of a real base.

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <filesystem>
#include <optional>
#include <thread>

#include "youbot_base_sim/identify/bag_reader.h"
#include "youbot_base_sim/identify/fit.h"
#include "youbot_base_sim/identify/report.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/text/command_line.h"
#include "youbot_base_sim/text/print_error.h"
#include "youbot_base_sim/text/progress_bar.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;

struct Arguments {
  std::vector<std::string> bags;
  std::string scene, output, csv;
  bool quiet = false;
};

const Usage kUsage = {
    "identify BAG.. [options]",
    "Fits robot and motors of a scene to bags with joint_states, with effort, and cmd_vel or velocity_command.",
    "\nExit status: 0 done, 2 rejected input, 1 the fit could not be completed.\n",
    "  identify drive.bag --output fitted.yaml\n"
    "  identify first.bag second.bag --scene my_scene.yaml --csv comparison.csv\n"};

Scene start_scene(const std::string& path) {
  Scene scene = path.empty() ? Scene() : load_scene(path);
  if (path.empty()) scene.robot = measured_robot();
  scene.drive = std::monostate();
  if (!scene.motors) scene.motors.emplace();
  return scene;
}

/// The fitted scene, the commands of the record beside it, and rows to draw.
struct Outputs {
  std::optional<OutputFile> scene, table, csv;
};

/// The table that stands beside the scene.
std::filesystem::path table_of(const Arguments& arguments) {
  return std::filesystem::path(arguments.output).replace_extension(".csv");
}

/// Throws OutputError.
Outputs open_outputs(const Arguments& arguments, const Scene& start) {
  std::vector<std::string> inputs = arguments.bags;
  inputs.insert(inputs.end(), start.files.begin(), start.files.end());
  OutputOpener opener(inputs);
  Outputs outputs;
  if (!arguments.output.empty()) {
    outputs.scene.emplace(opener.open("--output", arguments.output));
    outputs.table.emplace(opener.open("the table beside --output", table_of(arguments)));
  }
  if (!arguments.csv.empty()) outputs.csv.emplace(opener.open("--csv", arguments.csv));
  return outputs;
}

void write(OutputFile& file, const std::string& text) {
  file.write(text);
  file.commit();
}

/// Reads the command line and the scene, and opens the outputs, so that what is refused is refused before minutes have
/// gone by. Returns false if all that was wanted was help. Throws std::runtime_error.
bool prepare(int argc, char** argv, Arguments& arguments, Scene& start) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("scene", po::value(&arguments.scene)->value_name("START.yaml"),
     "robot, floor and motors to start from; left out: the profile `measured`")
    ("output,o", po::value(&arguments.output)->value_name("FITTED.yaml"),
     "write the fitted scene, and beside it the commands as FITTED.csv")
    ("csv", po::value(&arguments.csv)->value_name("FILE"), "write the first bag's motion, recorded and fitted, for scripts/plot_identification")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors");
  // clang-format on
  if (!parse(argc, argv, kUsage, options, {"bag", po::value(&arguments.bags), -1, true})) return false;
  start = start_scene(arguments.scene);
  open_outputs(arguments, start);
  return true;
}

/// Fits, and writes what was fitted. Returns the exit status.
int run(const Arguments& arguments, const Scene& start) {
  try {
    std::vector<DriveRecord> records;
    std::vector<std::string> findings;
    for (const std::string& bag : arguments.bags) {
      records.push_back(read_drive_bag(bag));
      for (const std::string& line : inspect(records.back())) findings.push_back(line);
    }
    FitSettings settings;
    settings.workers = {static_cast<int>(std::thread::hardware_concurrency()), &stop_requested()};
    ProgressBar progress(arguments.quiet);
    settings.progress = [&](double share) {
      share < 1 ? progress.draw(share, fmt::format("{:.0f} %", 100 * share)) : progress.clear();
    };
    const Fit result = fit(start, records, findings, settings);
    if (!arguments.quiet) {
      for (const std::string& line : findings) fmt::print("{}\n", line);
      fmt::print("{}", report(start, result));
    }
    Outputs outputs = open_outputs(arguments, start);
    const DriveRecord& first = records.front();
    if (outputs.table) write(*outputs.table, command_table(first));
    if (outputs.scene)
      write(*outputs.scene, fitted_scene(arguments.scene, result, first, table_of(arguments).filename()));
    if (outputs.csv) write(*outputs.csv, comparison_csv(result, first));
    return kDone;
  } catch (const UnusableRecord& error) {
    print_error("identify", error.what());
    return kRefused;
  } catch (const Stopped&) {
    throw std::runtime_error("stopped by " + stop_reason());
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  Scene start;
  return run_offline_program(
      "identify", [&] { return prepare(argc, argv, arguments, start); }, [&] { return run(arguments, start); });
}
