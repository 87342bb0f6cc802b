#pragma once

#include <array>
#include <vector>

#include "youbot_base_sim/integration/switching_integrator.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

/// Four wheels that turn independently, ddphi = 2 c_2 + 6 c_3 t + 12 c_4 t^2 -+ pull - damping dphi, the pull being
/// towards the edge between rollers 0 and 1. Without pull and damping phi is a polynomial of degree four in time, which
/// methods of order four integrate exactly and a cubic between two of its points does not hit.
class Wheelwork {
 public:
  using State = youbot_base_sim::State;
  struct Linearization {
    double damping = 0, alpha = 0;
    void factorize(double new_alpha) { alpha = new_alpha; }
    void solve(const State& b, State& u) const {
      u.values = b.values / alpha;
      u.dphi() = b.dphi() / (alpha + damping);
      u.phi() = (b.phi() + u.dphi()) / alpha;
    }
  };

  void operator()(const State& x, State& dxdt, double t) const {
    dxdt.values.setZero();
    dxdt.phi() = x.dphi();
    dxdt.dphi() = 2 * c_2 + 6 * c_3 * t + 12 * c_4 * t * t - damping * x.dphi();
    for (int i = 0; i < kWheels; ++i) dxdt.dphi()[i] += roller_[i] <= 0 ? pull : -pull;
  }
  void linearize(const State&, double t, Linearization& linearization, State& dfdt) const {
    linearization.damping = damping;
    dfdt.values.setZero();
    dfdt.dphi() = 6 * c_3 + 24 * c_4 * t;
  }
  double error_norm(const State&, const State&, const State& error, double relative, double absolute) const {
    return error.values.matrix().norm() / (absolute + relative);
  }
  double lower_edge(int i) const { return geometry.upper_edge(roller_[i] - 1); }
  double upper_edge(int i) const { return geometry.upper_edge(roller_[i]); }
  int roller(int i) const { return roller_[i]; }
  void put(int i, int k) { roller_[i] = k; }

  State start() {
    State x;
    x.phi() = c_0;
    x.dphi() = c_1;
    for (int i = 0; i < kWheels; ++i) put(i, geometry.roller_at(c_0[i]));
    return x;
  }

  Wheels c_0 = Wheels::Zero(), c_1 = Wheels::Zero(), c_2 = Wheels::Zero(), c_3 = Wheels::Zero(), c_4 = Wheels::Zero();
  double pull = 0, damping = 0;
  RollerGeometry geometry{RobotParameters{}};  // n = 6

 private:
  std::array<int, kWheels> roller_{};
};

constexpr int kRollers = 6;
inline int wrapped(int k) { return ((k % kRollers) + kRollers) % kRollers; }

/// Switches of polynomial wheels in [0, duration], by bisection in extended precision.
inline std::vector<RollerSwitch> exact_switches(const Wheelwork& wheels, double duration) {
  std::vector<RollerSwitch> switches;
  for (int i = 0; i < kWheels; ++i) {
    const auto phi = [&](long double t) {
      return wheels.c_0[i] +
             t * (wheels.c_1[i] +
                  t * (wheels.c_2[i] + t * (wheels.c_3[i] + t * static_cast<long double>(wheels.c_4[i]))));
    };
    const int grid = 4000;
    for (int j = 0; j < grid; ++j) {
      const long double start = duration * static_cast<long double>(j) / grid;
      const long double end = duration * static_cast<long double>(j + 1) / grid;
      const long double phi_start = phi(start), phi_end = phi(end);
      for (int k = -40; k < 40; ++k) {
        const double edge = wheels.geometry.upper_edge(k);
        const bool rises = phi_start < edge;
        if (rises == (phi_end < edge)) continue;
        long double low = start, high = end;
        for (int halving = 0; halving < 60; ++halving) {
          const long double middle = (low + high) / 2;
          ((phi(middle) < edge) == rises ? low : high) = middle;
        }
        const int from = rises ? k : k + 1, to = rises ? k + 1 : k;
        switches.push_back({static_cast<double>(low), i, wrapped(from), wrapped(to), edge, rises ? 1 : -1});
      }
    }
  }
  return switches;
}

}  // namespace youbot_base_sim
