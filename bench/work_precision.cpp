// Error against run time, of this package and of other solvers on the same equations.

#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <cstdio>
#include <filesystem>
#include <iostream>

#include "report.h"
#include "youbot_base_sim/record/atomic_file.h"

namespace {

using namespace youbot_base_sim;
using namespace youbot_base_sim::bench;

enum ExitStatus { kDone = 0, kNotCompleted = 1, kRefused = 2 };

struct Arguments {
  std::string output = ".";
  std::string scene, contestant;                          // empty: all
  double span = std::numeric_limits<double>::infinity();  // s
  bool quick = false;
  bool list = false;
};

constexpr double kExplicitSpan = 0.2;        // s of the scene that explicit methods run over
constexpr double kQuickSpan = 2.0;           // s of the scene that a quick look runs over
constexpr double kQuickExplicitSpan = 0.05;  // s

struct SubjectFile {
  const char *key, *title, *path, *model, *rows;
};

const SubjectFile kSubjects[] = {
    {"case1_ccw_coulomb", "Case 1 counter-clockwise, 2b", "config/scenes/case1_counter_clockwise.yaml", "coulomb",
     "case1_counter_clockwise_coulomb.csv"},
    {"case1_ccw_viscous", "Case 1 counter-clockwise, 2a", "config/scenes/case1_counter_clockwise.yaml", "viscous",
     "case1_counter_clockwise_viscous.csv"},
    {"case1_printed_coulomb", "Case 1 as printed, 2b", "config/scenes/case1_as_printed.yaml", "coulomb",
     "case1_as_printed_coulomb.csv"},
    {"case2_coulomb", "Case 2, 2b", "config/scenes/case2.yaml", "coulomb", "case2_coulomb.csv"},
    {"violent", "violent", "bench/scenes/violent.yaml", "", ""},
    {"held", "torque held over 1 ms", "bench/scenes/held.yaml", "", ""},
};

std::vector<Subject> subjects(const Arguments& arguments) {
  const std::string root = YOUBOT_BASE_SIM_SOURCE_DIR "/";
  std::vector<Subject> list;
  for (const SubjectFile& file : kSubjects) {
    if (!arguments.scene.empty() && arguments.scene != file.key) continue;
    if (arguments.quick && arguments.scene.empty() && !list.empty()) break;
    SceneOverrides overrides;
    overrides.model = file.model;
    list.push_back({file.key, file.title, load_scene(root + file.path, overrides),
                    *file.rows ? root + "test/data/reference/" + file.rows : ""});
  }
  return list;
}

/// Settings of a quick look: the second and, if there is one, the third.
void thin_out(std::vector<Contestant>& list) {
  for (Contestant& contestant : list) {
    contestant.settings.resize(std::min<std::size_t>(3, contestant.settings.size()));
    contestant.settings.erase(contestant.settings.begin());
  }
}

void say(const Measurement& m) {
  fmt::print("  {:30} {:<8g} ", m.contestant, m.setting);
  if (m.failure.empty()) {
    fmt::print("{:9.4f} s {:9.1e} m {:9.1e} rad {:9} steps {:6} switches\n", m.run_time, m.errors.position,
               m.errors.heading, m.counts.steps, m.counts.switches);
  } else {
    fmt::print("failed: {}\n", m.failure);
  }
  std::fflush(stdout);
}

/// Whether finer settings would but take longer. A failure says nothing about them.
bool ends_sweep(const Measurement& m) {
  if (!m.failure.empty()) return false;
  return m.run_time > (m.errors.position <= kUsefulError ? kLongEnough : kLongRun);
}

void sweep(const Subject& subject, double span, Results& results) {
  const Reference& reference = results.references.at(subject.key);
  const double short_span = results.quick ? kQuickExplicitSpan : kExplicitSpan;
  for (const Contestant& contestant : results.contestants) {
    for (const double setting : contestant.settings) {
      const double own_span = contestant.explicit_ ? std::min(span, short_span) : span;
      results.measurements.push_back(measure(subject, reference, contestant, setting, own_span));
      say(results.measurements.back());
      if (ends_sweep(results.measurements.back())) break;
    }
  }
}

/// Loosest setting with which a contestant stays within kUsefulError on a subject; negative if none.
double useful_setting(const Results& results, const std::string& subject, const Contestant& contestant) {
  double setting = -1;
  for (const Measurement& m : results.measurements) {
    if (m.subject != subject || m.contestant != contestant.key || !m.failure.empty()) continue;
    if (m.errors.position <= kUsefulError) setting = std::max(setting, m.setting);
  }
  return setting;
}

struct Variant {
  std::string value;
  Scene scene;
};

/// Run times of all contestants on variants of a subject's scene.
void grow(const std::string& quantity, const Subject& base, const std::vector<Variant>& variants, double span,
          Results& results) {
  fmt::print("{}\n", quantity);
  std::vector<Reference> references;
  std::vector<Subject> varied;
  for (const Variant& variant : variants) {
    varied.push_back({base.key + ", " + variant.value, base.title, variant.scene, ""});
    references.push_back(make_reference(varied.back(), span, Effort::kComparison));
  }
  for (const Contestant& contestant : results.contestants) {
    if (contestant.explicit_ || contestant.fixed_step) continue;
    Growth growth{quantity, contestant.key, useful_setting(results, base.key, contestant), {}};
    if (growth.setting < 0) continue;
    for (std::size_t k = 0; k < variants.size(); ++k) {
      growth.points.push_back({variants[k].value, measure(varied[k], references[k], contestant, growth.setting, span)});
      say(growth.points.back().measurement);
    }
    results.growth.push_back(growth);
  }
}

void grow_with_control_rate(const Subject& base, Results& results) {
  std::vector<Variant> variants = {{"continuous", base.scene}};
  for (const double period : {1e-2, 1e-3, 1e-4}) {
    Scene scene = base.scene;
    scene.solver.control_period = period;
    variants.push_back({fmt::format("held over {:g} s", period), scene});
  }
  grow("torque", base, variants, 1.0, results);
}

void grow_with_rollers(const Subject& base, Results& results) {
  std::vector<Variant> variants;
  for (const int rollers : {4, 6, 12, 24}) {
    Scene scene = base.scene;
    scene.robot.rollers = rollers;
    scene.robot.R_d = 0.034;
    variants.push_back({fmt::format("{}", rollers), scene});
  }
  grow("rollers on a wheel", base, variants, 5.0, results);
}

Results run(const Arguments& arguments, std::vector<Contestant> list) {
  Results results;
  results.quick = arguments.quick;
  results.subjects = subjects(arguments);
  results.contestants = std::move(list);
  for (const Subject& subject : results.subjects) {
    const double span = std::min(arguments.span, subject.scene.duration);
    fmt::print("{}, {:g} s\n", subject.title, span);
    std::fflush(stdout);
    const Reference& reference = results.references[subject.key] =
        make_reference(subject, span, arguments.quick ? Effort::kQuick : Effort::kRecord);
    for (const auto& check : reference.checks) {
      fmt::print("  reference ({}, {} switches) against {}: {:.1e} m {}\n", reference.title, reference.switches,
                 check.title, check.errors.position, check.failure);
    }
    sweep(subject, span, results);
  }
  const Subject& first = results.subjects.front();
  if (!arguments.quick && first.key == kSubjects[0].key) {
    grow_with_control_rate(first, results);
    grow_with_rollers(first, results);
  }
  return results;
}

void write(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

/// Reads the command line; false if all that was wanted was help.
bool read_arguments(int argc, char** argv, Arguments& arguments) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  // clang-format off
  options.add_options()
    ("output", po::value(&arguments.output)->value_name("FOLDER"),
     "where to write work_precision.csv and work_precision.md; default: here")
    ("scene", po::value(&arguments.scene)->value_name("KEY"), "run this one alone")
    ("contestant", po::value(&arguments.contestant)->value_name("KEY"), "run this one alone")
    ("span", po::value(&arguments.span)->value_name("S"),
     "simulate no more than the first S seconds of each scene, at least 1; default: all")
    ("quick", po::bool_switch(&arguments.quick), "a few seconds: one scene, its beginning, two settings each")
    ("list", po::bool_switch(&arguments.list), "print the keys of scenes and contestants")
    ("help", "print this");
  // clang-format on
  po::variables_map given;
  po::store(po::command_line_parser(argc, argv).options(options).positional({}).run(), given);
  po::notify(given);
  if (arguments.quick && !given.count("span")) arguments.span = kQuickSpan;
  if (given.count("help")) {
    std::cout << "Usage: work_precision [options]\n\nMeasures error against run time.\n\n"
              << options << "\nExit status: 0 done, 2 refused input, 1 the run could not be completed.\n";
    return false;
  }
  return true;
}

void print_list(const std::vector<Contestant>& list) {
  fmt::print("scenes:\n");
  for (const SubjectFile& file : kSubjects) fmt::print("  {:30} {}\n", file.key, file.title);
  fmt::print("contestants:\n");
  for (const Contestant& contestant : list) fmt::print("  {:30} {}\n", contestant.key, contestant.title);
}

/// Throws SceneError if what was asked for is not among `names`.
template <class Range, class Key>
void require_known(const char* option, const std::string& wanted, const Range& range, Key&& key) {
  if (wanted.empty()) return;
  std::string names;
  for (const auto& item : range) {
    if (wanted == key(item)) return;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", key(item));
  }
  throw SceneError(fmt::format("--{} = {}: must be one of {}", option, wanted, names));
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  std::vector<Contestant> list = contestants();
  try {
    if (!read_arguments(argc, argv, arguments)) return kDone;
    require_known("scene", arguments.scene, kSubjects, [](const SubjectFile& file) { return file.key; });
    if (!(arguments.span >= 1)) {
      throw SceneError(fmt::format("--span = {}: must be a number of seconds, 1 or more", arguments.span));
    }
    if (!std::filesystem::is_directory(arguments.output)) {
      throw SceneError(fmt::format("--output = {}: must be a folder", arguments.output));
    }
    require_known("contestant", arguments.contestant, list,
                  [](const Contestant& contestant) { return contestant.key; });
  } catch (const boost::program_options::error& error) {
    fmt::print(stderr, "work_precision: {}; see work_precision --help\n", error.what());
    return kRefused;
  } catch (const SceneError& error) {
    fmt::print(stderr, "work_precision: {}\n", error.what());
    return kRefused;
  }
  if (arguments.list) {
    print_list(list);
    return kDone;
  }
  if (!arguments.contestant.empty()) {
    list.erase(std::remove_if(list.begin(), list.end(),
                              [&](const Contestant& contestant) { return contestant.key != arguments.contestant; }),
               list.end());
  }
  if (arguments.quick) thin_out(list);
  try {
    const Results results = run(arguments, std::move(list));
    write(arguments.output + "/work_precision.csv", csv(results));
    write(arguments.output + "/work_precision.md", markdown(results));
    fmt::print("\n{}", comparison(results));
  } catch (const std::exception& error) {
    fmt::print(stderr, "work_precision: {}\n", error.what());
    return kNotCompleted;
  }
  return kDone;
}
