#include "youbot_base_sim/integration/methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "youbot_base_sim/integration/no_slip_integrator.h"
#include "youbot_base_sim/physics/roller_geometry.h"

namespace youbot_base_sim {

class PaperFeatures;
class ExtendedFeatures;

// In make_slip_integrator.h
template <class Features>
std::unique_ptr<MotionIntegrator> make_slip_integrator(const MotionStart& motion);

std::vector<std::string> method_names() {
  std::vector<std::string> names;
  for (const Method& method : methods()) names.push_back(method.name);
  return names;
}

double effective_regularization_speed(double nu, double spin_radius, const Tolerance& tolerance) {
  constexpr double kShare = 0.3;    // of an error of the relative tolerance at 1 m/s
  constexpr double kMax = 1e-5;     // m/s: a larger one would show at any tolerance
  constexpr double kRadius = 0.05;  // m: contacts of a smaller radius rotate on the spot too fast
  const double spin = spin_radius > 0 ? std::min(1.0, spin_radius / kRadius) : 1;
  return std::max(nu, spin * std::min(kMax, kShare * tolerance.relative));
}

std::string advice(const RobotParameters& robot, const FloorParameters& floor, Model model,
                   const IntegrationSettings& settings, double duration) {
  const Method& method = *find_method(settings.method);
  if (!method.is_explicit || !slips(model)) return "";
  constexpr double kStability = 3, kTimePerStep = 0.6e-6;  // s, at 3 GHz
  const double nu = effective_regularization_speed(floor.nu, floor.spin_radius, settings.tolerance());
  const double damping = visit_law(model, [&](auto law) {
    using Law = typename decltype(law)::Law;
    const ContactVector<2> no_slip = {{Wheels::Zero(), Wheels::Zero()}};
    const Wheels limit = floor.f * normal_reactions(robot, floor);
    return ContactFriction<Law, 2>(Law(robot, floor), nu).stiffness(no_slip, limit)(0, 0).maxCoeff();
  });
  const ContactGeometry mean = RollerGeometry(robot).mean();
  const double rate = damping * (mean.r_X.square() + mean.r_Y.square()).maxCoeff() / robot.J_2;
  if (!(rate > 0)) return "";
  const double stable = kStability / rate;
  return fmt::format(
      "{} is explicit: while wheels roll its steps are at most about {:.1g} s long, {:.1g} of them for {:g} s of "
      "motion, "
      "which take about {:.1g} s; radau is the method for this",
      method.name, stable, duration / stable, duration, duration / stable * kTimePerStep);
}

std::string refusal(const Method& method, const RobotParameters& robot, Model model) {
  if (!slips(model) || method.name == "radau" || robot.J_2 > 0) return "";
  return "one that integrates rollers without inertia, which only radau does: robot.roller_inertia is 0";
}

std::unique_ptr<MotionIntegrator> make_integrator(const MotionStart& motion) {
  if (!slips(motion.model)) return std::make_unique<NoSlipIntegrator>(motion);
  const std::string& method = motion.settings.method;
  if (!find_method(method)) throw std::invalid_argument(method + ": no method of integration");
  return motion.extended ? make_slip_integrator<ExtendedFeatures>(motion) : make_slip_integrator<PaperFeatures>(motion);
}

}  // namespace youbot_base_sim
