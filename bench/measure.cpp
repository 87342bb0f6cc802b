#include "measure.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <sstream>

namespace youbot_base_sim {
namespace bench {

namespace {

// Of this process and no other: what else the machine does then disturbs least.
double processor_time() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// What is not a number counts as infinite.
void extend(double& error, double difference) {
  if (!(difference <= error)) error = std::isnan(difference) ? std::numeric_limits<double>::infinity() : difference;
}

void widen(Errors& errors, const Numbers& a, const Numbers& b) {
  extend(errors.position, std::hypot(a[0] - b[0], a[1] - b[1]));
  extend(errors.heading, std::abs(a[2] - b[2]));
  extend(errors.velocity, std::hypot(a[3] - b[3], a[4] - b[4]));
  extend(errors.yaw_rate, std::abs(a[5] - b[5]));
  for (std::size_t i = 0; i < kWheels; ++i) {
    extend(errors.wheel_rate, std::abs(a[kDphi + i] - b[kDphi + i]));
    extend(errors.roller_rate, std::abs(a[kDgamma + i] - b[kDgamma + i]));
  }
}

/// Differences to the rows of a file, which are at some of the reference's times.
Errors difference_to_file(const Reference& reference, const std::string& path) {
  std::ifstream file(path);
  if (!file) throw RunFailure("cannot read " + path);
  Errors errors;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream stream(line);
    double t = 0;
    Numbers row;
    stream >> t;
    for (double& number : row) stream >> number;
    const auto same = [t](double other) { return std::abs(other - t) < 1e-9; };
    const auto at = std::find_if(reference.times.begin(), reference.times.end(), same);
    if (!stream || at == reference.times.end()) continue;
    widen(errors, reference.rows[static_cast<std::size_t>(at - reference.times.begin())], row);
  }
  return errors;
}

/// Points of one contestant, none both slower and less accurate than another, from quick to slow.
std::vector<const Measurement*> envelope(const std::vector<Measurement>& measurements, const std::string& subject,
                                         const std::string& contestant) {
  std::vector<const Measurement*> points;
  for (const Measurement& m : measurements) {
    if (m.subject == subject && m.contestant == contestant && m.failure.empty()) points.push_back(&m);
  }
  std::sort(points.begin(), points.end(), [](auto* a, auto* b) { return a->run_time < b->run_time; });
  std::vector<const Measurement*> best;
  for (const Measurement* m : points) {
    if (best.empty() || m->errors.position < best.back()->errors.position) best.push_back(m);
  }
  return best;
}

}  // namespace

Errors difference(const std::vector<Numbers>& a, const std::vector<Numbers>& b) {
  Errors errors;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) widen(errors, a[k], b[k]);
  return errors;
}

std::vector<double> row_times(double span) {
  constexpr double kRate = 20;  // Hz
  std::vector<double> times;
  for (int k = 0; k <= span * kRate * (1 + 1e-12); ++k) times.push_back(k / kRate);
  return times;
}

Reference make_reference(const Subject& subject, double span, Effort effort) {
  Reference reference;
  reference.times = row_times(span);
  for (const Yardstick& yardstick : yardsticks(effort)) {
    if (reference.rows.empty()) {
      const Run run = yardstick.run(subject.scene, reference.times);
      reference.title = yardstick.title;
      reference.rows = run.rows;
      reference.switches = run.counts.switches;
      continue;
    }
    Reference::Check check;
    check.title = yardstick.title;
    try {
      check.errors = difference(yardstick.run(subject.scene, reference.times).rows, reference.rows);
    } catch (const RunFailure& failure) {
      check.failure = failure.what();
    }
    reference.checks.push_back(check);
  }
  if (!subject.rows.empty()) {
    reference.checks.push_back({"rows of test/data/reference", difference_to_file(reference, subject.rows), ""});
  }
  return reference;
}

Measurement measure(const Subject& subject, const Reference& reference, const Contestant& contestant, double setting,
                    double span) {
  constexpr double kLong = 1.0;  // s; a run that takes longer is not repeated
  constexpr double kEnough = 1.0;
  constexpr int kLeast = 3, kMost = 10;
  const std::vector<double> times = row_times(span);
  Measurement m;
  m.subject = subject.key;
  m.contestant = contestant.key;
  m.setting = setting;
  m.span = times.back();
  m.run_time = std::numeric_limits<double>::infinity();
  double start = processor_time();
  try {
    double total = 0;
    do {
      start = processor_time();
      const Run run = contestant.run(subject.scene, setting, times);
      const double taken = processor_time() - start;
      if (run.rows.size() != times.size()) throw RunFailure("rows are missing");
      total += taken;
      m.run_time = std::min(m.run_time, taken);
      m.counts = run.counts;
      m.errors = difference(run.rows, reference.rows);
      ++m.repeats;
    } while (m.run_time < kLong && (m.repeats < kLeast || (total < kEnough && m.repeats < kMost)));
    if (!(m.errors.position <= 1)) m.failure = "off by more than 1 m";
  } catch (const RunFailure& failure) {
    m.failure = failure.what();
    m.run_time = processor_time() - start;
  }
  return m;
}

Reached time_within(const std::vector<Measurement>& measurements, const std::string& subject,
                    const std::string& contestant, double error) {
  const auto points = envelope(measurements, subject, contestant);
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Measurement& fine = *points[k];
    if (fine.errors.position > error) continue;
    if (k == 0) return {fine.run_time, true};
    const Measurement& coarse = *points[k - 1];
    const double share =
        std::log(error / coarse.errors.position) / std::log(fine.errors.position / coarse.errors.position);
    return {coarse.run_time * std::pow(fine.run_time / coarse.run_time, share), false};
  }
  return {};
}

}  // namespace bench
}  // namespace youbot_base_sim
