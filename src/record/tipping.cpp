#include "youbot_base_sim/record/tipping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "youbot_base_sim/integration/integration.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kLookAhead = 60;      // s of simulated time
constexpr double kMaxUnchecked = 0.1;  // s of simulated time from one look at the work done to the next
constexpr int kMaxHalvings = 12;
constexpr char kGivenUp[] = "the search took too long and was given up";

/// Thrown out of a search that has done all the work it may.
struct GivenUp {};

/// Runs of other scenes than the one that tipped.
class Search {
 public:
  Search(double until, std::uint64_t max_evaluations, const std::atomic<bool>& stop)
      : until_(until), max_evaluations_(max_evaluations), stop_(stop) {}

  /// Whether the base of `scene` stays on the floor. From row to row, as the run itself: the verdict depends on where
  /// steps end. Throws GivenUp or Stopped.
  bool holds(const Scene& scene) {
    Simulation simulation(scene);
    simulation.stop_on(stop_);
    const double stride = std::min(1 / scene.output_rate, kMaxUnchecked);
    bool holds = true;
    try {
      std::int64_t rows = 0;
      for (double t = 0; t < until_;) {
        t = std::min(static_cast<double>(++rows) * stride, until_);
        simulation.advance_to(t);
        if (evaluations_ + simulation.statistics().evaluations > max_evaluations_) throw GivenUp();
      }
    } catch (const std::domain_error&) {  // it tips, or cannot be integrated
      holds = false;
    }
    evaluations_ += simulation.statistics().evaluations;
    return holds;
  }

 private:
  const double until_;  // s
  const std::uint64_t max_evaluations_;
  const std::atomic<bool>& stop_;
  std::uint64_t evaluations_ = 0;  // so far
};

/// Rounded down to two digits.
double rounded_down(double number) {
  if (number <= 0) return 0;
  const double unit = std::pow(10, std::floor(std::log10(number)) - 1);
  return std::floor(number / unit * (1 + 1e-12)) * unit;
}

/// What a search has found.
struct Found {
  double most = -1;      // that holds; negative: nothing does
  bool complete = true;  // false: given up
};

/// The largest number of two digits below `given` for which `holds(number / given)` was seen to be true, where less
/// holds better in the main.
Found most_that_holds(double given, const std::function<bool(double)>& holds) {
  Found found;
  try {
    if (!holds(0)) return found;
    found.most = 0;
    double high = given;
    for (int halving = 0; halving < kMaxHalvings; ++halving) {
      const double middle = rounded_down(0.5 * (found.most + high));
      if (middle <= found.most) break;
      (holds(middle / given) ? found.most : high) = middle;
    }
  } catch (const GivenUp&) {
    found.complete = false;
  }
  return found;
}

/// Leaves this share of the mass of each load that is carried at time t, s.
void keep_of_loads(Scene& scene, double share, double t) {
  auto& loads = scene.burdens.loads;
  const auto gone = [&](const auto& planned) { return planned.contains(t) && share == 0; };
  loads.erase(std::remove_if(loads.begin(), loads.end(), gone), loads.end());
  for (auto& planned : loads) {
    if (!planned.contains(t)) continue;
    planned.load.mass *= share;
    planned.load.inertia *= share;
  }
}

/// Leaves this share of each wrench that acts at time t, s.
void keep_of_wrenches(Scene& scene, double share, double t) {
  for (auto& planned : scene.burdens.wrenches) {
    if (!planned.contains(t)) continue;
    planned.wrench.force *= share;
    planned.wrench.torque *= share;
  }
}

double mass_of(const std::vector<Load>& loads) {
  double mass = 0;
  for (const Load& load : loads) mass += load.mass;
  return mass;
}

/// In words, where `given` (in `unit`) tipped and the motion was looked at until then, s; empty if nothing holds.
std::string told(const Found& found, double given, const char* unit, double until) {
  if (found.most < 0) return found.complete ? "" : fmt::format("what would hold is not known: {}", kGivenUp);
  const std::string holding =
      fmt::format("with {:.4g} in place of {:.4g}{}, it would hold until t = {:g} s", found.most, given, unit, until);
  return found.complete ? holding : fmt::format("{}, perhaps with more: {}", holding, kGivenUp);
}

std::string ballast(const Scene& scene, const Burden& burden) {
  double up = 0;
  for (const Wrench& wrench : burden.wrenches) up += wrench.force.z();
  const double carried = scene.robot.m_s() + mass_of(burden.loads);
  return fmt::format("with {:.3g} kg more it would stay", up / (scene.floor.g * std::cos(scene.floor.slope)) - carried);
}

}  // namespace

std::string what_would_hold(const Scene& scene, const TippedOver& end, std::uint64_t max_evaluations,
                            const std::atomic<bool>& stop) {
  const double t = end.time(), until = std::min(scene.duration, t + kLookAhead);
  const Burden burden = scene.burdens.at(t);
  if (end.side() == Side::kOff) return ballast(scene, burden);
  const double mass = mass_of(burden.loads), height = scene.robot.a_Z;
  Search search(until, max_evaluations, stop);
  const auto most = [&](double given, const auto& change) {
    return most_that_holds(given, [&](double share) {
      Scene other = scene;
      change(other, share);
      return search.holds(other);
    });
  };
  try {
    std::string remedy;
    if (mass > 0) {
      remedy =
          told(most(mass, [t](Scene& other, double share) { keep_of_loads(other, share, t); }), mass, " kg", until);
    } else if (height > 0) {
      remedy = told(most(height, [](Scene& other, double share) { other.robot.a_Z *= share; }), height, " m", until);
      if (!remedy.empty()) remedy = "com_height: " + remedy;
    }
    if (!remedy.empty() || burden.wrenches.empty()) return remedy;
    return told(most(100, [t](Scene& other, double share) { keep_of_wrenches(other, share, t); }), 100,
                " % of what pushes it", until);
  } catch (const Stopped&) {
    return "";
  }
}

}  // namespace youbot_base_sim
