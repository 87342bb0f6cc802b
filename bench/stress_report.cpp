#include "stress_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <set>

#include "youbot_base_sim/physics/parameters.h"
#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

namespace {

constexpr double kHeldAccuracy = 1e-5;  // m, of a motion in which a wheel is held, at the default tolerance

constexpr char kExplanation[] = R"(
Every cell is one motion at one tolerance tol (the relative one; the absolute one is 1e-3 of it). Run time is the
processor's, of one thread. Required is:

- **finishes**: the whole duration with a finite state, in a process of its own; not refused, cut for its run time,
  hung (20 s in one call) or crashed.
- **cost**: at most 20 times the run time of Case 1 (2b, counter-clockwise) for the same simulated time at the same
  tolerance, which is measured before each group. Cut at 26 times; less than 0.05 s is never too much.
- **1 ms**: at most 1 ms of run time for each simulated millisecond (of long runs: of the first and last 5 s). Where one
  takes longer the run is repeated, and the lesser time of each millisecond counts.
- **energy**: the largest energy_balance_error (looked at every 10 ms or 1/4000 of the run) is at most
  tol (E + 1.8e-5 J). E is the larger of the greatest kinetic energy and the integral of the sum of |M dphi|.
- **halving**: half the tolerance moves the end pose by at most tol S (m; the turn counts at the wheels' centres, 0.28 m
  from O). Where it moves further, by no more than A tol S, the motion is *sensitive*; beyond that it fails.
- **held wheel**: of the random runs at the default tolerance, those in which a wheel was held between two rollers end
  within 1e-5 m of where they end with a hundredth of the tolerance.

S is the way: 1 mm more than the longer of the base's way and the longest that a wheel rolled. A is the amplification:
the distance at the end of two runs at tolerance 1e-9 whose wheel angles start 1e-6 rad apart, over R 1e-6 rad. The echo
is the distance at the end of two runs at the cell's own tolerance that start 1e-12 rad apart. A and echo are looked for
only where halving moves the end by more than tol S. 1.8e-5 J and 1 mm are the robot's energy and way at 1e-3 SI units,
where relative and absolute tolerance meet.

The numbers below are measured over allowed: up to 1 is right. `stress.csv` has every run.
)";

double over(double measured, double allowed) { return measured / allowed; }

bool exceeds(double ratio) { return !(ratio <= 1); }  // also where it could not be measured

double permitted_time(const Measurement& m, const BaseCost& base) {
  return std::max(0.05, kMostTimesBase * base.plain * m.duration);
}

double energy_scale(const Measurement& m) { return m.energy + 0.5 * RobotParameters().m_s() * kSmallest * kSmallest; }

std::string full_name(const StressResult& r) { return r.cell->group + "/" + r.cell->name; }

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::kHolds:
      return "holds";
    case Outcome::kSensitive:
      return "sensitive";
    case Outcome::kFails:
      return "fails";
    default:
      return "unknown";
  }
}

std::string ratio(double value) {
  return std::isnan(value) ? "-" : fmt::format(exceeds(value) ? "**{:.3g}**" : "{:.3g}", value);
}

std::string number(const char* format, double value) { return std::isnan(value) ? "-" : fmt::format(format, value); }

/// Largest `what` of the results, those that could not be measured left out.
double worst(const std::vector<const StressResult*>& results, const std::function<double(const StressResult&)>& what) {
  double most = std::numeric_limits<double>::quiet_NaN();
  for (const StressResult* r : results) most = std::fmax(most, what(*r));
  return most;
}

/// What a result fails by, in words; empty if all holds.
std::string failure(const StressResult& r) {
  const Measurement& m = r.measurement;
  if (m.ending == Ending::kRefused || m.ending == Ending::kFailed) {
    return fmt::format("{}: {}", name_of(m.ending), m.message);
  }
  std::string text;
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : "; ") + more; };
  if (m.ending != Ending::kFinished) {
    add(fmt::format("{} at {:.4g} of {:g} s", name_of(m.ending), m.reached, m.duration));
  }
  if (!m.finite) add(fmt::format("not finite after {:.4g} s", m.reached));
  if (m.ending == Ending::kFinished && exceeds(r.verdict.cost)) add(fmt::format("cost {:.4g} times", r.verdict.cost));
  if (r.verdict.slice > 1) add(fmt::format("1 ms {:.4g} times", r.verdict.slice));
  if (m.ending != Ending::kFinished || !m.finite) return text;
  if (exceeds(r.verdict.energy)) add(fmt::format("energy {:.4g} times", r.verdict.energy));
  if (r.verdict.halving_outcome == Outcome::kFails) {
    add(fmt::format("halving {:.4g} times (A {:.2g})", r.verdict.halving, m.amplification));
  }
  if (r.verdict.halving_outcome == Outcome::kUnknown) add("halving: a run to compare with did not finish");
  if (exceeds(r.verdict.held)) add(fmt::format("held wheel {:.3g} times", r.verdict.held));
  return text;
}

/// The results of each line of the summary: of a cell, or of all random runs.
std::vector<std::pair<std::string, std::vector<const StressResult*>>> lines(const std::vector<StressResult>& results) {
  std::vector<std::pair<std::string, std::vector<const StressResult*>>> lines;
  for (const StressResult& r : results) {
    const std::string name = r.cell->group == kRandomGroup ? kRandomGroup : full_name(r);
    if (lines.empty() || lines.back().first != name) lines.push_back({name, {}});
    lines.back().second.push_back(&r);
  }
  return lines;
}

std::string summary_line(const std::string& name, const std::vector<const StressResult*>& results) {
  std::size_t finished = 0, holding = 0, sensitive = 0;
  const StressResult* first_failure = nullptr;
  for (const StressResult* r : results) {
    finished += r->verdict.finished;
    sensitive += r->verdict.halving_outcome == Outcome::kSensitive;
    holding += r->verdict.holds();
    if (!first_failure && !r->verdict.holds()) first_failure = r;
  }
  const auto of = [&](const char* format, std::size_t count) { return fmt::format(format, count, results.size()); };
  return fmt::format("| {} | {} | {} | {} | {} | {} | {}{} | {} | {} | {} |\n", name,
                     of(finished == results.size() ? "{} of {}" : "**{} of {}**", finished),
                     ratio(worst(results, [](const auto& r) { return r.verdict.cost; })),
                     ratio(worst(results, [](const auto& r) { return r.verdict.slice; })),
                     number("{:.2g} ms", 1e3 * worst(results, [](const auto& r) { return r.measurement.slice_999; })),
                     ratio(worst(results, [](const auto& r) { return r.verdict.energy; })),
                     ratio(worst(results, [](const auto& r) { return r.verdict.halving; })),
                     sensitive ? fmt::format(", {} sensitive", sensitive) : "",
                     number("{:.2g}", worst(results, [](const auto& r) { return r.measurement.amplification; })),
                     number("{:.1e} m", worst(results, [](const auto& r) { return r.measurement.echo; })),
                     first_failure ? of("{} of {}", holding) : "all");
}

/// The failures, for each line of the summary those of equal kind once, with the tolerances.
std::string failure_table(const std::vector<StressResult>& results) {
  std::string text;
  for (const StressResult& r : results) {
    if (r.verdict.holds()) continue;
    text += fmt::format("| {} | {:g} | {} |\n", full_name(r), r.tolerance, failure(r));
  }
  if (text.empty()) return "";
  return "\n## What does not hold\n\n| cell | tol | |\n|---|---|---|\n" + text;
}

/// The torques of a random run are the list in brackets of its scene.
std::string torques_of(const StressCell& cell) {
  const std::size_t start = cell.scene.rfind('[');
  std::string text;
  std::size_t position = start + 1;
  for (int i = 0; i < kWheels; ++i) {
    std::size_t length = 0;
    text += fmt::format("{}{:+.4f}", i ? ", " : "", std::stod(cell.scene.substr(position), &length));
    position += length + 1;
  }
  return text;
}

std::string held_row(const StressResult& r) {
  const Measurement& m = r.measurement;
  return fmt::format("| {} | {} | {} | {:.2e} | {:.2e} | {} |\n", r.cell->name, torques_of(*r.cell), m.held(),
                     m.hundredth_distance, m.hundredth_heading, exceeds(r.verdict.held) ? "**no**" : "yes");
}

/// The random runs in which a wheel was held, beside what a hundredth of the tolerance makes of them.
std::string held_table(const std::vector<StressResult>& results) {
  std::string rows;
  double worst_free = 0;
  std::size_t runs = 0, told = 0, held = 0, within = 0;
  for (const StressResult& r : results) {
    const Measurement& m = r.measurement;
    if (std::isnan(m.hundredth_distance)) continue;
    ++runs;
    told += !std::isnan(m.held());
    if (m.held() > 0) {
      ++held;
      within += !exceeds(r.verdict.held);
      rows += held_row(r);
    } else {
      worst_free = std::max(worst_free, m.hundredth_distance);
    }
  }
  if (runs == 0) return "";
  std::string text = "\n## A wheel held between two rollers\n\n";
  if (told == 0)
    text += "No counter of the integration tells of held wheels, as far as this suite knows their names.\n";
  text += fmt::format(
      "Of {} random runs at the default tolerance, {} tell of a wheel that was held; the end position of {} of these "
      "is\n"
      "within 1e-5 m of the run at a hundredth of the tolerance. Of the others, the largest such distance is {:.1e} "
      "m.\n",
      runs, held, within, worst_free);
  if (rows.empty()) return text;
  return text +
         "\n| run | torque fl, fr, bl, br, N m | times held | distance, m | heading, rad | within |\n"
         "|---|---|---|---|---|---|\n" +
         rows;
}

std::string base_table(const std::vector<StressResult>& results) {
  std::map<double, std::vector<double>, std::greater<>> costs;
  for (const StressResult& r : results) costs[r.tolerance].push_back(r.base.plain);
  std::string text =
      "\n| tol | base scene, ms of run time a simulated second: least to most over the suite |\n|---|---|\n";
  for (const auto& [tolerance, values] : costs) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    text += fmt::format("| {:g} | {:.3g} to {:.3g} |\n", tolerance, 1e3 * *least, 1e3 * *most);
  }
  return text;
}

/// Names of all counters, in the order in which they come.
std::vector<std::string> counter_names(const std::vector<StressResult>& results) {
  std::vector<std::string> names;
  for (const StressResult& r : results) {
    for (std::size_t k = 0; k < r.measurement.counters; ++k) {
      const std::string name = r.measurement.counter[k].name;
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

std::string counter_cell(const Measurement& m, const std::string& name) {
  for (std::size_t k = 0; k < m.counters; ++k) {
    if (m.counter[k].name == name) return fmt::format("{:.0f}", m.counter[k].value);
  }
  return "";
}

/// The counters at the default tolerance, or else at the first that was run; those of the random runs summed.
std::string counter_table(const std::vector<StressResult>& results) {
  double tolerance = results.front().tolerance;
  for (const StressResult& r : results) {
    if (r.tolerance == SolverSettings().relative_tolerance) tolerance = r.tolerance;
  }
  const std::vector<std::string> names = counter_names(results);
  std::string text = fmt::format("\n## Counters at {:g}\n\n| cell |", tolerance), rule = "|---|";
  for (const std::string& name : names) {
    text += fmt::format(" {} |", name);
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  for (const auto& [line, of_line] : lines(results)) {
    std::map<std::string, double> sums;
    for (const StressResult* r : of_line) {
      const Measurement& m = r->measurement;
      for (std::size_t k = 0; k < m.counters && r->tolerance == tolerance; ++k) {
        sums[m.counter[k].name] += m.counter[k].value;
      }
    }
    text += fmt::format("| {} |", line);
    for (const std::string& name : names) text += sums.count(name) ? fmt::format(" {:.0f} |", sums[name]) : " - |";
    text += "\n";
  }
  return text;
}

std::string quoted(std::string text) {
  std::replace(text.begin(), text.end(), '"', '\'');
  return '"' + text + '"';
}

}  // namespace

bool Verdict::holds() const {
  return finished && !exceeds(cost) && !exceeds(slice) && !exceeds(energy) && !exceeds(held) &&
         (halving_outcome == Outcome::kHolds || halving_outcome == Outcome::kSensitive);
}

Verdict judge(const Measurement& m, double tolerance, const BaseCost& base) {
  Verdict v;
  v.finished = m.ending == Ending::kFinished && m.finite;
  v.cost = over(m.run_time, permitted_time(m, base));
  v.slice = over(m.worst_slice, kMostSlice);
  v.energy = over(m.energy_error, tolerance * energy_scale(m));
  v.halving = over(m.halving, permitted_halving(m, tolerance));
  v.held = m.held() > 0 && !std::isnan(m.hundredth_distance) ? over(m.hundredth_distance, kHeldAccuracy) : 0;
  v.halving_outcome = Outcome::kFails;
  if (v.halving <= m.amplification) v.halving_outcome = Outcome::kSensitive;
  if (v.halving <= 1) v.halving_outcome = Outcome::kHolds;
  if (std::isnan(v.halving)) v.halving_outcome = Outcome::kUnknown;
  return v;
}

std::string csv(const std::vector<StressResult>& results) {
  const std::vector<std::string> names = counter_names(results);
  std::string text =
      "group,cell,tolerance,ending,message,finite,duration,reached,run_time,base_run_time,worst_slice,slice_99.9,"
      "late_slices,energy_error,energy,way,halving,echo,amplification,x,y,psi,hundredth_distance,hundredth_heading,"
      "cost_ratio,slice_ratio,energy_ratio,halving_ratio,halving_outcome,holds";
  for (const std::string& name : names) text += "," + name;
  text += "\n";
  for (const StressResult& r : results) {
    const Measurement& m = r.measurement;
    text += fmt::format("{},{},{:g},{},{},{},{},{}", r.cell->group, r.cell->name, r.tolerance, name_of(m.ending),
                        quoted(m.message), m.finite ? 1 : 0, m.duration, m.reached);
    for (const double value : {m.run_time,
                               r.base.plain * m.duration,
                               m.worst_slice,
                               m.slice_999,
                               m.late_slices,
                               m.energy_error,
                               m.energy,
                               m.way,
                               m.halving,
                               m.echo,
                               m.amplification,
                               m.x,
                               m.y,
                               m.psi,
                               m.hundredth_distance,
                               m.hundredth_heading,
                               r.verdict.cost,
                               r.verdict.slice,
                               r.verdict.energy,
                               r.verdict.halving}) {
      text += fmt::format(",{:.10g}", value);
    }
    text += fmt::format(",{},{}", name_of(r.verdict.halving_outcome), r.verdict.holds() ? 1 : 0);
    for (const std::string& name : names) text += "," + counter_cell(m, name);
    text += "\n";
  }
  return text;
}

std::string markdown(const std::vector<StressResult>& results) {
  std::size_t holding = 0;
  for (const StressResult& r : results) holding += r.verdict.holds();
  std::string text = fmt::format("# Stress suite\n\n{} of {} runs hold all requirements.\n", holding, results.size());
  text += kExplanation + base_table(results);
  text +=
      "\n## Cells, each with the worst over its tolerances\n\n| cell | finished | cost | slowest ms | its 99.9 % | "
      "energy | halving | "
      "A | echo | all hold |\n|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [name, of_line] : lines(results)) text += summary_line(name, of_line);
  return text + held_table(results) + failure_table(results) + counter_table(results);
}

}  // namespace youbot_base_sim
