#include "stress_measure.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>

#include "youbot_base_sim/physics/inertia.h"
#include "youbot_base_sim/record/summary.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

using Clock = std::chrono::steady_clock;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kSlice = 1e-3;           // s of simulated time
constexpr double kSlicedStretch = 5;      // s at the start and at the end that are simulated in slices
constexpr double kRow = 0.01;             // s of simulated time between two looks at a plain run, at least
constexpr double kMostRows = 4000;        // of a long run
constexpr double kCutAfter = 1.3;         // times the permitted run time: noise must not cut what is just within
constexpr double kLeastPermitted = 0.05;  // s, likewise
constexpr double kLongestRun = 60;        // s of run time, whatever is permitted
constexpr double kLook = 3;               // s of run time
constexpr double kRespite = 20;           // s of one call, before it counts as hung
constexpr double kLeap = 1;               // s of simulated time between the two stretches, likewise

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Run time of this thread, s: that of the processor, so that what else the machine does is not taken for ours.
double run_clock() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Scene load(const std::string& path, double relative_tolerance) {
  SceneOverrides overrides;
  overrides.relative_tolerance = relative_tolerance;
  return load_scene(path, overrides);
}

/// Counters of the integration by the names that the summary gives them: all its whole numbers.
void read_counters(const Simulation& simulation, Measurement& m) {
  const auto summary = nlohmann::json::parse(summary_json(simulation, 1));
  m.counters = 0;
  for (const auto& [name, value] : summary.items()) {
    if (!value.is_number_unsigned() || m.counters == Measurement::kMostCounters) continue;
    Measurement::Counter& counter = m.counter[m.counters++];
    std::snprintf(counter.name, sizeof counter.name, "%s", name.c_str());
    counter.value = value.get<double>();
  }
}

struct Pose {
  double x = kNaN, y = kNaN, psi = kNaN;
};

Pose pose_of(const State& state) { return {state.x(), state.y(), state.psi()}; }

// Between two poses, m: of O, and of the wheels' centres for the turn.
double distance(const RobotParameters& robot, const Pose& a, const Pose& b) {
  return std::hypot(a.x - b.x, a.y - b.y, std::hypot(robot.h, robot.l) * (a.psi - b.psi));
}

/// A run without measurement but of its time: to its end or until `budget` (s of run time) is spent.
class PlainRun {
 public:
  /// Counts its calls of the simulation in `calls`.
  PlainRun(const Scene& scene, std::uint64_t& calls)
      : simulation_(scene), row_(std::max(kRow, scene.duration / kMostRows)), calls_(calls) {}

  /// `look(simulation)` is called at each row, outside of the time that is taken. False if it was cut or the state is
  /// no longer finite.
  template <class Look>
  bool run(double budget, Look&& look) {
    const double duration = simulation_.scene().duration;
    look(simulation_);
    for (int k = 1; simulation_.time() < duration; ++k) {
      const double t = k * row_ < duration * (1 - 1e-12) ? k * row_ : duration;
      const double start = run_clock();
      simulation_.advance_to(t);
      run_time_ += run_clock() - start;
      ++calls_;
      look(simulation_);
      if (!simulation_.state().values.allFinite()) return false;
      if (t >= duration) break;
      if (run_time_ > budget) return false;
    }
    return true;
  }

  const Simulation& simulation() const { return simulation_; }
  double run_time() const { return run_time_; }

 private:
  Simulation simulation_;
  double row_;
  std::uint64_t& calls_;
  double run_time_ = 0;
};

/// What the rows of a plain run add up to.
class Audit {
 public:
  explicit Audit(Measurement& m) : m_(m) { m_.way = m_.energy = m_.energy_error = 0; }

  void operator()(const Simulation& simulation) {
    const State& state = simulation.state();
    const RobotParameters& robot = simulation.scene().robot;
    if (!state.values.allFinite()) {
      m_.finite = false;
      return;
    }
    const double power = (simulation.torque() * state.dphi()).abs().sum();
    if (!first_) {
      base_way_ += distance(robot, pose_of(state), pose_of(last_));
      rolled_ += robot.R * (state.phi() - last_.phi()).abs();
      work_ += 0.5 * (power + last_power_) * (simulation.time() - m_.reached);
    }
    first_ = false;
    last_ = state;
    last_power_ = power;
    m_.reached = simulation.time();
    m_.way = std::max(base_way_, rolled_.maxCoeff());
    greatest_energy_ = std::max(greatest_energy_, kinetic_energy(robot, state));
    m_.energy = std::max(greatest_energy_, work_);
    m_.energy_error = std::max(m_.energy_error, simulation.energy_balance_error());
  }

 private:
  Measurement& m_;
  bool first_ = true;
  State last_;
  double last_power_ = 0;
  double base_way_ = 0;
  Wheels rolled_ = Wheels::Zero();
  double work_ = 0;
  double greatest_energy_ = 0;
};

/// Run times of the simulated milliseconds, s; of a long run those at its start and at its end.
std::vector<float> slice_times(const Scene& scene, double budget, std::uint64_t& calls) {
  std::vector<float> times;
  Simulation simulation(scene);
  double run_time = 0;
  const auto slices = static_cast<long>(std::floor(scene.duration / kSlice + 1e-9));
  const auto stretch = static_cast<long>(kSlicedStretch / kSlice);
  const auto leap = static_cast<long>(kLeap / kSlice);
  for (long k = 1; k <= slices && run_time <= budget; ++k, ++calls) {
    const bool leaps = k > stretch && k + leap <= slices - stretch;
    if (leaps) k += leap - 1;
    const double start = run_clock();
    simulation.advance_to(static_cast<double>(k) * kSlice);
    const double taken = run_clock() - start;
    run_time += taken;
    if (!leaps) times.push_back(static_cast<float>(taken));
    if (!simulation.state().values.allFinite()) break;
  }
  return times;
}

class Probe {
 public:
  Probe(const std::string& path, double relative_tolerance, const BaseCost& base, Measurement& m)
      : path_(path), tolerance_(relative_tolerance), scene_(load(path, relative_tolerance)), base_(base), m_(m) {
    m_.duration = scene_.duration;
  }

  void plain_run() {
    PlainRun run(scene_, m_.calls);
    const bool done = run.run(budget(), Audit(m_));
    m_.run_time = run.run_time();
    const Pose end = pose_of(run.simulation().state());
    m_.x = end.x, m_.y = end.y, m_.psi = end.psi;
    read_counters(run.simulation(), m_);
    m_.ending = done || !m_.finite ? Ending::kFinished : Ending::kCut;
    if (!done || m_.run_time <= permitted()) return;
    PlainRun again(scene_, m_.calls);
    if (again.run(budget(), [](const Simulation&) {})) m_.run_time = std::min(m_.run_time, again.run_time());
  }

  void slices() {
    // Of a run that had to be cut, a look at its worst is enough.
    const double longest = m_.ending == Ending::kCut ? kLook : kLongestRun;
    const double budget =
        std::min(longest, kCutAfter * std::max(kLeastPermitted, kMostTimesBase * base_.sliced * scene_.duration));
    std::vector<float> times = slice_times(scene_, budget, m_.calls);
    if (times.empty()) return;
    const auto late = [&] { return std::count_if(times.begin(), times.end(), [](float s) { return s > kMostSlice; }); };
    if (late() > 0 && m_.ending == Ending::kFinished) {
      const std::vector<float> again = slice_times(scene_, budget, m_.calls);
      times.resize(std::min(times.size(), again.size()));
      for (std::size_t k = 0; k < times.size(); ++k) times[k] = std::min(times[k], again[k]);
    }
    m_.late_slices = static_cast<double>(late());
    std::sort(times.begin(), times.end());
    m_.worst_slice = times.back();
    m_.slice_999 = times[static_cast<std::size_t>(0.999 * static_cast<double>(times.size() - 1))];
  }

  void halving() {
    m_.halving = distance(scene_.robot, end(), end_of(load(path_, tolerance_ / 2)));
    if (m_.halving <= permitted_halving(m_, tolerance_)) return;
    m_.echo = distance(scene_.robot, end(), end_of(apart(scene_, kTinyDistance)));
    const Scene tight = load(path_, std::min(tolerance_, kTightTolerance));
    m_.amplification =
        distance(tight.robot, end_of(tight), end_of(apart(tight, kSmallDistance))) / (tight.robot.R * kSmallDistance);
  }

  void hundredth() {
    const Pose exact = end_of(load(path_, tolerance_ / 100));
    m_.hundredth_distance = std::hypot(exact.x - m_.x, exact.y - m_.y);
    m_.hundredth_heading = std::abs(exact.psi - m_.psi);
    // It was looked for, and did not finish.
    if (std::isnan(m_.hundredth_distance)) m_.hundredth_distance = std::numeric_limits<double>::infinity();
  }

 private:
  static Scene apart(Scene scene, double angle) {
    scene.initial.phi() += angle;
    return scene;
  }

  Pose end() const { return {m_.x, m_.y, m_.psi}; }

  Pose end_of(const Scene& scene) const {
    PlainRun run(scene, m_.calls);
    return run.run(kLongestRun, [](const Simulation&) {}) ? pose_of(run.simulation().state()) : Pose();
  }

  double permitted() const { return std::max(kLeastPermitted, kMostTimesBase * base_.plain * scene_.duration); }
  double budget() const { return std::min(kLongestRun, kCutAfter * permitted()); }

  std::string path_;
  double tolerance_;
  Scene scene_;
  BaseCost base_;
  Measurement& m_;
};

// The ending is set to what holds if the next run does not come back.
void probe(const std::string& path, double relative_tolerance, const BaseCost& base, const Wanted& wanted,
           Measurement& m) {
  const auto fail = [&m](Ending ending, const std::exception& error) {
    m.ending = ending;
    std::snprintf(m.message, sizeof m.message, "%s", error.what());
  };
  try {
    Probe probe(path, relative_tolerance, base, m);
    probe.plain_run();
    if (wanted.slices) probe.slices();
    if (m.ending != Ending::kFinished || !m.finite) return;
    if (wanted.halving) probe.halving();
    if (wanted.hundredth) probe.hundredth();
  } catch (const SceneError& error) {
    fail(Ending::kRefused, error);
  } catch (const std::exception& error) {
    fail(Ending::kFailed, error);
  }
}

/// A measurement in memory that two processes share.
class SharedMeasurement {
 public:
  static_assert(std::is_trivially_copyable_v<Measurement>);

  SharedMeasurement()
      : memory_(mmap(nullptr, sizeof(Measurement), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
    if (memory_ == MAP_FAILED) throw std::runtime_error("no shared memory");
    new (memory_) Measurement;
  }
  ~SharedMeasurement() { munmap(memory_, sizeof(Measurement)); }
  SharedMeasurement(const SharedMeasurement&) = delete;
  SharedMeasurement& operator=(const SharedMeasurement&) = delete;

  Measurement& operator*() { return *static_cast<Measurement*>(memory_); }

 private:
  void* memory_;
};

/// Waits for the process that measures `m` to end, as long as it gets on. True if it has ended of itself.
bool await(pid_t child, int pipe_end, const volatile std::uint64_t& calls, int& status) {
  std::uint64_t last = calls;
  Clock::time_point since = Clock::now();
  // The child holds the other end of the pipe as long as it lives.
  pollfd ended{pipe_end, POLLIN, 0};
  while (poll(&ended, 1, 500) == 0) {
    if (calls != last) {
      last = calls;
      since = Clock::now();
    } else if (seconds_since(since) > kRespite) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      return false;
    }
  }
  waitpid(child, &status, 0);
  return true;
}

}  // namespace

const char* name_of(Ending ending) {
  switch (ending) {
    case Ending::kFinished:
      return "finished";
    case Ending::kRefused:
      return "refused";
    case Ending::kCut:
      return "cut";
    case Ending::kFailed:
      return "failed";
    case Ending::kCrashed:
      return "crashed";
    default:
      return "hung";
  }
}

Measurement::Measurement()
    : run_time(kNaN),
      x(kNaN),
      y(kNaN),
      psi(kNaN),
      way(kNaN),
      energy_error(kNaN),
      energy(kNaN),
      worst_slice(kNaN),
      slice_999(kNaN),
      late_slices(kNaN),
      halving(kNaN),
      echo(kNaN),
      amplification(kNaN),
      hundredth_distance(kNaN),
      hundredth_heading(kNaN) {}

double Measurement::held() const {
  // The one place that knows how an integrator may call it.
  double times = kNaN;
  for (std::size_t k = 0; k < counters; ++k) {
    const std::string name = counter[k].name;
    const auto tells = [&name](const char* word) { return name.find(word) != std::string::npos; };
    if (!(tells("endless") || tells("shared") || tells("held") || tells("sliding"))) continue;
    times = (std::isnan(times) ? 0 : times) + counter[k].value;
  }
  return times;
}

Measurement measure(const std::string& scene_path, double relative_tolerance, const BaseCost& base,
                    const Wanted& wanted) {
  SharedMeasurement shared;
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    close(ends[0]);
    probe(scene_path, relative_tolerance, base, wanted, *shared);
    _exit(0);
  }
  close(ends[1]);
  int status = 0;
  const bool gone = await(child, ends[0], (*shared).calls, status);
  close(ends[0]);
  Measurement m = *shared;
  if (!gone) m.ending = Ending::kHung;
  if (gone && WIFSIGNALED(status)) m.ending = Ending::kCrashed;
  return m;
}

BaseCost measure_base(const std::string& scene_path, double relative_tolerance, int repeats) {
  const Scene scene = load(scene_path, relative_tolerance);
  std::uint64_t calls = 0;
  BaseCost least{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for (int k = 0; k < repeats; ++k) {
    PlainRun run(scene, calls);
    if (!run.run(kLongestRun, [](const Simulation&) {})) throw std::runtime_error("the base scene does not finish");
    least.plain = std::min(least.plain, run.run_time() / scene.duration);
  }
  const std::vector<float> times = slice_times(scene, kLongestRun, calls);
  double sliced = 0;
  for (const float time : times) sliced += time;
  least.sliced = sliced / (kSlice * static_cast<double>(times.size()));
  return least;
}

}  // namespace youbot_base_sim
