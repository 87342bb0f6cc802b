// Fits a scene's robot and motors to tables of a real base's drives. scripts/identify makes such tables of bags.

#include <fmt/format.h>

#include <boost/program_options.hpp>
#include <filesystem>
#include <optional>
#include <thread>

#include "youbot_base_sim/identify/drive_table.h"
#include "youbot_base_sim/identify/encoder_fit.h"
#include "youbot_base_sim/identify/fit.h"
#include "youbot_base_sim/identify/report.h"
#include "youbot_base_sim/integration/motion_integrator.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/text/command_line.h"
#include "youbot_base_sim/text/progress_bar.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;

struct Arguments {
  std::vector<std::string> tables, names;
  std::string scene, output, csv;
  double resolution = 0;  // of encoders, rad; 0: unknown
  bool encoders = false, unknown_angles = false, quiet = false;
};

const Usage kUsage = {
    "identify_tables TABLE.. [options]",
    "Fits robot and motors of a scene to drives: tables in CSV with the columns t (s), phi_fl phi_fr phi_bl phi_br\n"
    "(rad), dphi_fl.. (rad/s), torque_fl.. (N m), command_fl.. (rad/s), x, y (m) and psi (rad). A row may leave cells\n"
    "empty. With --encoders it fits the robot alone, to phi and the pose. identify does the same with bags.",
    "\nExit status: 0 done, 2 rejected input, 1 the fit could not be completed.\n",
    "  identify_tables drive.csv --output fitted.yaml\n"
    "  identify_tables drive.csv --encoders --scene my_scene.yaml --ticks 2880 --output fitted.yaml\n"};

Scene start_scene(const std::string& path) {
  Scene scene = path.empty() ? Scene() : load_scene(path, {}, SceneUse::kCommands);
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
  std::vector<std::string> inputs = arguments.tables;
  inputs.insert(inputs.end(), arguments.names.begin(), arguments.names.end());
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

/// Reads command line and scene, and tries the outputs first. False for --help. Throws std::runtime_error.
bool prepare(int argc, char** argv, Arguments& arguments, Scene& start) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  std::string ticks;
  // clang-format off
  options.add_options()
    ("scene", po::value(&arguments.scene)->value_name("START.yaml"),
     "robot, floor and motors to start from; left out: the profile `measured`")
    ("output,o", po::value(&arguments.output)->value_name("FITTED.yaml"),
     "write the fitted scene, and beside it the commands as FITTED.csv")
    ("csv", po::value(&arguments.csv)->value_name("FILE"),
     "write the first drive's motion, recorded and fitted, for scripts/plot_identification")
    ("ticks", po::value(&ticks)->value_name("N"), "encoder ticks of a turn of the wheel, for the resolution of phi")
    ("name", po::value(&arguments.names)->value_name("NAME"), "how messages call each table; left out: its file")
    ("encoders", po::bool_switch(&arguments.encoders),
     "fit robot, clocks and initial wheel angles to positions and ground truth alone")
    ("unknown-angles", po::bool_switch(&arguments.unknown_angles),
     "with --encoders: average over all wheel angles, for slip_odometry without ~angles_at_zero")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors");
  // clang-format on
  if (!parse(argc, argv, kUsage, options, {"table", po::value(&arguments.tables), -1, true})) return false;
  if (!ticks.empty()) arguments.resolution = 2 * M_PI / number_of("--ticks", ticks, {1e-6, 1e9, ""});
  if (arguments.names.empty()) arguments.names = arguments.tables;
  if (arguments.names.size() != arguments.tables.size())
    throw OptionError("--name", arguments.names.back(), "be given once for each table");
  if (arguments.unknown_angles && !arguments.encoders)
    throw OptionError("--unknown-angles", "", "come with --encoders");
  if (arguments.encoders && !arguments.csv.empty())
    throw OptionError("--csv", arguments.csv, "be left out with --encoders");
  start = start_scene(arguments.scene);
  open_outputs(arguments, start);
  return true;
}

/// All records, inspected, and the findings in their tables.
std::vector<DriveRecord> read_records(const Arguments& arguments, std::vector<std::string>& findings) {
  std::vector<DriveRecord> records;
  for (std::size_t k = 0; k < arguments.tables.size(); ++k) {
    records.push_back(read_drive_table(arguments.tables[k], quote_path(arguments.names[k])));
    for (const std::string& line : arguments.encoders ? inspect_encoders(records[k]) : inspect(records[k]))
      findings.push_back(line);
  }
  return records;
}

/// Prints what was found and fitted, and writes scene and table. Returns the outputs, of which the CSV file is left.
template <class Result>
Outputs write_results(const Arguments& arguments, const Scene& start, const DriveRecord& first,
                      const std::vector<std::string>& findings, const std::string& report, const Result& result,
                      const std::string& table) {
  if (!arguments.quiet) {
    for (const std::string& line : findings) fmt::print("{}\n", line);
    fmt::print("{}", report);
  }
  Outputs outputs = open_outputs(arguments, start);
  if (outputs.table) write(*outputs.table, table);
  if (outputs.scene)
    write(*outputs.scene, fitted_scene(arguments.scene, result, first, table_of(arguments).filename()));
  return outputs;
}

/// Fits, and writes what was fitted. Returns the exit status.
int run(const std::string& program, const Arguments& arguments, const Scene& start) {
  try {
    std::vector<std::string> findings;
    std::vector<DriveRecord> records = read_records(arguments, findings);
    const DriveRecord& first = records.front();
    ProgressBar progress(arguments.quiet);
    FitSettings settings;
    settings.workers = {static_cast<int>(std::thread::hardware_concurrency()), &stop_requested()};
    settings.progress = [&](double share) {
      share < 1 ? progress.draw(share, fmt::format("{:.0f} %", 100 * share)) : progress.clear();
    };
    if (arguments.encoders) {
      const EncoderFit result =
          fit_encoders(start, records, {settings, arguments.resolution, !arguments.unknown_angles});
      write_results(arguments, start, first, findings, report(start, records, result), result, angle_table(first));
    } else {
      const Fit result = fit(start, records, findings, settings);
      Outputs outputs =
          write_results(arguments, start, first, findings, report(start, result), result, command_table(first));
      if (outputs.csv) write(*outputs.csv, comparison_csv(result, first));
    }
    return kDone;
  } catch (const UnusableRecord& error) {
    print_error(program, error.what());
    return kRefused;
  } catch (const Stopped&) {
    throw std::runtime_error("stopped by " + stop_reason());
  }
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  Scene start;
  const std::string program = std::filesystem::path(argv[0]).filename();  // identify's, where that has started it
  return run_offline_program(
      program.c_str(), [&] { return prepare(argc, argv, arguments, start); },
      [&] { return run(program, arguments, start); });
}
