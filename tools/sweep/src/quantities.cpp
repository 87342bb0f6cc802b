#include "youbot_base_sim/sweep/quantities.h"

#include <algorithm>

namespace youbot_base_sim {

ObservedRun::ObservedRun(Simulation& simulation)
    : simulation_(simulation), rows_(simulation), sensors_(BaseSensors::of(simulation.scene())) {}

bool ObservedRun::next() {
  if (!rows_.next()) return false;
  const ContactDetails contacts = simulation_.contacts();
  square_of_slip_ = std::max(square_of_slip_, (contacts.V_PX.square() + contacts.V_PY.square()).maxCoeff());
  sensors_.update(rows_.t(), state(), Wheels::Zero());  // encoders know no torque
  return true;
}

Eigen::Vector3d ObservedRun::odometry() const {
  const State& start = simulation_.scene().initial;
  const Eigen::Vector3d& pose = sensors_.odometry().pose();
  const auto [s, c] = sine_and_cosine(start.psi());
  return {start.x() + c * pose[0] - s * pose[1], start.y() + s * pose[0] + c * pose[1], start.psi() + pose[2]};
}

const std::vector<Quantity>& quantities() {
  using Run = ObservedRun;
  static const std::vector<Quantity> table = {
      {"x", "m, at the end", [](const Run& run) { return run.state().x(); }},
      {"y", "m, at the end", [](const Run& run) { return run.state().y(); }},
      {"psi", "heading at the end, rad, unwrapped", [](const Run& run) { return run.state().psi(); }},
      {"V_X", "forward velocity at the end, m/s", [](const Run& run) { return run.state().V_X(); }},
      {"V_Y", "lateral velocity at the end, m/s, to the left", [](const Run& run) { return run.state().V_Y(); }},
      {"Omega", "yaw rate at the end, rad/s", [](const Run& run) { return run.state().Omega(); }},
      {"path_length", "of the base over the rows, m; a turn counts at the wheels' centres",
       [](const Run& run) { return run.rows().path().base; }},
      {"odometry_error", "distance of the odometry's position from the true one at the end, m",
       [](const Run& run) {
         const Eigen::Vector3d pose = run.odometry();
         const double dx = pose[0] - run.state().x(), dy = pose[1] - run.state().y();
         return std::sqrt(dx * dx + dy * dy);
       }},
      {"odometry_heading_error", "odometry's heading minus the true one at the end, rad",
       [](const Run& run) { return run.odometry()[2] - run.state().psi(); }},
      {"largest_slip", "of the four wheels over the rows, m/s", [](const Run& run) { return run.largest_slip(); }},
      {"kinetic_energy", "at the end, J", [](const Run& run) { return run.simulation().kinetic_energy(); }},
      {"drive_work", "energy that drives and wheels exchanged in either direction, J",
       [](const Run& run) { return run.rows().energy().drive_work; }},
      {"energy_balance_error", "the largest over the rows, J",
       [](const Run& run) { return run.rows().energy().max_balance_error; }},
      {"switches", "of rollers",
       [](const Run& run) { return static_cast<double>(run.simulation().statistics().switches); }}};
  return table;
}

}  // namespace youbot_base_sim
