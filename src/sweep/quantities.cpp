#include "youbot_base_sim/sweep/quantities.h"

#include <algorithm>
#include <cmath>

namespace youbot_base_sim {

namespace {

const State& state(const Observer& run) { return run.simulation().state(); }

}  // namespace

Observer::Observer(const Simulation& simulation)
    : simulation_(simulation),
      sensors_(simulation.scene().motors, simulation.state().phi()),
      odometry_(DriverKinematics(),
                sensors_.read(simulation.state().phi(), simulation.state().dphi(), simulation.torque()).phi) {}

void Observer::add_row() {
  path_.add_row(simulation_);
  const ContactDetails contacts = simulation_.contacts();
  square_of_slip_ = std::max(square_of_slip_, (contacts.V_PX.square() + contacts.V_PY.square()).maxCoeff());
  const State& x = simulation_.state();
  odometry_.update(sensors_.read(x.phi(), x.dphi(), simulation_.torque()).phi);
}

Eigen::Vector3d Observer::odometry() const {
  const State& start = simulation_.scene().initial;
  const Eigen::Vector3d& pose = odometry_.pose();
  const double c = std::cos(start.psi()), s = std::sin(start.psi());
  return {start.x() + c * pose[0] - s * pose[1], start.y() + s * pose[0] + c * pose[1], start.psi() + pose[2]};
}

const std::vector<Quantity>& quantities() {
  using O = Observer;
  using E = EnergyAudit;
  static const std::vector<Quantity> table = {
      {"x", "m, at the end", [](const O& run, const E&) { return state(run).x(); }},
      {"y", "m, at the end", [](const O& run, const E&) { return state(run).y(); }},
      {"psi", "heading at the end, rad, unwrapped", [](const O& run, const E&) { return state(run).psi(); }},
      {"V_X", "ahead at the end, m/s", [](const O& run, const E&) { return state(run).V_X(); }},
      {"V_Y", "to the left at the end, m/s", [](const O& run, const E&) { return state(run).V_Y(); }},
      {"Omega", "turning at the end, rad/s", [](const O& run, const E&) { return state(run).Omega(); }},
      {"path_length", "of the base over the rows, m; a turn counts at the wheels' centres",
       [](const O& run, const E&) { return run.path().base(); }},
      {"odometry_error", "distance of the odometry's position from the true one at the end, m",
       [](const O& run, const E&) {
         const Eigen::Vector3d pose = run.odometry();
         return std::hypot(pose[0] - state(run).x(), pose[1] - state(run).y());
       }},
      {"odometry_heading_error", "odometry's heading minus the true one at the end, rad",
       [](const O& run, const E&) { return run.odometry()[2] - state(run).psi(); }},
      {"largest_slip", "of the four wheels over the rows, m/s",
       [](const O& run, const E&) { return run.largest_slip(); }},
      {"kinetic_energy", "at the end, J", [](const O& run, const E&) { return run.simulation().kinetic_energy(); }},
      {"drive_work", "energy that drives and wheels exchanged in either direction, J",
       [](const O&, const E& energy) { return energy.drive_work(); }},
      {"energy_balance_error", "the largest over the rows, J",
       [](const O&, const E& energy) { return energy.max_balance_error(); }},
      {"switches", "of rollers",
       [](const O& run, const E&) { return static_cast<double>(run.simulation().statistics().switches); }}};
  return table;
}

}  // namespace youbot_base_sim
