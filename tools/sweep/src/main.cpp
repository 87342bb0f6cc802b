// Simulates a family of scenes and writes a table with a row for each run; needs no ROS master.

#include <fmt/format.h>

#include <algorithm>
#include <boost/program_options.hpp>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "youbot_base_sim/offline_program.h"
#include "youbot_base_sim/record/output_file.h"
#include "youbot_base_sim/sweep/family.h"
#include "youbot_base_sim/sweep/finished_table.h"
#include "youbot_base_sim/sweep/journal.h"
#include "youbot_base_sim/sweep/quantities.h"
#include "youbot_base_sim/sweep/ranks.h"
#ifdef YOUBOT_BASE_SIM_ROS
#include "youbot_base_sim/ros/bag.h"
#endif
#include "youbot_base_sim/text/command_line.h"
#include "youbot_base_sim/text/progress_bar.h"
#include "youbot_base_sim/text/quote.h"

namespace {

using namespace youbot_base_sim;
using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr int kMaxThreads = 1024, kMaxSlices = 1'000'000;

/// One of equal parts of a sweep: the first is 1.
struct Slice {
  std::uint64_t number = 1, count = 1;

  RunRange of(std::uint64_t runs) const { return {runs * (number - 1) / count, runs * number / count}; }
};

struct Arguments {
  std::string family, csv, reuse;
  Slice slice;
  std::string scene;  // a run whose scene is to be printed, as typed; empty: none
  int threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));  // or ranks
  bool list = false, quiet = false;

  bool only_print() const { return list || !scene.empty(); }
};

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

Usage usage() {
  std::string remarks = "\nQuantities of a row (of all runs, less than 1e-9 is printed as 0):\n";
  for (const Quantity& quantity : quantities()) remarks += fmt::format("  {:<24}{}\n", quantity.name, quantity.text);
  return {"sweep FAMILY.yaml [options]",
          "Simulates a family of scenes, as docs/sweep.md describes it, and writes a table with a row for each run.\n"
          "`mpirun sweep FAMILY.yaml` does so on several machines. A sweep that ended early continues where it was.",
          remarks + "\nExit status: 0 done, 2 rejected input, 1 the sweep could not be completed.\n",
          "  sweep wheel_angles.yaml --list\n"
          "  sweep wheel_angles.yaml --csv angles.csv --threads 4\n"};
}

Slice slice_of(const std::string& text) {
  Slice slice;
  const std::size_t bar = text.find('/');
  const auto refuse = [&] {
    throw OptionError("--slice", text, fmt::format("be K/N, whole numbers with 1 <= K <= N <= {}", kMaxSlices));
  };
  try {
    if (bar == std::string::npos) refuse();
    slice.count = whole_number_of("--slice", text.substr(bar + 1), 1, kMaxSlices);
    slice.number = whole_number_of("--slice", text.substr(0, bar), 1, slice.count);
  } catch (const std::runtime_error&) {
    refuse();
  }
  return slice;
}

/// Reads the command line; false if it only asks for help. Throws std::runtime_error.
bool read_arguments(int argc, char** argv, const Ranks& ranks, Arguments& arguments) {
  namespace po = boost::program_options;
  po::options_description options("Options");
  std::string threads, slice;
  // clang-format off
  options.add_options()
    ("csv", po::value(&arguments.csv)->value_name("FILE"),
     "write the table there; left out: FAMILY.csv in the current folder. FILE.journal keeps finished runs meanwhile")
    ("threads", po::value(&threads)->value_name("N"),
     "number of threads; left out: one per core; not under mpirun")
    ("reuse", po::value(&arguments.reuse)->value_name("TABLE.csv"),
     "keep the rows of a table of the same scene and axes, such as one with fewer draws, and simulate the others")
    ("slice", po::value(&slice)->value_name("K/N"),
     "only the K-th of N parts of the runs, for a job array; the table is then FAMILY_K_of_N.csv")
    ("list", po::bool_switch(&arguments.list), "print the number of runs and how long they will take, and end")
    ("scene", po::value(&arguments.scene)->value_name("RUN"), "print the scene of a run, for simulate, and end")
    ("quiet", po::bool_switch(&arguments.quiet), "print nothing but errors and warnings of runs that failed");
  // clang-format on
  if (!parse(argc, argv, usage(), options, {"family", po::value(&arguments.family), 1, true})) return false;
  if (!threads.empty()) arguments.threads = static_cast<int>(whole_number_of("--threads", threads, 1, kMaxThreads));
  if (ranks.size() > 1) {
    if (!threads.empty())
      throw OptionError("--threads", threads, "be left out under mpirun, where each rank takes one core");
    arguments.threads = ranks.size();
  }
  if (!slice.empty()) arguments.slice = slice_of(slice);
  if (arguments.csv.empty()) {
    const auto& [number, count] = arguments.slice;
    arguments.csv = std::filesystem::path(arguments.family).stem().string() +
                    (count > 1 ? fmt::format("_{}_of_{}", number, count) : "") + ".csv";
  }
  return true;
}

std::string journal_of(const Arguments& arguments) { return arguments.csv + ".journal"; }

/// The folder of trajectories.
std::string folder_of(const Arguments& arguments) {
  return std::filesystem::path(arguments.csv).replace_extension().string() + "_runs";
}

/// Throws OutputError unless what the sweep reads and writes are different files.
void keep_apart(const Arguments& arguments, const Family& family, const RowMaker& maker) {
  std::vector<std::string> inputs = family.tables;
  inputs.insert(inputs.end(), {family.path, family.scene.path});
  if (!arguments.reuse.empty()) inputs.push_back(arguments.reuse);
  OutputOpener opener(inputs);
  opener.keep("--csv", arguments.csv);
  const OutputFile may_be_refused(arguments.csv);
  opener.keep("the journal beside --csv", journal_of(arguments));
  maker.keep_trajectories(opener);
}

RowMaker row_maker(const Arguments& arguments, const Family& family) {
  RowMaker::MakeRecorder make_bag;
#ifdef YOUBOT_BASE_SIM_ROS
  make_bag = bag_recorder;
#endif
  if (family.trajectories && family.trajectories->format == "bag" && !make_bag) {
    throw SceneError(fmt::format("{}: trajectories.format = bag: must be csv: this sweep was built without ROS",
                                 quote_path(family.path)));
  }
  return RowMaker(family, folder_of(arguments), make_bag);
}

std::string duration_text(double seconds) {
  if (!(seconds < 1e9)) return "years";
  if (seconds < 60) return fmt::format("{:.2g} s", seconds);
  const auto minutes = std::llround(seconds / 60);
  if (minutes < 60) return fmt::format("{} min", minutes);
  return fmt::format("{} h {} min", minutes / 60, minutes % 60);
}

std::string counts_text(const Tally& tally) {
  std::string text;
  if (tally.failed) text += fmt::format(", {} failed", tally.failed);
  if (tally.refused) text += fmt::format(", {} refused", tally.refused);
  if (tally.doubtful) text += fmt::format(", {} unreliable", tally.doubtful);
  return text;
}

/// Shows the progress: a bar on a terminal, else a line a minute.
class Progress {
 public:
  Progress(const Journal& journal, bool quiet)
      : runs_(journal.runs().size()), before_(journal.tally().runs), quiet_(quiet), bar_(quiet) {}

  void show(const Tally& tally) {
    if (bar_.due()) bar_.draw(static_cast<double>(tally.runs) / static_cast<double>(runs_), text(tally));
    if (bar_.shown() || quiet_ || Clock::now() < next_line_) return;
    next_line_ += 1min;
    print_error("sweep", text(tally));
  }
  void clear() { bar_.clear(); }

  /// Call it once all runs are finished.
  std::string summary(const Tally& tally) const {
    const std::string made = before_ == 0 ? "" : fmt::format(", {} of them", tally.runs - before_);
    return fmt::format("{} runs{} in {}, {:.3g} a second{}", tally.runs, made, duration_text(seconds_since(start_)),
                       rate(tally), counts_text(tally));
  }

 private:
  /// Runs a second since the sweep began or continued.
  double rate(const Tally& tally) const { return static_cast<double>(tally.runs - before_) / seconds_since(start_); }

  std::string text(const Tally& tally) const {
    std::string text = fmt::format("{} of {} runs", tally.runs, runs_);
    if (tally.runs > before_) {
      const double left = static_cast<double>(runs_ - tally.runs) / rate(tally);
      text += fmt::format(", {:.3g} a second, {} left", rate(tally), duration_text(left));
    }
    return text + counts_text(tally);
  }

  std::uint64_t runs_, before_;
  bool quiet_;
  ProgressBar bar_;
  Clock::time_point start_ = Clock::now(), next_line_ = start_ + 1min;
};

/// Makes the rows that the journal lacks. Returns a summary, or nothing if a signal stopped it.
std::optional<std::string> make_rows(const Arguments& arguments, const RowMaker& maker, Ranks& ranks,
                                     Journal& journal) {
  constexpr auto kSync = 1s;
  const std::uint64_t before = journal.tally().runs;
  if (before > 0 && !arguments.quiet) fmt::print("{} of {} runs were finished before\n", before, journal.runs().size());
  std::fflush(stdout);
  Progress progress(journal, arguments.quiet);
  Clock::time_point next_sync = Clock::now() + kSync;
  ranks.serve(journal, maker, arguments.threads, [&](const Tally& tally) {
    if (stop_requested()) return false;
    progress.show(tally);
    if (Clock::now() >= next_sync) {
      journal.sync();
      next_sync = Clock::now() + kSync;
    }
    return true;
  });
  progress.clear();
  if (!journal.is_complete()) return std::nullopt;
  return progress.summary(journal.tally());
}

/// Makes the table of the rows, reports it, and deletes the journal.
void write_table(const Arguments& arguments, const Family& family, const RowMaker& maker, Journal& journal,
                 const std::string& summary) {
  OutputFile file(arguments.csv);
  file.sync_on_commit();  // because the journal is deleted next
  Spread spread(family);
  file.write(maker.header() + "\n");
  journal.for_each_row([&](const Row& row) {
    file.write(row.text + "\n");
    spread.add(row);
  });
  file.commit();
  journal.remove();
  if (!arguments.quiet) fmt::print("{}: {}\n{}", summary, quote_path(arguments.csv), spread.text());
  const Tally& tally = journal.tally();
  if (tally.failed + tally.refused + tally.doubtful == 0) return;
  print_error("sweep", fmt::format("warning: of {} runs{}: see the column reason", tally.runs, counts_text(tally)));
}

const char* text_of(Sampling sampling) {
  if (sampling == Sampling::kLatinHypercube) return ", Latin hypercube";
  return sampling == Sampling::kSobol ? ", Sobol' points" : "";
}

/// Prints the work to be done. Times the first run.
void list(const Arguments& arguments, Family family, const Ranks& ranks) {
  const RunRange runs = arguments.slice.of(family.runs());
  fmt::print("{} runs of {}\n", runs.size(), quote_path(family.scene.path));
  for (const Axis& axis : family.axes) fmt::print("  {}: {}\n", quote(axis.key), axis.text());
  if (family.has_draws()) fmt::print("  {} draws{}\n", family.draws, text_of(family.sampling));
  std::fflush(stdout);
  const Clock::time_point start = Clock::now();
  family.trajectories.reset();
  RowMaker(family, "", nullptr).make(runs.begin, stop_requested());
  const double seconds = seconds_since(start);
  const auto at_once = std::min<std::uint64_t>(runs.size(), static_cast<std::uint64_t>(arguments.threads));
  fmt::print("the first run took {}; at that, all take {} on {} {}\n", duration_text(seconds),
             duration_text(seconds * static_cast<double>(runs.size()) / static_cast<double>(at_once)), at_once,
             ranks.size() > 1 ? "ranks" : "threads");
}

/// The work of rank 0, from the journal to the table. Returns the exit status.
int run_first(const Arguments& arguments, const Family& family, const std::vector<std::string>& fingerprint,
              const RowMaker& maker, Ranks& ranks) {
  std::optional<Journal> journal;
  const auto way_on = [&] {
    return fmt::format("; {} of {} runs are in {}; the same command goes on from there", journal->tally().runs,
                       journal->runs().size(), quote_path(journal_of(arguments)));
  };
  try {
    keep_apart(arguments, family, maker);
    if (!arguments.quiet)
      for (const auto& [key, warning] : family.warnings) print_error("sweep", "warning: " + warning);
    journal.emplace(journal_of(arguments), fingerprint, arguments.slice.of(family.runs()));
    const std::optional<std::string> summary = make_rows(arguments, maker, ranks, *journal);
    if (!summary) {
      print_error("sweep", fmt::format("stopped by {}{}", stop_reason(), way_on()));
      return kNotCompleted;
    }
    if (!family.tables.empty() && family.fingerprint() != fingerprint) {
      throw SceneError(fmt::format("{}: a table of its scenes was changed while it ran; delete {} to begin anew",
                                   quote_path(family.path), quote_path(journal_of(arguments))));
    }
    write_table(arguments, family, maker, *journal, *summary);
    return kDone;
  } catch (const OutputError& error) {
    print_error("sweep", error.what() + (journal ? way_on() : ""));
    return journal || error.is_full() ? kNotCompleted : kRefused;
  } catch (const std::exception& error) {
    print_error("sweep", error.what());
  }
  return kNotCompleted;
}

/// The work of a rank; the families of all must be one. Returns the exit status.
int run_rank(const Arguments& arguments, const Family& family, const std::vector<std::string>& fingerprint,
             const RowMaker& maker, Ranks& ranks) {
  const std::vector<std::string> prints = ranks.gather(fmt::format("{}", fmt::join(fingerprint, "\n")));
  const auto other = std::find_if(prints.begin(), prints.end(), [&](const auto& print) { return print != prints[0]; });
  if (other != prints.end()) {
    if (ranks.rank() == 0)
      print_error("sweep", fmt::format("{}: rank {} has another program, family, scene or table than rank 0",
                                       quote_path(family.path), other - prints.begin()));
    return kRefused;
  }
  int status = kDone;
  if (ranks.rank() == 0) {
    status = run_first(arguments, family, fingerprint, maker, ranks);
  } else {
    try {
      ranks.work(maker);
    } catch (const std::exception& error) {
      print_error("sweep", error.what());
      status = kNotCompleted;
    }
  }
  if (status != kDone && ranks.size() > 1) ranks.abort(status);
  return status;
}

/// Reads the command line and the family. Returns the exit status.
int run_program(int argc, char** argv) {
  Arguments arguments;
  Family family;
  std::vector<std::string> fingerprint;
  std::optional<RowMaker> maker;
  std::optional<FinishedTable> finished;
  const std::unique_ptr<Ranks> ranks = join_ranks(argc, argv);
  std::uint64_t scene = 0;
  bool helped = false;
  const std::string refusal = refusal_of([&] {
    helped = !read_arguments(argc, argv, *ranks, arguments);
    if (helped) return;
    family = load_family(arguments.family);
    maker.emplace(row_maker(arguments, family));
    if (!arguments.scene.empty()) scene = whole_number_of("--scene", arguments.scene, 0, family.runs() - 1);
    const Slice& slice = arguments.slice;
    if (slice.count > family.runs()) {
      throw OptionError("--slice", fmt::format("{}/{}", slice.number, slice.count),
                        fmt::format("be at most as many parts as runs, {}", family.runs()));
    }
    if (arguments.only_print()) return;
    fingerprint = family.fingerprint();
    if (slice.count > 1) fingerprint.push_back(fmt::format("{}/{} slice", slice.number, slice.count));
    if (arguments.reuse.empty()) return;
    fingerprint.push_back(file_hash(arguments.reuse) + " table of --reuse");
    if (std::filesystem::is_fifo(arguments.reuse))  // refused now that its writer has ended
      throw OptionError("--reuse", arguments.reuse, "be a file, which is read twice, rather than a pipe");
    finished.emplace(arguments.reuse, family, *maker);
    maker->take_from(*finished);
  });
  for (const std::string& text : ranks->gather(refusal)) {
    if (text.empty()) continue;
    if (ranks->rank() == 0) print_error("sweep", text);
    return kRefused;
  }
  if (helped) return kDone;
  catch_signals();
  if (!arguments.only_print()) return run_rank(arguments, family, fingerprint, *maker, *ranks);
  if (ranks->rank() > 0) return kDone;
  if (arguments.list) {
    list(arguments, family, *ranks);
  } else {
    fmt::print("{}", text_of(family.scene, family.settings(scene)));
  }
  return kDone;
}

}  // namespace

int main(int argc, char** argv) {
  return run_offline_program("sweep", [&] { return run_program(argc, argv); });
}
