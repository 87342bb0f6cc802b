// The extension youbot_base_sim._core: runs of the core as _simulator.py shows them.

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "crew.h"
#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/scene/yaml_file.h"
#include "youbot_base_sim/simulation.h"
#include "youbot_base_sim/text/quote.h"

namespace py = pybind11;
using namespace py::literals;

namespace youbot_base_sim {

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;
using Eigen::Vector3d;

// Numbers that Python may give, beside those of scenes.
constexpr Range kTorques{-3e6, 3e6, "N m"}, kRates{-1e6, 1e6, "rad/s"}, kMask{0, 1, ""};

/// A scene's file, and settings in place of its own values.
struct Source {
  SceneFile file;
  SceneSettings settings;

  Scene load(bool resolve) const { return load_scene(file, settings, SceneUse::kRun, resolve); }
};

/// A simulation that is audited from call to call. After an error has ended its motion, only `reset` is left.
struct Run {
  Run(const Scene& scene, Crew& crew) : simulation(scene), crew_(crew) { reset(); }

  void reset() {
    simulation.reset();
    rows_.emplace(simulation, [this] { crew_.look(); });
    ended.clear();
    applied = {};
  }

  void advance_to(double t) {
    if (ended.empty() && !ControlTime::reached(t, simulation.time())) until_it_ends([&] { rows_->advance_to(t); });
  }

  /// Of each row of the scene, or until the motion ends, t and the numbers of the state.
  std::vector<double> rows() {
    std::vector<double> numbers;
    until_it_ends([&] {
      while (rows_->next()) {
        numbers.push_back(rows_->t());
        numbers.insert(numbers.end(), simulation.state().begin(), simulation.state().end());
      }
    });
    return numbers;
  }

  /// Why the motion so far may be unreliable, in one line; empty if it is reliable.
  std::string doubt() const { return ended.empty() ? unreliability_reason(simulation, *rows_, nullptr) : ended; }

  Simulation simulation;
  std::string ended;     ///< why; empty: it goes on
  AppliedLoads applied;  ///< besides the scene's

 private:
  template <class Work>
  void until_it_ends(const Work& work) {
    try {
      work();
    } catch (const py::error_already_set&) {  // a std::runtime_error before pybind11 2.9
      throw;
    } catch (const std::domain_error& error) {
      ended = error.what();
    } catch (const std::runtime_error& error) {
      ended = error.what();
    }
  }

  Crew& crew_;
  std::optional<RowLoop> rows_;  // emplaced anew by reset: it refers to the simulation
};

/// The runs of a Simulation, whose shape is (), or of a Batch. What is wrong throws before any run changes. Where the
/// motion has ended, a Simulation throws; runs of a Batch stand still.
class Runs {
 public:
  Runs(const std::vector<Source>& sources, Shape shape, int threads)
      : shape_(std::move(shape)), crew_(threads), runs_(shape_.empty() ? 1 : static_cast<std::size_t>(shape_[0])) {
    make(sources);
  }

  /// Begins anew with other scenes: a source for each run, or one for all.
  void make(const std::vector<Source>& sources) {
    std::vector<Scene> scenes(sources.size());
    crew_.for_each(scenes.size(), [&](std::size_t k) { scenes[k] = sources[k].load(k == 0); });
    for (const Scene& scene : scenes) {
      for (const std::string& warning : warnings_of(scene)) {
        if (PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 2) != 0) throw py::error_already_set();
      }
    }
    crew_.for_each(idle().size(), [&](std::size_t k) { runs_[k].emplace(scenes[k % scenes.size()], crew_); });
  }

  void reset(const py::object& where) {
    const Array chosen = numbers("where", where, {}, kMask);
    for (std::size_t k = 0; k < idle().size(); ++k) {
      if (chosen.data()[k] != 0) runs_[k]->reset();
    }
  }

  void step(const py::object& torque, int periods) {
    if (periods < 1) throw py::value_error(fmt::format("periods = {}: must be a whole number > 0", periods));
    for (const auto& run : idle()) {
      if (run->simulation.scene().solver.control_period == 0)
        throw py::value_error("solver.control_period = 0: must be more than 0 s for steps; advance(t) needs none");
    }
    if (!torque.is_none()) set_torque(torque);
    advance_all([&](Run& run, std::size_t /*k*/) {
      run.advance_to(run.simulation.period_end() + (periods - 1) * run.simulation.scene().solver.control_period);
    });
  }

  void advance(double t) {
    double now = 0;
    for (const auto& run : idle()) now = std::max(now, run->simulation.time());
    if (!std::isfinite(t) || !ControlTime::reached(now, t))
      throw py::value_error(fmt::format("t = {}: must be a finite number >= {}, the present time, s", t, now));
    advance_all([&](Run& run, std::size_t /*k*/) { run.advance_to(t); });
  }

  std::vector<py::array_t<double>> run() {
    for (const auto& run : idle()) {
      const Scene& scene = run->simulation.scene();
      const double t = run->simulation.time();
      if (std::holds_alternative<std::monostate>(scene.drive))
        throw py::value_error(fmt::format("{}: drive is left out; run needs one", quote_path(scene.files.front())));
      if (t > 0) throw py::value_error(fmt::format("run begins at t = 0, not at {:g} s: reset() goes back", t));
    }
    std::vector<std::vector<double>> rows(runs_.size());
    advance_all([&](Run& run, std::size_t k) { rows[k] = run.rows(); });
    std::vector<py::array_t<double>> arrays;
    for (auto& numbers : rows) {
      arrays.emplace_back(static_cast<py::ssize_t>(numbers.size()), numbers.data());
      std::vector<double>().swap(numbers);
    }
    return arrays;
  }

  void set_torque(const py::object& torque) {
    const Array values = numbers("torque", torque, {kWheels}, kTorques);
    change([&](Run& run, std::size_t k) { run.simulation.set_torque(Wheels(values.data() + kWheels * k)); });
  }

  void set_points(const std::string& name, const py::object& values) {
    const DriveMode mode = drive_mode(name);
    const Array points = numbers("values", values, {kWheels}, mode == DriveMode::kVelocity ? kRates : kTorques);
    change([&](Run& run, std::size_t k) { run.simulation.set_points(mode, Wheels(points.data() + kWheels * k)); });
  }

  void set_wrench(const py::object& force, const py::object& torque, const py::object& point, bool fixed) {
    const Array forces = numbers("force", force, {3}, kWrenchForces);
    const Array torques = numbers("torque", torque, {}, kWrenchTorques);
    const Array points = numbers("point", point, {3}, kLoadPositions);
    change([&](Run& run, std::size_t k) {
      const Vector3d W(forces.data() + 3 * k), place(points.data() + 3 * k);
      apply(run, {run.applied.loads, {{W, place, torques.data()[k], fixed}}}, false);
    });
  }

  /// The loads of a scene, whose reader has checked them.
  void set_loads(const Source& source, bool keep_momentum) {
    std::vector<Load> loads;
    for (const auto& planned : source.load(false).load_schedule.loads) {
      if (planned.start != 0 || std::isfinite(planned.end) || planned.at_rest)
        throw py::value_error("loads: start, end and placed must be left out: these act from now on");
      loads.push_back(planned.load);
    }
    change([&](const Run& run, std::size_t /*k*/) {
      const std::string lifted = lifted_wheel(run.simulation.scene(), loads, run.simulation.time());
      if (!lifted.empty()) throw py::value_error("loads must be " + lifted);
    });
    change([&](Run& run, std::size_t /*k*/) { apply(run, {loads, run.applied.wrenches}, keep_momentum); });
  }

  void set_state(const py::object& pose, const py::object& velocity, const py::object& phi, const py::object& where) {
    const Array poses = numbers("pose", pose, {3}, kPoses), chosen = numbers("where", where, {}, kMask);
    const Array twists = numbers("velocity", velocity, {3}, kSpeeds);
    std::optional<Array> angles;
    if (!phi.is_none()) angles = numbers("wheel_angles", phi, {kWheels}, kWheelAngles);
    change([&](Run& run, std::size_t k) {
      if (chosen.data()[k] == 0) return;
      const auto own = angles ? std::make_optional<Wheels>(angles->data() + kWheels * k) : std::nullopt;
      run.simulation.set_state(Vector3d(poses.data() + 3 * k), Vector3d(twists.data() + 3 * k), own);
      run.simulation.take_state_changes();
    });
  }

  /// The numbers that `get` says of each run: an array with one more dimension, unless it is one number.
  template <class Get>
  py::object read(const Get& get) {
    using Value = typename decltype(get(*runs_[0]))::value_type;
    const auto size = static_cast<py::ssize_t>(get(*idle()[0]).size());
    py::array_t<Value> values(joined(shape_, size == 1 ? Shape{} : Shape{size}));
    Value* out = values.mutable_data();
    for (const auto& run : runs_) {
      const auto numbers = get(*run);
      out = std::copy(numbers.begin(), numbers.end(), out);
    }
    return values[py::tuple()];
  }

  py::dict statistics() {
    py::dict all;
    for (const auto& field : kStatisticsFields)
      all[field.name] = read([&](const Run& run) { return std::vector{run.simulation.statistics().*field.value}; });
    return all;
  }

  py::object doubts() {
    std::vector<std::string> doubts;
    for (const auto& run : idle()) doubts.push_back(run->doubt());
    return shape_.empty() ? py::object(py::str(doubts[0])) : py::cast(doubts);
  }

  Simulation& first() { return idle()[0]->simulation; }
  /// Records of numpy over the states where they are, which keep `self`.
  static py::array states(const py::object& self, const py::dtype& record) {
    auto& runs = self.cast<Runs&>();
    const Shape strides(runs.shape_.size(), sizeof(std::optional<Run>));
    py::array view(record, runs.shape_, strides, runs.first().state().begin(), self);
    view.attr("flags").attr("writeable") = false;
    return view;
  }

 private:
  static Shape joined(Shape shape, const Shape& more) {
    shape.insert(shape.end(), more.begin(), more.end());
    return shape;
  }

  std::vector<std::optional<Run>>& idle() {
    if (busy_) throw std::runtime_error("another thread advances this simulation; each thread needs its own");
    return runs_;
  }

  template <class Command>
  void change(const Command& command) {
    if (shape_.empty() && !idle()[0]->ended.empty())
      throw std::runtime_error(fmt::format("the motion has ended: {}; reset() begins anew", runs_[0]->ended));
    for (std::size_t k = 0; k < idle().size(); ++k) {
      if (runs_[k]->ended.empty()) command(*runs_[k], k);
    }
  }

  template <class Work>
  void advance_all(const Work& work) {
    change([](const Run& /*run*/, std::size_t /*k*/) {});
    const std::unique_ptr<bool, void (*)(bool*)> busy(&(busy_ = true), [](bool* flag) { *flag = false; });
    crew_.for_each(runs_.size(), [&](std::size_t k) {
      work(*runs_[k], k);
      if (!shape_.empty()) runs_[k]->simulation.take_switches();  // no list grows where nothing reads it
    });
    if (shape_.empty() && !runs_[0]->ended.empty()) throw std::runtime_error(runs_[0]->ended);
  }

  static void apply(Run& run, AppliedLoads applied, bool keep_momentum) {
    run.applied = std::move(applied);
    run.simulation.set_loads(run.applied, keep_momentum);
    run.simulation.take_load_changes();
  }

  DriveMode drive_mode(const std::string& name) {
    if (name == "off") return DriveMode::kOff;
    if (name == "torque") return DriveMode::kTorque;
    if (name != "velocity") throw py::value_error(fmt::format("mode = {}: must be off, torque or velocity", name));
    const Scene& scene = first().scene();
    const std::string limit = stable_period(scene, scene.motors.value_or(MotorSettings()).gains);
    if (limit.empty()) return DriveMode::kVelocity;
    throw py::value_error(fmt::format("solver.control_period = {:g}: must be {}", scene.solver.control_period, limit));
  }

  /// An array of shape `each` for each run, in C order; one such array serves all runs of a batch.
  Array numbers(const char* name, const py::object& value, const Shape& each, const Range& range) const {
    const Shape shape = joined(shape_, each);
    const Array array = Array::ensure(value);
    const auto is = [&](const Shape& wanted) {
      return std::equal(array.shape(), array.shape() + array.ndim(), wanted.begin(), wanted.end());
    };
    const auto allowed = [&](double number) { return contains(range, number); };
    if (array && (is(shape) || is(each)) && std::all_of(array.data(), array.data() + array.size(), allowed))
      return is(shape) ? array : Array(py::module_::import("numpy").attr("broadcast_to")(array, shape));
    throw py::value_error(fmt::format("{} = {}: must be numbers of shape {}, each {}", name,
                                      quote(py::repr(value).cast<std::string>()),
                                      std::string(py::str(py::tuple(py::cast(shape)))), text_of(range)));
  }

  Shape shape_;  // of the runs
  Crew crew_;
  std::vector<std::optional<Run>> runs_;  // in one stretch of memory, for `states`
  bool busy_ = false;                     // guarded by the GIL
};

using Numbers = std::vector<double>;

/// In the order of CONTACTS in _simulator.py, each of four wheels.
Numbers contacts_of(const Run& run) {
  const ContactDetails c = run.simulation.contacts();
  const auto rollers = run.simulation.rollers();
  Numbers numbers;
  for (const Wheels& quantity : {c.V_PX, c.V_PY, c.F_X, c.F_Y, c.N, c.f, c.Delta_Y, c.M_S})
    numbers.insert(numbers.end(), quantity.begin(), quantity.end());
  numbers.insert(numbers.end(), rollers.begin(), rollers.end());
  for (const auto other : run.simulation.other_rollers()) numbers.push_back(other.value_or(-1));
  return numbers;
}

Numbers torque_of(const Run& run) {
  const Wheels torque = run.simulation.torque();
  return {torque.begin(), torque.end()};
}

}  // namespace

PYBIND11_MODULE(_core, module) {
  py::register_exception<SceneError>(module, "SceneError", PyExc_ValueError);
  py::register_exception<std::logic_error>(module, "LogicError", PyExc_ValueError);
  PYBIND11_NUMPY_DTYPE(RollerSwitch, t, wheel, roller_from, roller_to, phi, direction, count);
  py::class_<SceneFile>(module, "File")
      .def(py::init(&read_scene_file))
      .def(py::init([](const char* name, const char* text) {
        return SceneFile{name, checked_yaml_text(name, text)};
      }));
  py::class_<SceneSetting>(module, "Setting").def(py::init<std::string, std::string, bool>());
  py::class_<Source>(module, "Source").def(py::init<SceneFile, SceneSettings>()).def_readonly("file", &Source::file);

  py::class_<Runs> runs(module, "Runs");
  const auto figure = [&](const char* name, const char* doc, auto get) {
    runs.def_property_readonly(
        name, [get](Runs& r) { return r.read(get); }, doc);
  };
  figure("t", "Time, s.", [](const Run& run) -> Numbers { return {run.simulation.time()}; });
  figure("energy", "Kinetic energy, J.", [](const Run& run) -> Numbers { return {run.simulation.kinetic_energy()}; });
  figure("energy_balance_error", "|change of energy - work of all torques and forces| since t = 0, J.",
         [](const Run& run) -> Numbers { return {run.simulation.energy_balance_error()}; });
  figure("ended", "Whether the motion cannot go on, as at the tipping limit; doubt says why.",
         [](const Run& run) { return std::vector<bool>{!run.ended.empty()}; });
  figure("reliable", "Whether the motion so far is as accurate as docs/reliability.md says.",
         [](const Run& run) { return std::vector<bool>{run.doubt().empty()}; });
  figure("_contacts", "", &contacts_of);
  runs.def(py::init<std::vector<Source>, Shape, int>())
      .def("_make", &Runs::make)
      .def("_run", &Runs::run)
      .def("_set_loads", &Runs::set_loads)
      .def("_states", &Runs::states)
      .def(
          "take_switches",
          [](Runs& r) {
            const auto switches = r.first().take_switches();
            return py::array_t<RollerSwitch>(static_cast<py::ssize_t>(switches.size()), switches.data());
          },
          "Roller switches of a Simulation since the last call: t (s), wheel (0 to 3), roller_from, roller_to (0 to "
          "n - 1), phi (rad), direction (+1, -1), count (more than 1 where they follow too fast to be located).")
      .def_property_readonly(
          "scene", [](Runs& r) { return r.first().scene().resolved; },
          "The (first) scene with settings and defaults, as YAML text.")
      .def_property(
          "torque", [](Runs& r) { return r.read(&torque_of); }, &Runs::set_torque,
          "(4,) N m: the torque M that acts now. A set one acts exactly, until it is set anew.")
      .def_property_readonly("statistics", &Runs::statistics, "Counters of the integration, as in simulate's summary.")
      .def_property_readonly("doubt", &Runs::doubts,
                             "Why the motion so far may be unreliable, in one line; empty if it is reliable.")
      .def("reset", &Runs::reset, "where"_a = true,
           "Back to the start and the drive of the scene; of a Batch, the runs `where` this is true.")
      .def("step", &Runs::step, "torque"_a = py::none(), "periods"_a = 1,
           "Sets the torque, (4,) N m, if given; advances by control periods of the scene's solver.control_period, s.")
      .def("advance", &Runs::advance, "t"_a, "Advances to time t, s, now or later.")
      .def("set_points", &Runs::set_points, "mode"_a, "values"_a,
           "Set points of the scene's motors from the next control period on: mode torque, with (4,) values in N m; "
           "velocity, with wheel rates in rad/s for the motors' PI loops; or off.")
      .def("set_wrench", &Runs::set_wrench, "force"_a, "torque"_a = 0.0, "point"_a = py::make_tuple(0, 0, 0),
           "fixed"_a = false,
           "A wrench in place of the last, besides the scene's: force (3,) N in the platform's frame or, if fixed, in "
           "the fixed one; torque, N m, about OZ; point (3,) m from O at the height of the axles.")
      .def("set_state", &Runs::set_state, "pose"_a, "velocity"_a, "wheel_angles"_a = py::none(), "where"_a = true,
           "Puts the base at pose (x, y, psi), m and rad, with velocity (V_X, V_Y, Omega) in its own frame, m/s and "
           "rad/s, on wheel angles (4,) rad, if given. Wheels and rollers then roll without slip. Of a Batch, the runs "
           "`where` this is true.");
}

}  // namespace youbot_base_sim
