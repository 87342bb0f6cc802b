#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "youbot_base_sim/integration/radau_options.h"

namespace youbot_base_sim {

/// Step size control by the errors of the last two steps (Gustafsson's predictive controller; Hairer and Wanner,
/// section IV.8), for an error estimate of order 3.
class StepSizeController {
 public:
  /// Next length after a step of length dt with the given norm of its error; the step stands if the norm is <= 1.
  double next(double dt, double norm) {
    if (!(norm <= std::numeric_limits<double>::max())) {  // NaN too
      rejected_ = true;
      return dt * radau_options.max_shrinkage;
    }
    double factor = radau_options.safety / fourth_root(std::max(norm, kMinError));
    if (norm > 1) {
      rejected_ = true;
      return dt * std::max(factor, radau_options.max_shrinkage);
    }
    if (last_dt_ > 0 && radau_options.trend) {
      const double trend = radau_options.safety * (dt / last_dt_) * fourth_root(last_norm_ / (norm * norm + kMinError));
      factor = std::min(factor, trend);
    }
    factor = std::min(std::max(factor, radau_options.max_shrinkage), rejected_ ? 1.0 : radau_options.max_growth);
    last_dt_ = dt;
    last_norm_ = std::max(norm, 0.01);
    rejected_ = false;
    return dt * factor;
  }

  /// Forgets the last step: the right-hand side jumps here.
  void restart() { last_dt_ = 0; }

 private:
  static double fourth_root(double a) { return std::sqrt(std::sqrt(a)); }

  static constexpr double kMinError = 1e-10;

  double last_dt_ = 0;
  double last_norm_ = 1;
  bool rejected_ = false;
};

}  // namespace youbot_base_sim
