#pragma once

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/radau.h"
#include "youbot_base_sim/integration/slip_integrator.h"
#include "youbot_base_sim/physics/slip_model.h"

namespace youbot_base_sim {

// Evaluations for a millisecond of motion, which may take up to 80 % more. Where Radau must keep up with real time,
// they take about 0.8 ms at 3 GHz. Elsewhere they suffice for wheels that chatter, at tolerances down to 1e-10. The
// other methods are for comparison; their bound only makes sure that a run ends.
template <class Model>
inline constexpr std::uint64_t kRealTime = Model::kReactionsFollow ? 2000 : 3000;
inline constexpr std::uint64_t kOffline = 30;  // times that
inline constexpr std::uint64_t kComparison = 10000000;

/// Makes the integrator of a model that slips with PaperFeatures or ExtendedFeatures. Each is instantiated in a file
/// of its own, because it takes long to compile.
template <class Features>
std::unique_ptr<MotionIntegrator> make_slip_integrator(const MotionStart& motion) {
  return visit_law(motion.model, [&](auto law) -> std::unique_ptr<MotionIntegrator> {
    using Law = typename decltype(law)::Law;
    using Equations = SlipModel<Law, Features>;
    const Method& method = *find_method(motion.settings.method);
    const Tolerance tolerance = motion.settings.tolerance();
    FloorParameters floor = motion.floor;
    if (method.is_explicit) floor.holding_speed = 0;  // its steps would be that much shorter
    if (Law::kLimited) {                              // the viscous law's mu_0 depends on nu, whatever the tolerance
      floor.nu = effective_regularization_speed(floor.nu, floor.spin_radius, tolerance);
    }
    const auto make_method = [&](IntegrationStatistics& statistics) -> std::unique_ptr<SmoothStepper> {
      if (method.make) return method.make(tolerance, statistics);
      return std::make_unique<Radau<Equations>>(tolerance, statistics);
    };
    const std::uint64_t max_evaluations = method.make                ? kComparison
                                          : motion.settings.keeps_up ? kRealTime<Equations>
                                                                     : kOffline * kRealTime<Equations>;
    const Equations equations(motion.robot, floor, {}, motion.torque.prescribes_wheels());
    return std::make_unique<SlipIntegrator<Equations>>(equations, motion.torque, motion.start, tolerance,
                                                       max_evaluations, make_method, motion.before);
  });
}

}  // namespace youbot_base_sim
