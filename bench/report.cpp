#include "report.h"

#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <fstream>

namespace youbot_base_sim {
namespace bench {

namespace {

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown processor";
}

// What the compiler was told to use; all contestants but SUNDIALS itself are compiled with it.
const char* instruction_set() {
#if defined(__AVX512F__)
  return "AVX-512";
#elif defined(__AVX2__)
  return "AVX2";
#elif defined(__AVX__)
  return "AVX";
#elif defined(__x86_64__)
  return "plain x86-64 (SSE2)";
#else
  return "the compiler's default instruction set";
#endif
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", std::gmtime(&now));
  return text;
}

std::string seconds(double t) {
  if (t < 0.0995) return fmt::format("{:.2g} ms", 1e3 * t);
  if (t < 0.9995) return fmt::format("{:.0f} ms", 1e3 * t);
  return fmt::format("{:.3g} s", t);
}

std::string count(std::int64_t n) { return n < 0 ? "-" : fmt::format("{}", n); }

// Three figures, without an exponent while that is short.
std::string figures(double x) { return x >= 1000 ? fmt::format("{:.0f}", x) : fmt::format("{:.3g}", x); }

std::string machine(const Results& results) {
  std::string text = fmt::format("{}; {}; g++ {}, `{}`: {}; {}.", today(), processor(), __VERSION__,
                                 YOUBOT_BASE_SIM_BENCH_FLAGS, instruction_set(), libraries());
  if (results.quick) text += " A quick look, not for the record.";
  return text;
}

std::string references_table(const Results& results) {
  std::string text =
      "| scene | simulated | switches | reference | checked by | position | heading | velocity | wheel rates |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (const Subject& subject : results.subjects) {
    const Reference& reference = results.references.at(subject.key);
    for (const auto& check : reference.checks) {
      const std::string found = check.failure.empty() ? fmt::format("{:.1e} m | {:.1e} rad | {:.1e} m/s | {:.1e} rad/s",
                                                                    check.errors.position, check.errors.heading,
                                                                    check.errors.velocity, check.errors.wheel_rate)
                                                      : check.failure + " | | |";
      text += fmt::format("| {} | {:g} s | {} | {} | {} | {} |\n", subject.title, reference.times.back(),
                          reference.switches, reference.title, check.title, found);
    }
  }
  return text;
}

/// Run time, ratio to this package and real-time factor of each contestant on each scene.
std::string useful_table(const Results& results) {
  std::string text = "| contestant |", rule = "|---|";
  for (const Subject& subject : results.subjects) {
    text += fmt::format(" {} |", subject.title);
    rule += "---|";
  }
  text += "\n" + rule + "\n";
  const std::string& ours = results.contestants.front().key;
  for (const Contestant& contestant : results.contestants) {
    if (contestant.explicit_) continue;
    text += fmt::format("| {} |", contestant.title);
    for (const Subject& subject : results.subjects) {
      const Reached reached = time_within(results.measurements, subject.key, contestant.key, kUsefulError);
      const Reached own = time_within(results.measurements, subject.key, ours, kUsefulError);
      if (reached.run_time < 0) {
        text += " never |";
        continue;
      }
      const double span = results.references.at(subject.key).times.back();
      text += fmt::format(" {}{}, ", reached.bound ? "<= " : "", seconds(reached.run_time));
      if (own.run_time > 0) text += fmt::format("{:.3g}x, ", reached.run_time / own.run_time);
      text += fmt::format("{} x real time |", figures(span / reached.run_time));
    }
    text += "\n";
  }
  return text;
}

/// How run time grows with accuracy on one scene.
std::string accuracy_table(const Results& results, const Subject& subject) {
  std::string text =
      "| contestant | 1e-2 m | 1e-3 m | 1e-4 m | 1e-5 m | 1e-6 m | 1e-7 m | 1e-8 m |\n"
      "|---|---|---|---|---|---|---|---|\n";
  for (const Contestant& contestant : results.contestants) {
    if (contestant.explicit_) continue;
    text += fmt::format("| {} |", contestant.title);
    for (const double error : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
      const Reached reached = time_within(results.measurements, subject.key, contestant.key, error);
      if (reached.run_time < 0) {
        text += " - |";
      } else {
        text += fmt::format(" {}{} |", reached.bound ? "<= " : "", seconds(reached.run_time));
      }
    }
    text += "\n";
  }
  return text;
}

std::string setting_of(const Contestant& contestant, double setting) {
  return contestant.fixed_step ? fmt::format("h = {:g} s", setting) : fmt::format("{:g}", setting);
}

const Contestant& contestant_of(const Results& results, const std::string& key) {
  for (const Contestant& contestant : results.contestants) {
    if (contestant.key == key) return contestant;
  }
  throw RunFailure("no contestant " + key);
}

std::string growth_tables(const Results& results) {
  std::string text, quantity;
  for (const Growth& growth : results.growth) {
    const Contestant& contestant = contestant_of(results, growth.contestant);
    if (growth.quantity != quantity) {
      quantity = growth.quantity;
      text += fmt::format("\n| {} | tolerance |", quantity);
      for (const auto& point : growth.points) text += fmt::format(" {} |", point.value);
      text += "\n|---|---|";
      for (std::size_t k = 0; k < growth.points.size(); ++k) text += "---|";
      text += "\n";
    }
    text += fmt::format("| {} | {} |", contestant.title, setting_of(contestant, growth.setting));
    for (const auto& point : growth.points) {
      const Measurement& m = point.measurement;
      if (!m.failure.empty()) {
        text += fmt::format(" {} |", m.failure);
      } else {
        text += fmt::format(" {} ({:.0e} m, {} switches) |", seconds(m.run_time / m.span), m.errors.position,
                            m.counts.switches);
      }
    }
    text += "\n";
  }
  return text;
}

std::string runs_table(const Results& results, const Subject& subject) {
  std::string text =
      "| contestant | tolerance or step | span | run time | per simulated s | position, m | heading, rad | velocity, "
      "m/s | "
      "wheel rates, rad/s | steps | rejected | locating | evaluations | Jacobians | LU | switches |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const Measurement& m : results.measurements) {
    if (m.subject != subject.key) continue;
    const Contestant& contestant = contestant_of(results, m.contestant);
    text += fmt::format("| {} | {} | {:g} s |", contestant.title, setting_of(contestant, m.setting), m.span);
    if (!m.failure.empty()) {
      text += fmt::format(" failed: {} | | | | | | | | | | | | |\n", m.failure);
      continue;
    }
    text += fmt::format(" {} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {} | {} | {} | {} | {} | {} | {} |\n",
                        seconds(m.run_time), seconds(m.run_time / m.span), m.errors.position, m.errors.heading,
                        m.errors.velocity, m.errors.wheel_rate, count(m.counts.steps), count(m.counts.rejected),
                        count(m.counts.location_steps), count(m.counts.evaluations), count(m.counts.jacobians),
                        count(m.counts.factorizations), count(m.counts.switches));
  }
  return text;
}

std::string explicit_table(const Results& results) {
  std::string text =
      "| scene | contestant | tolerance or step | span | position | run time per simulated s | real time |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const Subject& subject : results.subjects) {
    for (const Measurement& m : results.measurements) {
      const Contestant& contestant = contestant_of(results, m.contestant);
      if (m.subject != subject.key || !contestant.explicit_) continue;
      const std::string found = m.failure.empty()
                                    ? fmt::format("{:.1e} m | {} | {} x", m.errors.position,
                                                  seconds(m.run_time / m.span), figures(m.span / m.run_time))
                                    : "failed: " + m.failure + " | |";
      text += fmt::format("| {} | {} | {} | {:g} s | {} |\n", subject.title, contestant.title,
                          setting_of(contestant, m.setting), m.span, found);
    }
  }
  return text;
}

}  // namespace

std::string csv(const Results& results) {
  std::string text =
      "scene,scene_title,contestant,contestant_title,setting_kind,setting,span_s,run_time_s,repeats,"
      "run_time_per_simulated_s,real_time_factor,position_error_m,heading_error_rad,velocity_error_m_s,"
      "yaw_rate_error_rad_s,wheel_rate_error_rad_s,roller_rate_error_rad_s,steps,rejected_steps,location_steps,"
      "evaluations,jacobians,factorizations,switches,failure\n";
  const auto number = [](std::int64_t n) { return n < 0 ? std::string() : std::to_string(n); };
  for (const Measurement& m : results.measurements) {
    const Contestant& contestant = contestant_of(results, m.contestant);
    std::string title;
    for (const Subject& subject : results.subjects) {
      if (subject.key == m.subject) title = subject.title;
    }
    text += fmt::format("{},\"{}\",{},\"{}\",{},{:g},{:g},", m.subject, title, m.contestant, contestant.title,
                        contestant.fixed_step ? "step_s" : "relative_tolerance", m.setting, m.span);
    if (!m.failure.empty()) {
      text += fmt::format(",,,,,,,,,,,,,,,,,\"{}\"\n", m.failure);
      continue;
    }
    text += fmt::format("{:.6g},{},{:.6g},{:.6g},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},", m.run_time, m.repeats,
                        m.run_time / m.span, m.span / m.run_time, m.errors.position, m.errors.heading,
                        m.errors.velocity, m.errors.yaw_rate, m.errors.wheel_rate, m.errors.roller_rate);
    text += fmt::format("{},{},{},{},{},{},{},\n", number(m.counts.steps), number(m.counts.rejected),
                        number(m.counts.location_steps), number(m.counts.evaluations), number(m.counts.jacobians),
                        number(m.counts.factorizations), number(m.counts.switches));
  }
  return text;
}

std::string comparison(const Results& results) {
  return fmt::format(
      "Run time at a largest position error of {:g} m, ratio to this package, simulated over run time:\n\n{}",
      kUsefulError, useful_table(results));
}

std::string markdown(const Results& results) {
  std::string text = "# Error against run time\n\n";
  text += "Written by `scripts/work_precision`. " + machine(results) + "\n\n";
  text += "![error against run time](work_precision.svg)\n\n";
  text +=
      "All contestants integrate the same equations, `SlipModel::derivative`, with the same analytic Jacobian, "
      "`SlipModel::linearize`, in one program, one after the other, on one core. Run time is processor time of the "
      "integration alone, the least of 3 to 10 runs; runs beyond 1 s are made once. Everything but SUNDIALS itself, "
      "which is the system's, is compiled with the flags above. Errors are the largest over rows at 20 Hz. A "
      "contestant's sweep ends after its first run beyond " +
      fmt::format("{:g} s, or {:g} s if that is within {:g} m.\n\n", kLongRun, kLongEnough, kUsefulError);
  for (const Contestant& contestant : results.contestants) {
    text += fmt::format("- **{}**: {}\n", contestant.title, contestant.notes);
  }
  text +=
      "\nodeint's steppers know no events. One driver for all of them repeats a step in which a wheel comes to an "
      "edge, "
      "shortened by Newton's method until it ends there, and starts the next one with the size that served after the "
      "last switch.\n\n";
  text += "## The references and how far they can be trusted\n\n" + references_table(results);
  text += fmt::format(
      "\n## At a largest position error of {:g} m\n\nRun time, ratio to this package, simulated time over run time; "
      "interpolated on each contestant's curve. `<=`: its coarsest setting is more accurate already. \"never\": not at "
      "any setting that it was run with.\n\n{}",
      kUsefulError, useful_table(results));
  text += "\n## How cost grows with accuracy\n\nRun time at which the largest position error comes down to:\n";
  for (const Subject& subject : results.subjects) {
    text += fmt::format("\n{}:\n\n{}", subject.title, accuracy_table(results, subject));
  }
  if (!results.growth.empty()) {
    text +=
        "\n## How cost grows with the control rate and with the number of switches\n\nRun time per simulated second, "
        "position error and number of switches, Case 1 counter-clockwise, each contestant at the loosest tolerance at "
        "which it stays within 1e-5 m on that scene above. Torque: over 1 s; number of rollers: over 5 s, "
        "with `roller_axis_radius` 0.034, which four rollers need.\n" +
        growth_tables(results);
  }
  text +=
      "\n## Explicit methods\n\nRollers relax within 1e-7 s, so their steps cannot be longer however loose the "
      "tolerance. They run over a short span, which their errors are of; compare the run time per simulated "
      "second.\n\n" +
      explicit_table(results);
  text += "\n## All runs\n";
  for (const Subject& subject : results.subjects) {
    text += fmt::format("\n{}:\n\n{}", subject.title, runs_table(results, subject));
  }
  return text;
}

}  // namespace bench
}  // namespace youbot_base_sim
