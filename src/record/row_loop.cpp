#include "youbot_base_sim/record/row_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace youbot_base_sim {

namespace {
constexpr double kMaxUnseen = 0.1;  // s
}

bool RowLoop::next() {
  const Scene& scene = simulation_.scene();
  if (rows_ > 0) {
    if (t_ >= scene.duration) return false;
    // The last multiple of 1 / output_rate may be the end but for rounding.
    t_ = static_cast<double>(rows_) / scene.output_rate;
    if (t_ >= scene.duration * (1 - 1e-12)) t_ = scene.duration;
    audit_until(t_);
    simulation_.advance_to(t_);
    if (!simulation_.state().values.allFinite()) {
      throw std::runtime_error(fmt::format("the state is no longer finite at t = {} s", t_));
    }
  }
  energy_.add_row(simulation_);
  ++rows_;
  return true;
}

// Where rows are far apart, the energy is looked at in between: every kMaxUnseen, where a control period ends.
void RowLoop::audit_until(double t) {
  if (t - simulation_.time() <= kMaxUnseen) return;
  const double period = simulation_.scene().solver.control_period;
  const double interval = period > 0 ? period * std::max(1.0, std::floor(kMaxUnseen / period)) : kMaxUnseen;
  for (double k = std::floor(simulation_.time() / interval * (1 + 1e-9)) + 1; k * interval < t * (1 - 1e-9); ++k) {
    simulation_.advance_to(k * interval);
    energy_.add_row(simulation_);
  }
}

}  // namespace youbot_base_sim
