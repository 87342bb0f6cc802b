#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "arrays.h"
#include "motion.h"

namespace py = pybind11;
using namespace py::literals;

namespace youbot_base_sim {

namespace {

/// The class Simulation of Python. ValueError leaves it as it was; RuntimeError: the motion has ended.
class PythonSimulation {
 public:
  PythonSimulation(const py::object& scene, const py::object& settings)
      : source_(scene, settings), motion_(source_.load(true), SignalWatch()) {}

  /// Throws while another thread advances it.
  Motion& motion() {
    if (busy_) throw std::runtime_error("another thread advances this simulation; each thread needs its own");
    return motion_;
  }
  const Simulation& now() { return motion().now(); }

  void step(const py::object& torque, int periods) {
    check_periods(now().scene(), periods);
    if (!torque.is_none()) set_torque(torque);
    without_gil([&] { motion_.step(periods); });
  }

  void advance(double t) {
    check_time(t, now().time());
    without_gil([&] { motion_.advance_to(t); });
  }

  py::array run() {
    std::vector<double> numbers;
    without_gil([&] { numbers = motion_.run(); });
    return rows_of(std::move(numbers));
  }

  void set_torque(const py::object& torque) { motion().simulation().set_torque(wheels("torque", torque, kTorques)); }

  void set_points(const std::string& mode, const py::object& values) {
    const DriveMode drive = drive_mode(now().scene(), mode);
    const Range& range = drive == DriveMode::kVelocity ? kRates : kTorques;
    motion().simulation().set_points(drive, wheels("values", values, range));
  }

  void set_wrench(const py::object& force, double torque, const py::object& point, bool fixed) {
    if (!contains(kWrenchTorques, torque))
      throw py::value_error(fmt::format("torque = {}: must be {}", torque, text_of(kWrenchTorques)));
    const Wrench wrench{vector("force", force, kWrenchForces), vector("point", point, kLoadPositions), torque, fixed};
    apply({applied_.loads, {wrench}}, false);
  }

  /// The scene's reader checks the loads as its own; without the drive, which may be a long table.
  void set_loads(const py::list& loads, bool keep_momentum) {
    AppliedLoads wanted{{}, applied_.wrenches};
    if (!loads.empty()) {
      SceneSettings settings = source_.settings;
      settings.emplace_back("drive", "{torque: [{start: 0}]}");
      settings.push_back(scene_setting("loads", loads));
      for (const auto& planned : load_scene(source_.file, settings, SceneUse::kRun, false).load_schedule.loads) {
        if (planned.start != 0 || std::isfinite(planned.end) || planned.at_rest)
          throw py::value_error("loads: start, end and placed must be left out: these act from now on");
        wanted.loads.push_back(planned.load);
      }
    }
    const std::string lifted = lifted_wheel(now().scene(), wanted.loads, now().time());
    if (!lifted.empty()) throw py::value_error("loads must be " + lifted);
    apply(wanted, keep_momentum);
  }

  void set_state(const py::object& pose, const py::object& velocity, const py::object& wheel_angles) {
    const Eigen::Vector3d place = vector("pose", pose, kPoses), twist = vector("velocity", velocity, kSpeeds);
    std::optional<Wheels> phi;
    if (!wheel_angles.is_none()) phi = wheels("wheel_angles", wheel_angles, kWheelAngles);
    motion().simulation().set_state(place, twist, phi);
    motion_.simulation().take_state_changes();
  }

  void reset() {
    motion().reset();
    applied_ = {};
  }

  py::dict statistics() {
    py::dict all;
    for (const StatisticsField& field : kStatisticsFields) all[field.name] = now().statistics().*field.value;
    return all;
  }

 private:
  void apply(const AppliedLoads& applied, bool keep_momentum) {
    motion().simulation().set_loads(applied, keep_momentum);
    motion_.simulation().take_load_changes();
    applied_ = applied;
  }

  template <class Work>
  void without_gil(const Work& work) {
    motion();
    const std::unique_ptr<bool, void (*)(bool*)> busy(&(busy_ = true), [](bool* flag) { *flag = false; });
    const py::gil_scoped_release release;
    work();
  }

  SceneSource source_;
  Motion motion_;
  bool busy_ = false;  // guarded by the GIL
  AppliedLoads applied_;
};

constexpr char kClass[] = R"(One running simulation: commands in; state, contacts and switches out. SI units.

scene: a file's path, YAML text, or a dict with a scene's keys (docs/scenes.md). settings: values in place of the
scene's, such as {"floor.friction": 0.3}. ValueError with the line of simulate for what it would refuse.

The equations of motion (docs/model.md) with wheel torques M and friction forces F at the contacts:

    m_s (dV_X - Omega V_Y) - m (a_Y dOmega + a_X Omega^2) = sum F_X
    m_s (dV_Y + Omega V_X) + m (a_X dOmega - a_Y Omega^2) = sum F_Y
    I_s dOmega + m a_X (dV_Y + Omega V_X) - m a_Y (dV_X - Omega V_Y) = sum [F_Y rho_X - F_X (rho_Y + Delta_Y)]
    J_1 ddphi   = M - mu_1 dphi - R F_X
    J_2 ddgamma = -mu_2 dgamma - r sin(delta) F_X + r cos(phi~) cos(delta) F_Y

Wheels are in the order fl, fr, bl, br. The scene's drive acts until a torque or set points are commanded. A simulation
is used in one thread at a time; calls that advance it release the GIL, and Ctrl-C leaves it at the time it has reached.)";

constexpr char kRun[] =
    R"(Advances from t = 0 to the scene's duration by its drive. Returns the rows of simulate --csv, a structured array:
t (s), x, y (m), psi (rad), V_X, V_Y (m/s), Omega (rad/s), and of each wheel phi_fl (rad), dphi_fl, dgamma_fl (rad/s)
and so on. pandas.DataFrame takes it as it is.)";

constexpr char kState[] =
    R"(The present state, a read-only view that follows the simulation. x, y (m), psi (rad, unwrapped): pose in the fixed
frame; V_X, V_Y (m/s), Omega (rad/s): velocity in the platform's frame; phi (rad), dphi, dgamma (rad/s), gamma (rad):
(4,) of the wheels and their rollers in contact; work (J): of all torques and friction. state["x"] is a number,
state["phi"] a view; copy() keeps the present state.)";

constexpr char kContacts[] =
    R"((4,) contacts of the wheels now, in the platform's frame: slip V_PX, V_PY (m/s); friction on the base F_X, F_Y (N),
F = -f N V_P / sqrt(nu^2 + V_P^2) in model coulomb; normal reaction N (N); coefficient f; offset Delta_Y of the contact
point along the axle (m); spin friction M_S (N m); roller, 0 to n - 1, and other_roller where a wheel rests on two, or -1.)";

}  // namespace

void bind_simulation(py::module_& module) {
  using S = PythonSimulation;
  const auto state = [](const py::object& self) -> py::object {
    return states_view(self.cast<S&>().now().state().begin(), {}, self)[py::tuple()];
  };
  const auto state_vector = [](const py::object& self) {
    const double* numbers = self.cast<S&>().now().state().begin();
    return read_only(py::array(py::dtype::of<double>(), {State::kSize}, {}, numbers, self));
  };
  const auto torque = [](S& s) { return py::array_t<double>(kWheels, s.now().torque().data()); };
  const auto switches = [](S& s) { return switches_of(s.motion().simulation().take_switches()); };
  const auto contacts = [](S& s) -> py::object { return contacts_of({&s.now()})[py::int_(0)]; };
  py::class_<S>(module, "Simulation", kClass)
      .def(py::init<py::object, py::object>(), "scene"_a, "settings"_a = py::none())
      .def("step", &S::step, "torque"_a = py::none(), "periods"_a = 1,
           "Sets the torque, (4,) N m, if given; advances by control periods of the scene's solver.control_period, s.")
      .def("advance", &S::advance, "t"_a, "Advances to time t, s, now or later.")
      .def("run", &S::run, kRun)
      .def_property("torque", torque, &S::set_torque,
                    "(4,) N m: the torque M that acts now. A set one acts exactly, until it is set anew.")
      .def("set_points", &S::set_points, "mode"_a, "values"_a,
           "Set points of the scene's motors from the next control period on: mode torque, with (4,) values in N m; "
           "velocity, with wheel rates in rad/s for the motors' PI loops; or off.")
      .def("set_wrench", &S::set_wrench, "force"_a, "torque"_a = 0.0, "point"_a = py::make_tuple(0, 0, 0),
           "fixed"_a = false,
           "A wrench in place of the last, besides the scene's: force (3,) N in the platform's frame or, if fixed, in "
           "the fixed one; torque, N m, about OZ; point (3,) m from O at the height of the axles.")
      .def("set_loads", &S::set_loads, "loads"_a, "keep_momentum"_a = false,
           "Loads in place of the last, besides the scene's: dicts with mass (kg), position ((3,) m), inertia (kg m^2)."
           " The base keeps its velocity, or its momentum.")
      .def("set_state", &S::set_state, "pose"_a, "velocity"_a, "wheel_angles"_a = py::none(),
           "Puts the base at pose (x, y, psi), m and rad, with velocity (V_X, V_Y, Omega) in its own frame, m/s and "
           "rad/s, on wheel angles (4,) rad, if given. Wheels and rollers then roll without slip.")
      .def("reset", &S::reset, "Back to the scene's start and drive at t = 0.")
      .def_property_readonly(
          "t", [](S& s) { return s.now().time(); }, "Time, s.")
      .def_property_readonly("state", state, kState)
      .def_property_readonly("state_vector", state_vector,
                             "(24,) view: x, y, psi, work, V_X, V_Y, Omega, 0, phi, dphi, dgamma, gamma.")
      .def("contacts", contacts, kContacts)
      .def(
          "take_switches", switches,
          "Roller switches since the last call: t (s), wheel (0 to 3), roller_from, roller_to (0 to n - 1), phi (rad), "
          "direction (+1, -1), count (more than 1 where they follow too fast to be located).")
      .def_property_readonly(
          "energy", [](S& s) { return s.now().kinetic_energy(); }, "Kinetic energy, J.")
      .def_property_readonly(
          "energy_balance_error", [](S& s) { return s.now().energy_balance_error(); },
          "|change of energy - work of all torques and forces| since t = 0, J.")
      .def_property_readonly("statistics", &S::statistics, "Counters of the integration, as in simulate's summary.")
      .def_property_readonly(
          "doubt", [](S& s) { return s.motion().doubt(); },
          "Why the motion so far may be unreliable, in one line; empty if it is reliable.")
      .def_property_readonly(
          "reliable", [](S& s) { return s.motion().doubt().empty(); },
          "True if the motion so far is as accurate as docs/reliability.md says.")
      .def_property_readonly(
          "scene", [](S& s) { return s.now().scene().resolved; },
          "The scene with settings and defaults, as YAML text.");
  const auto run = [](const py::object& scene, const py::object& settings) { return S(scene, settings).run(); };
  module.def("run", run, "scene"_a, "settings"_a = py::none(),
             "Simulation(scene, settings).run(): all rows of a scene.");
}

}  // namespace youbot_base_sim
