#include "youbot_base_sim/record/tipping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "youbot_base_sim/integration/integration.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

namespace {

constexpr double kLookAhead = 60;  // s of simulated time
constexpr int kMaxHalvings = 12;

bool holds(const Scene& scene, double until, const std::atomic<bool>& stop) {
  Simulation simulation(scene);
  simulation.stop_on(stop);
  try {
    simulation.advance_to(until);
  } catch (const std::domain_error&) {  // it tips, or cannot be integrated
    return false;
  }
  return true;
}

/// Rounded down to two digits.
double rounded_down(double number) {
  if (number <= 0) return 0;
  const double unit = std::pow(10, std::floor(std::log10(number)) - 1);
  return std::floor(number / unit * (1 + 1e-12)) * unit;
}

/// The largest number of two digits below `given` for which `holds(number / given)` was seen to be true, where less
/// holds better in the main; negative: not even for 0.
double most_that_holds(double given, const std::function<bool(double)>& holds) {
  if (!holds(0)) return -1;
  double low = 0, high = given;
  for (int halving = 0; halving < kMaxHalvings; ++halving) {
    const double middle = rounded_down(0.5 * (low + high));
    if (middle <= low) break;
    (holds(middle / given) ? low : high) = middle;
  }
  return low;
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

std::string told(double holding, double given, const char* unit, double until) {
  return fmt::format("with {:.4g} in place of {:.4g}{}, it would hold until t = {:g} s", holding, given, unit, until);
}

std::string ballast(const Scene& scene, const Burden& burden) {
  double up = 0;
  for (const Wrench& wrench : burden.wrenches) up += wrench.force.z();
  const double carried = scene.robot.m_s() + mass_of(burden.loads);
  return fmt::format("with {:.3g} kg more it would stay", up / (scene.floor.g * std::cos(scene.floor.slope)) - carried);
}

}  // namespace

std::string what_would_hold(const Scene& scene, const TippedOver& end, const std::atomic<bool>& stop) {
  const double t = end.time(), until = std::min(scene.duration, t + kLookAhead);
  const Burden burden = scene.burdens.at(t);
  if (end.side() == Side::kOff) return ballast(scene, burden);
  const double mass = mass_of(burden.loads);
  const auto most = [&](double given, const auto& change) {
    return most_that_holds(given, [&](double share) {
      Scene other = scene;
      change(other, share);
      return holds(other, until, stop);
    });
  };
  try {
    if (mass > 0) {
      const double holding = most(mass, [t](Scene& other, double share) { keep_of_loads(other, share, t); });
      if (holding == 0) return fmt::format("without its load of {:.4g} kg it would hold until t = {:g} s", mass, until);
      if (holding > 0) return told(holding, mass, " kg", until);
    } else if (scene.robot.a_Z > 0) {
      const double holding = most(scene.robot.a_Z, [](Scene& other, double share) { other.robot.a_Z *= share; });
      if (holding > 0) return "com_height: " + told(holding, scene.robot.a_Z, " m", until);
    }
    if (burden.wrenches.empty()) return "";
    const double holding = most(100, [t](Scene& other, double share) { keep_of_wrenches(other, share, t); });
    return holding > 0 ? told(holding, 100, " % of what pushes it", until) : "";
  } catch (const Stopped&) {
    return "";
  }
}

}  // namespace youbot_base_sim
