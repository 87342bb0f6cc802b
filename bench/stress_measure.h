#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace youbot_base_sim {

/// What a run of Case 1 costs at one tolerance: the yardstick of all others at this tolerance.
struct BaseCost {
  double plain = 0;   ///< s of run time a simulated second
  double sliced = 0;  ///< the same where it is stopped every millisecond
};

/// How a cell at one tolerance ended.
enum class Ending {
  kFinished,
  kRefused,  ///< the scene was not accepted
  kCut,      ///< took longer than its budget
  kFailed,   ///< threw an exception
  kCrashed,  ///< ended by a signal
  kHung      ///< came back from no call within its last respite
};
const char* name_of(Ending ending);

/// What is measured of a cell at one tolerance. Plain data: it comes from another process. Not a number where it was
/// not measured.
struct Measurement {
  static constexpr std::size_t kMostCounters = 24;
  struct Counter {
    char name[32];
    double value;
  };

  Measurement();

  Ending ending = Ending::kHung;
  char message[256] = "";  ///< of the refusal or failure
  double duration = 0;     ///< to be simulated, s
  double reached = 0;      ///< simulated, s
  bool finite = true;      ///< the state stayed so

  double run_time;      ///< s, of the plain run
  double x, y, psi;     ///< end pose: m, rad
  double way;           ///< the longer of the base's way and the longest that a wheel rolled, m
  double energy_error;  ///< largest energy_balance_error, J
  double energy;        ///< the larger of the greatest kinetic energy and the work exchanged by the drives, J

  double worst_slice;  ///< run time of the slowest simulated millisecond, s
  double slice_999;    ///< its 99.9 percentile, s
  double late_slices;  ///< milliseconds that took longer

  double halving;        ///< how far the end pose moves with half the tolerance, m
  double echo;           ///< how far it moves with a start `kTinyDistance` apart, m; only if the halving moves it far
  double amplification;  ///< likewise with one `kSmallDistance` apart at a tight tolerance, over R times that
  double hundredth_distance;  ///< how far the end position moves with a hundredth of the tolerance, m
  double hundredth_heading;   ///< likewise the heading, rad

  std::uint64_t calls = 0;  ///< of the simulation, all runs together: it is alive
  std::size_t counters = 0;
  Counter counter[kMostCounters];  ///< of the integration, whatever its summary tells

  /// Times that a wheel was held between two rollers; not a number if no counter tells.
  double held() const;
};

/// Which of the runs of a cell are wanted besides the plain one.
struct Wanted {
  bool slices = true;
  bool halving = true;
  bool hundredth = false;
};

/// Measures the scene of a file, in a process of its own: what crashes or hangs there harms nobody.
Measurement measure(const std::string& scene_path, double relative_tolerance, const BaseCost& base,
                    const Wanted& wanted);

/// The cost of the yardstick, in this process; the least of `repeats` runs. Throws if it cannot be run.
BaseCost measure_base(const std::string& scene_path, double relative_tolerance, int repeats);

/// Bounds that the suite asks for.
constexpr double kMostTimesBase = 20;     ///< run time over that of the base scene
constexpr double kMostSlice = 1e-3;       ///< s of run time for 1 ms
constexpr double kTinyDistance = 1e-12;   ///< rad, of all wheel angles: shows what a rounding error may come to
constexpr double kSmallDistance = 1e-6;   ///< rad: far above the tight tolerance, so that the motion decides
constexpr double kTightTolerance = 1e-9;  ///< for the amplification, which is the motion's and not the integrator's
/// Where relative and absolute tolerance meet: absolute / relative, in SI units. A way, a speed below it counts as it.
constexpr double kSmallest = 1e-3;

/// How far the end pose may move with half the tolerance, m, if the motion does not amplify.
inline double permitted_halving(const Measurement& m, double tolerance) { return tolerance * (m.way + kSmallest); }

}  // namespace youbot_base_sim
