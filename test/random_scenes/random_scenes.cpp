// Simulates random scenes, judges each by the same motion at a tight tolerance, and counts what comes of them.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/program_options.hpp>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "../temporary_folder.h"
#include "scene_generator.h"
#include "verdict.h"
#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/text/command_line.h"

namespace {

using namespace youbot_base_sim;

constexpr std::array<const char*, 7> kWords = {
    "right", "unreliable, though right", "unreliable", "sensitive", "undecided", "wrong", "failed"};

constexpr std::uint32_t kJudgedAnotherWay = 100;  // of so many scenes one is judged by rosenbrock4
constexpr double kDoubtedShare = 0.01;            // of all scenes, may be called unreliable though they are right

struct Arguments {
  std::uint64_t count = 0, first = 1;
  double tolerance = 0;  // 0: the scenes' own
  std::string folder;
};

const Usage kUsage = {
    "random_scenes N [options]",
    "Simulates N random scenes and judges each by the same motion at 1e-10, one of 100 by another method.",
    "\nExit status: 0 none is wrong, none by radau slower than real time, and at most 1 % are called unreliable though "
    "right, 2 rejected input, 1 otherwise.\n",
    "  random_scenes 1000 --seed 5001 --folder /tmp/found\n"
    "  random_scenes 1 --seed 5342    # scene 5342 alone\n"};

bool prepare(int argc, char** argv, Arguments& arguments) {
  namespace po = boost::program_options;
  std::string count, seed, tolerance;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("seed", po::value(&seed)->value_name("S"), "the number of the first scene; 1 unless given")
    ("tolerance", po::value(&tolerance)->value_name("T"), "relative tolerance in place of the scenes' own")
    ("folder", po::value(&arguments.folder)->value_name("FOLDER"), "keep the scenes that are not right here");
  // clang-format on
  if (!parse(argc, argv, kUsage, options, {"N", po::value(&count), 1, true})) return false;
  arguments.count = whole_number_of("N", count, 1, 1000000000);
  if (!seed.empty()) arguments.first = whole_number_of("--seed", seed, 0, 3000000000);
  if (!tolerance.empty()) {
    arguments.tolerance = number_of("--tolerance", tolerance, {1e-10, kRelativeTolerances.max, ""});
  }
  return true;
}

/// What came of the scenes so far.
struct Counts {
  std::array<std::uint64_t, kWords.size()> outcomes{};
  std::uint64_t refused = 0, badly_refused = 0;
  std::uint64_t slow = 0, slow_by_others = 0;  // slower than real time, by radau or another method
  double simulated = 0, cpu_time = 0;          // s
};

class RandomScenes {
 public:
  explicit RandomScenes(const Arguments& arguments)
      : arguments_(arguments), folder_(arguments.folder.empty() ? scratch_.path("") : arguments.folder) {
    std::filesystem::create_directories(folder_);
  }

  int run() {
    for (std::uint64_t k = 0; k < arguments_.count; ++k) {
      if (stop_requested()) throw std::runtime_error(fmt::format("stopped by {} after {} scenes", stop_reason(), k));
      try_scene(static_cast<std::uint32_t>(arguments_.first + k));
    }
    for (std::size_t k = 0; k < kWords.size(); ++k) fmt::print("{:>7}  {}\n", counts_.outcomes[k], kWords[k]);
    fmt::print("{:>7}  refused\n{:>7}  refused badly\n", counts_.refused, counts_.badly_refused);
    fmt::print("{:>7}  slower than real time by radau\n{:>7}  by other methods\n", counts_.slow,
               counts_.slow_by_others);
    fmt::print("{:.4g} s simulated in {:.3g} s of processor time\n", counts_.simulated, counts_.cpu_time);
    const bool good =
        outcome(Outcome::kWrong) + outcome(Outcome::kFailed) + counts_.badly_refused + counts_.slow == 0 &&
        static_cast<double>(outcome(Outcome::kDoubted)) <=
            kDoubtedShare * static_cast<double>(std::max<std::uint64_t>(arguments_.count, 100));
    return good ? kDone : kNotCompleted;
  }

 private:
  std::uint64_t outcome(Outcome which) const { return counts_.outcomes[static_cast<std::size_t>(which)]; }

  void try_scene(std::uint32_t number) {
    const std::string name = fmt::format("random_{}", number);
    const std::filesystem::path path = folder_ / (name + ".yaml"), table = folder_ / (name + ".csv");
    const RandomScene made = random_scene_file(number, table.filename());
    std::ofstream(path) << made.text;
    if (!made.table.empty()) std::ofstream(table) << made.table;
    const std::string finding = finding_of(path, number % kJudgedAnotherWay == 0);
    if (!finding.empty()) fmt::print("{}: {}\n", number, finding);
    std::fflush(stdout);
    if (!finding.empty() && !arguments_.folder.empty()) {
      std::ofstream(path) << "# " << finding << "\n" << made.text;
      return;
    }
    std::filesystem::remove(path);
    std::filesystem::remove(table);
  }

  /// What is worth a look, in a line; empty for a scene that is right or well refused.
  std::string finding_of(const std::string& path, bool another_way) {
    Scene scene;
    try {
      scene = load_scene(path);
    } catch (const SceneError& error) {
      ++counts_.refused;
      if (is_one_clear_line(error.what())) return "";
      ++counts_.badly_refused;
      return fmt::format("badly refused: {}", error.what());
    }
    if (arguments_.tolerance > 0) {
      scene.solver.relative_tolerance = arguments_.tolerance;
      scene.solver.absolute_tolerance = 1e-3 * arguments_.tolerance;
    }
    const bool possible = scene.floor.nu >= 1e-6 &&  // its work is unbounded below
                          refusal(*find_method("rosenbrock4"), scene.robot, scene.model).empty();
    const Verdict verdict = judge(scene, another_way && possible ? "rosenbrock4" : "radau");
    ++counts_.outcomes[static_cast<std::size_t>(verdict.outcome)];
    counts_.simulated += scene.duration;
    counts_.cpu_time += verdict.cpu_time;
    const bool slow = verdict.cpu_time > scene.duration;
    if (slow) ++(scene.solver.method == "radau" ? counts_.slow : counts_.slow_by_others);
    if (verdict.outcome == Outcome::kRight && !slow) return "";
    return fmt::format("{}{}: {} by {}: {:.2g} m off, {:.2g} m allowed; {:.3g} s of processor time for {:.3g} s{}{}",
                       slow ? "slower than real time, " : "", kWords[static_cast<std::size_t>(verdict.outcome)],
                       name_of(scene.model), scene.solver.method, verdict.error, verdict.allowed, verdict.cpu_time,
                       scene.duration, verdict.reason.empty() ? "" : "; ", verdict.reason);
  }

  static bool is_one_clear_line(const std::string& message) {
    const auto is_control = [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; };
    return message.find("must be") != std::string::npos && message.size() < 1000 &&
           std::none_of(message.begin(), message.end(), is_control);
  }

  const Arguments& arguments_;
  const TemporaryFolder scratch_;
  const std::filesystem::path folder_;
  Counts counts_;
};

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  return run_offline_program(
      "random_scenes", [&] { return prepare(argc, argv, arguments); }, [&] { return RandomScenes(arguments).run(); });
}
