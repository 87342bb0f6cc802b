#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "youbot_base_sim/offline/rows.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

// Numbers that Python may give, beside those of scenes.
inline constexpr Range kTorques{-3e6, 3e6, "N m"};
inline constexpr Range kRates{-1e6, 1e6, "rad/s"};

/// A simulation that is audited from call to call. Once an error has ended its motion, only `reset` is left: all else
/// throws std::runtime_error.
class Motion {
 public:
  explicit Motion(
      const Scene& scene, std::function<void()> at_look = [] {});

  Simulation& simulation();  ///< to be changed; throws if the motion has ended
  const Simulation& now() const { return simulation_; }

  void advance_to(double t);
  void step(int periods);
  /// The numbers of all rows from t = 0 to the scene's duration. Throws std::logic_error without a drive or at t > 0.
  std::vector<double> run();
  void reset();
  /// Why the motion so far may be unreliable, in one line; empty if it is reliable.
  std::string doubt() const;

 private:
  template <class Work>
  void guarded(const Work& work);

  Simulation simulation_;
  std::function<void()> at_look_;
  std::optional<RowLoop> rows_;  // emplaced anew by reset: it refers to the simulation
  std::string ended_;            // why; empty: it has not
};

/// Runs Python's signal handlers where the GIL was released, every 50 ms, so that Ctrl-C ends a long call. Throws what
/// they raise, on the main thread alone.
class SignalWatch {
 public:
  void operator()();

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

// Checks of what Python gives, which throw pybind11::value_error.
void check_time(double t, double now);
void check_periods(const Scene& scene, int periods);
DriveMode drive_mode(const Scene& scene, const std::string& mode);

}  // namespace youbot_base_sim
