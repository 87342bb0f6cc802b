// Fits a scene's robot and motors to bags of a real base.

#include <fmt/format.h>

#include <boost/algorithm/string/classification.hpp>
#include <boost/algorithm/string/split.hpp>
#include <boost/program_options.hpp>
#include <filesystem>
#include <optional>
#include <set>
#include <thread>

#include "youbot_base_sim/identify/bag_reader.h"
#include "youbot_base_sim/identify/encoder_fit.h"
#include "youbot_base_sim/identify/fit.h"
#include "youbot_base_sim/identify/ground_truth.h"
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
  BagNames names;
  double resolution = 0;  // of encoders, rad; 0: unknown
  bool encoders = false, unknown_angles = false, quiet = false;
};

const Usage kUsage = {
    "identify BAG.. [options]",
    "Fits robot and motors of a scene to bags with joint_states (with effort) and cmd_vel or velocity_command. With\n"
    "--encoders it fits the robot alone, to bags with positions in joint_states and ground truth.",
    "\nExit status: 0 done, 2 rejected input, 1 the fit could not be completed.\n",
    "  identify drive.bag --output fitted.yaml\n"
    "  identify first.bag second.bag --scene my_scene.yaml --csv comparison.csv\n"
    "  identify drive.bag --encoders --scene my_scene.yaml --ticks 2880 --output fitted.yaml\n"};

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

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  boost::split(parts, text, boost::is_any_of(","));
  return parts;
}

/// Texts that are empty were not given. Throws OptionError.
void read_names(const std::string& frames, const std::string& truth, const std::string& joints,
                const std::string& ticks, BagNames& names, double& resolution) {
  if (!frames.empty()) {
    const std::vector<std::string> parts = parts_of(frames);
    if (parts.size() != 2 || parts[0].empty() || parts[1].empty())
      throw OptionError("--frames", frames, "be FIXED,BODY, two frames");
    names.truth_frames = {parts[0], parts[1]};
  }
  if (!truth.empty() && truth != "base" && truth != "marker") throw OptionError("--truth", truth, "be base or marker");
  if (!truth.empty()) names.truth_of_marker = truth == "marker";
  if (!ticks.empty()) names.units *= resolution = 2 * M_PI / number_of("--ticks", ticks, {1e-6, 1e9, ""});
  if (joints.empty()) return;
  const std::vector<std::string> parts = parts_of(joints);
  std::set<std::string> different;
  for (std::size_t i = 0; i < parts.size() && i < kWheels; ++i) {
    const bool backward = !parts[i].empty() && parts[i][0] == '-';
    names.joints[i] = parts[i].substr(backward);
    if (backward) names.units[static_cast<Eigen::Index>(i)] *= -1;
    if (!names.joints[i].empty()) different.insert(names.joints[i]);
  }
  if (parts.size() != kWheels || different.size() != kWheels)
    throw OptionError("--joints", joints, "be four joints, fl, fr, bl and br, separated by commas");
}

/// Reads the command line and the scene, and opens the outputs, so that what is refused is refused before minutes have
/// gone by. Returns false if all that was wanted was help. Throws std::runtime_error.
bool prepare(int argc, char** argv, Arguments& arguments, Scene& start) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  std::string frames, truth, joints, ticks;
  // clang-format off
  options.add_options()
    ("scene", po::value(&arguments.scene)->value_name("START.yaml"),
     "robot, floor and motors to start from; left out: the profile `measured`")
    ("output,o", po::value(&arguments.output)->value_name("FITTED.yaml"),
     "write the fitted scene, and beside it the commands as FITTED.csv")
    ("csv", po::value(&arguments.csv)->value_name("FILE"),
     "write the first bag's motion, recorded and fitted, for scripts/plot_identification")
    ("truth-topic", po::value(&arguments.names.truth_topic)->value_name("TOPIC"),
     "ground truth; left out: ground_truth, base_pose_ground_truth or pose, in any namespace")
    ("frames", po::value(&frames)->value_name("FIXED,BODY"), "ground truth from the transforms between these frames")
    ("truth", po::value(&truth)->value_name("base|marker"),
     "whose pose it is: the base's own at the bag's clock, or a marker's, whose offset and clock are estimated; default: "
     "base for nav_msgs/Odometry and --frames, else marker")
    ("joints", po::value(&joints)->value_name("FL,FR,BL,BR"),
     "joints of the wheels in joint_states; -NAME counts backward: --joints=-a,b,-c,d")
    ("ticks", po::value(&ticks)->value_name("N"),
     "positions in joint_states are encoder ticks, N per turn of the wheel")
    ("encoders", po::bool_switch(&arguments.encoders),
     "fit robot, clocks and initial wheel angles to positions and ground truth alone")
    ("unknown-angles", po::bool_switch(&arguments.unknown_angles),
     "with --encoders: average over all wheel angles, for slip_odometry without ~angles_at_zero")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors");
  // clang-format on
  if (!parse(argc, argv, kUsage, options, {"bag", po::value(&arguments.bags), -1, true})) return false;
  read_names(frames, truth, joints, ticks, arguments.names, arguments.resolution);
  if (arguments.unknown_angles && !arguments.encoders)
    throw OptionError("--unknown-angles", "", "come with --encoders");
  if (arguments.encoders && !arguments.csv.empty())
    throw OptionError("--csv", arguments.csv, "be left out with --encoders");
  arguments.names.angles_alone = arguments.encoders;
  start = start_scene(arguments.scene);
  open_outputs(arguments, start);
  return true;
}

/// What was found in the bags, and all records, inspected.
std::vector<DriveRecord> read_records(const Arguments& arguments, const Scene& start,
                                      std::vector<std::string>& findings) {
  std::vector<DriveRecord> records;
  for (const std::string& bag : arguments.bags) {
    records.push_back(read_drive_bag(bag, arguments.names));
    DriveRecord& record = records.back();
    for (const std::string& line : arguments.encoders ? inspect_encoders(record) : inspect(record))
      findings.push_back(line);
    for (const std::string& line : prepare_ground_truth(record, start.robot)) findings.push_back(line);
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
int run(const Arguments& arguments, const Scene& start) {
  try {
    std::vector<std::string> findings;
    std::vector<DriveRecord> records = read_records(arguments, start, findings);
    const DriveRecord& first = records.front();
    ProgressBar progress(arguments.quiet);
    FitSettings settings;
    settings.workers = {static_cast<int>(std::thread::hardware_concurrency()), &stop_requested()};
    settings.progress = [&](double share) {
      share < 1 ? progress.draw(share, fmt::format("{:.0f} %", 100 * share)) : progress.clear();
    };
    if (arguments.encoders) {
      const EncoderFit result = fit_encoders(
          start, records, {arguments.resolution, !arguments.unknown_angles, settings.workers, settings.progress});
      write_results(arguments, start, first, findings, report(start, records, result), result, angle_table(first));
    } else {
      const Fit result = fit(start, records, findings, settings);
      Outputs outputs =
          write_results(arguments, start, first, findings, report(start, result), result, command_table(first));
      if (outputs.csv) write(*outputs.csv, comparison_csv(result, first));
    }
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
