// The extension youbot_base_sim._core: runs of the core as _simulator.py shows them.

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/scene/yaml_file.h"
#include "youbot_base_sim/simulation.h"
#include "youbot_base_sim/text/quote.h"
#include "youbot_base_sim/threads/share.h"

namespace py = pybind11;
using namespace py::literals;

namespace youbot_base_sim {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Shape = std::vector<py::ssize_t>;

// Numbers that Python may give, beside those of scenes.
constexpr Range kTorques{-3e6, 3e6, "N m"}, kRates{-1e6, 1e6, "rad/s"}, kPeriods{1, 1e9, "whole periods"};

/// A value of Python in a message.
std::string shown(const py::object& value) { return quote(py::repr(value).cast<std::string>()); }

using Source = std::pair<SceneFile, SceneSettings>;  // which are in place of the file's own values

/// A simulation that is audited from call to call.
struct Run {
  Run(const Scene& scene, std::function<void()> look) : simulation(scene), rows(simulation, std::move(look)) {}

  /// The reason why the motion so far may be unreliable, in one line; empty if it is reliable.
  std::string doubt() const { return ended.empty() ? unreliability_reason(simulation, rows, nullptr) : ended; }

  Simulation simulation;
  RowLoop rows;
  std::string ended;     ///< why the motion cannot go on; empty: it goes on
  AppliedLoads applied;  ///< besides the scene's
};

/// The runs of a Simulation, whose shape is (), or of a Batch. What is wrong throws before any run changes. Where the
/// motion has ended, a Simulation throws; runs of a Batch stand still. Threads work without the GIL.
class Runs {
 public:
  Runs(const std::vector<Source>& sources, Shape shape, int threads)
      : shape_(std::move(shape)), threads_(threads), runs_(shape_.empty() ? 1 : static_cast<std::size_t>(shape_[0])) {
    make(sources);
  }

  /// Begins anew with other scenes: a source for each run, or one for all.
  void make(const std::vector<Source>& sources) {
    std::vector<Scene> scenes(sources.size());
    for_each(scenes.size(), [&](std::size_t k) {
      scenes[k] = load_scene(sources[k].first, sources[k].second, SceneUse::kRun, k == 0);
    });
    for (const Scene& scene : scenes) {
      for (const std::string& warning : warnings_of(scene)) {
        if (PyErr_WarnEx(PyExc_UserWarning, warning.c_str(), 2) != 0) throw py::error_already_set();
      }
    }
    for_each(idle().size(), [&](std::size_t k) { runs_[k].emplace(scenes[k % scenes.size()], [this] { look(); }); });
  }

  void reset(const py::object& where) {
    const Array chosen = flags("where", where);
    for (std::size_t k = 0; k < idle().size(); ++k) {
      if (chosen.data()[k] != 0) runs_[k].emplace(Scene(runs_[k]->simulation.scene()), [this] { look(); });
    }
  }

  void step(const py::object& torque, const py::object& periods) {
    const Array count = numbers("periods", periods, 1, kPeriods, "iu");
    for (const auto& run : idle()) {
      if (run->simulation.scene().solver.control_period == 0)
        throw py::value_error("solver.control_period = 0: must be more than 0 s for steps; advance(t) needs none");
    }
    if (!torque.is_none()) set_torque(torque);
    advance_all([&](Run& run, std::size_t k) {
      const Simulation& now = run.simulation;
      run.rows.advance_to(now.period_end() + (count.data()[k] - 1) * now.scene().solver.control_period);
    });
  }

  void advance(const py::object& to) {
    double now = 0;
    for (const auto& run : idle()) now = std::max(now, run->simulation.time());
    const Array t = numbers("t", to, 1, {now - ControlTime::rounding(now), 1e9, "s, not in the past"});
    advance_all([&](Run& run, std::size_t k) { run.rows.advance_to(t.data()[k]); });
  }

  /// Of each run, for each row of the scene or until the motion ends, the numbers of simulate's row.
  std::vector<py::array_t<double>> run() {
    for (const auto& run : idle()) {
      if (const Scene& scene = run->simulation.scene(); std::holds_alternative<std::monostate>(scene.drive))
        throw py::value_error(fmt::format("{}: drive is left out; run needs one", quote_path(scene.files.front())));
      if (const double t = run->simulation.time(); t > 0)
        throw py::value_error(fmt::format("run begins at t = 0, not at {:g} s: reset() goes back", t));
    }
    std::vector<std::vector<double>> rows(runs_.size());
    advance_all([&](Run& run, std::size_t k) {
      for (const State& x = run.simulation.state(); run.rows.next();) {
        rows[k].insert(rows[k].end(), {run.rows.t(), x.x(), x.y(), x.psi(), x.V_X(), x.V_Y(), x.Omega()});
        rows[k].insert(rows[k].end(), x.phi().data(), x.phi().data() + 3 * kWheels);  // dphi and dgamma follow
      }
    });
    std::vector<py::array_t<double>> arrays;
    for (const auto& numbers : rows) arrays.emplace_back(numbers.size(), numbers.data());
    return arrays;
  }

  void set_torque(const py::object& torque) {
    const Array values = numbers("torque", torque, kWheels, kTorques);
    change([&](Run& run, std::size_t k) { run.simulation.set_torque(Wheels(values.data() + kWheels * k)); });
  }

  void set_points(const py::object& mode_name, const py::object& values) {
    const auto name = py::repr(mode_name).cast<std::string>();
    const bool tracks = name == "'velocity'", exerts = name == "'torque'";
    if (!tracks && !exerts && name != "'off'")
      throw py::value_error(fmt::format("mode = {}: must be 'off', 'torque' or 'velocity'", quote(name)));
    const Scene& scene = first().scene();
    const std::string limit = stable_period(scene, scene.motors.value_or(MotorSettings()).gains);
    if (tracks && !limit.empty())
      throw py::value_error(fmt::format("control_period = {:g}: must be {}", scene.solver.control_period, limit));
    const Array points = numbers("values", values, kWheels, tracks ? kRates : kTorques);
    const DriveMode mode = tracks ? DriveMode::kVelocity : exerts ? DriveMode::kTorque : DriveMode::kOff;
    change([&](Run& run, std::size_t k) { run.simulation.set_points(mode, Wheels(points.data() + kWheels * k)); });
  }

  void set_wrench(const py::object& force, const py::object& torque, const py::object& point, const py::object& fixed) {
    const Array forces = numbers("force", force, 3, kWrenchForces);
    const Array torques = numbers("torque", torque, 1, kWrenchTorques);
    const Array points = numbers("point", point, 3, kLoadPositions), turned = flags("fixed", fixed);
    change([&](Run& run, std::size_t k) {
      const Eigen::Vector3d W(forces.data() + 3 * k), place(points.data() + 3 * k);
      run.applied.wrenches = {{W, place, torques.data()[k], turned.data()[k] != 0}};
      run.simulation.set_loads(run.applied);
    });
  }

  /// The loads of a scene, whose reader has checked them, or none.
  void set_loads(const std::optional<Source>& source, const py::object& keep_momentum) {
    const Array keeps = flags("keep_momentum", keep_momentum);
    std::vector<Load> loads;
    const LoadSchedule given = source ? load_scene(source->first, source->second).load_schedule : LoadSchedule();
    for (const auto& planned : given.loads) {
      if (planned.start != 0 || std::isfinite(planned.end) || planned.at_rest)
        throw py::value_error("loads: start, end and placed must be left out: these act from now on");
      loads.push_back(planned.load);
    }
    change([&](const Run& run, std::size_t /*k*/) {
      const std::string lifted = lifted_wheel(run.simulation.scene(), loads, run.simulation.time());
      if (!lifted.empty()) throw py::value_error("loads must be " + lifted);
    });
    change([&](Run& run, std::size_t k) {
      run.applied.loads = loads;
      run.simulation.set_loads(run.applied, keeps.data()[k] != 0);
    });
  }

  void set_state(const py::object& pose, const py::object& velocity, const py::object& phi, const py::object& where) {
    const Array poses = numbers("pose", pose, 3, kPoses), chosen = flags("where", where);
    const Array twists = numbers("velocity", velocity, 3, kSpeeds);
    const Array angles = phi.is_none() ? Array() : numbers("wheel_angles", phi, kWheels, kWheelAngles);
    change([&](Run& run, std::size_t k) {
      if (chosen.data()[k] == 0) return;
      const auto own = phi.is_none() ? std::nullopt : std::make_optional<Wheels>(angles.data() + kWheels * k);
      run.simulation.set_state(Eigen::Vector3d(poses.data() + 3 * k), Eigen::Vector3d(twists.data() + 3 * k), own);
    });
  }

  /// The numbers that `get` says of each run: an array with one more dimension, unless it is one number.
  template <class Get>
  py::object read(const Get& get) {
    using Value = typename decltype(get(*runs_[0]))::value_type;
    py::array_t<Value> values(shape_of(static_cast<py::ssize_t>(get(*idle()[0]).size())));
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
    py::list doubts;
    for (const auto& run : idle()) doubts.append(run->doubt());
    return shape_.empty() ? py::object(doubts[0]) : doubts;
  }

  Simulation& first() { return idle()[0]->simulation; }
  /// Records of numpy over the states where they are, which keep `self`.
  static py::object states(const py::object& self, const py::dtype& record) {
    auto& runs = self.cast<Runs&>();
    const Shape strides(runs.shape_.size(), sizeof(std::optional<Run>));
    py::array view(record, runs.shape_, strides, runs.first().state().begin(), self);
    view.attr("flags").attr("writeable") = false;
    return view[py::tuple()];
  }

 private:
  /// Of so many numbers for each run; a single one has no dimension of its own.
  Shape shape_of(py::ssize_t size) const {
    return size == 1 ? shape_ : shape_.empty() ? Shape{size} : Shape{shape_[0], size};
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

  /// As `share`; throws what Python's signal handlers raise, too.
  template <class Work>
  void for_each(std::size_t n, const Work& work) {
    try {
      const py::gil_scoped_release release;
      caller_ = std::this_thread::get_id();
      stopping_ = false;
      share(n, threads_, stopping_, work, [this] { look(); });
    } catch (const Interrupted&) {
      throw py::error_already_set();
    }
  }

  /// To be called by work that takes long: throws Interrupted after a signal, and once another thread threw.
  void look() {
    if (stopping_) throw Interrupted();
    if (std::this_thread::get_id() != caller_ || Clock::now() - looked_ < std::chrono::milliseconds(50)) return;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw Interrupted();
    looked_ = Clock::now();
  }

  template <class Work>
  void advance_all(const Work& work) {
    change([](const Run& /*run*/, std::size_t /*k*/) {});
    const std::unique_ptr<bool, void (*)(bool*)> busy(&(busy_ = true), [](bool* flag) { *flag = false; });
    for_each(runs_.size(), [&](std::size_t k) {
      Run& run = *runs_[k];
      try {
        if (run.ended.empty()) work(run, k);
      } catch (const std::exception& error) {
        run.ended = error.what();
      }
      run.simulation.take_load_changes();  // no list grows where nothing reads it
      run.simulation.take_state_changes();
      if (!shape_.empty()) run.simulation.take_switches();
    });
    if (shape_.empty() && !runs_[0]->ended.empty()) throw std::runtime_error(runs_[0]->ended);
  }

  /// So many numbers for each run, of these `kinds` of numpy's types; those of one run serve all of a batch.
  Array numbers(const char* name, const py::object& value, py::ssize_t size, const Range& range,
                const std::string& kinds = "fiu") const {
    const Shape shape = shape_of(size), each(shape.begin() + static_cast<py::ssize_t>(shape_.size()), shape.end());
    const py::array any = py::array::ensure(value);
    const Array array = any && kinds.find(any.dtype().kind()) != std::string::npos ? Array::ensure(any) : Array(0);
    const Shape given(array.shape(), array.shape() + array.ndim());
    const auto allowed = [&](double number) { return contains(range, number); };
    if ((given == shape || given == each) && std::all_of(array.data(), array.data() + array.size(), allowed))
      return given == shape ? array : Array(py::module_::import("numpy").attr("broadcast_to")(array, shape));
    const std::string of = shape.empty() ? "" : fmt::format("of shape {}, each ", shown(py::tuple(py::cast(shape))));
    throw py::value_error(
        fmt::format("{} = {}: must be {}{}", name, shown(value), of, kinds == "b" ? "True or False" : text_of(range)));
  }

  Array flags(const char* name, const py::object& value) const { return numbers(name, value, 1, {0, 1, ""}, "b"); }

  using Clock = std::chrono::steady_clock;
  struct Interrupted {};  // no std::exception, which ends a motion

  Shape shape_;  // of the runs
  int threads_;
  std::thread::id caller_;
  Clock::time_point looked_;  // by the caller
  std::atomic<bool> stopping_{false};
  std::vector<std::optional<Run>> runs_;  // in one stretch of memory, for `states`
  bool busy_ = false;                     // guarded by the GIL
};

}  // namespace

PYBIND11_MODULE(_core, module) {
  py::register_exception<SceneError>(module, "SceneError", PyExc_ValueError);
  py::register_exception<std::logic_error>(module, "LogicError", PyExc_ValueError);
  PYBIND11_NUMPY_DTYPE(RollerSwitch, t, wheel, roller_from, roller_to, phi, direction, count);
  py::class_<SceneFile>(module, "File")
      .def(py::init(&read_scene_file))
      .def(py::init([](const std::string& name, const std::string& text) {
        return SceneFile{name, checked_yaml_text(name, text)};
      }));
  py::class_<SceneSetting>(module, "Setting").def(py::init<std::string, std::string>());
  module.def("shown", &shown);

  py::class_<Runs> runs(module, "Runs");
  const auto figure = [&](const char* name, const char* doc, auto get) {
    runs.def_property_readonly(name, py::cpp_function([get](Runs& r) { return r.read(get); }), doc);
  };
  figure("t", "Time, s.", [](const Run& run) { return std::array{run.simulation.time()}; });
  figure("energy", "Kinetic energy, J.", [](const Run& run) { return std::array{run.simulation.kinetic_energy()}; });
  figure("ended", "Whether the motion cannot go on, as at the tipping limit; doubt says why.",
         [](const Run& run) { return std::array{!run.ended.empty()}; });
  figure("reliable", "Whether the motion so far is as accurate as docs/reliability.md says.",
         [](const Run& run) { return std::array{run.doubt().empty()}; });
  figure("rollers", "(4,) numbers, 0 to n - 1, of the rollers that the wheels stand on.",
         [](const Run& run) { return run.simulation.rollers(); });
  figure("_contacts", "In the order of _CONTACTS.", [](const Run& run) {
    const ContactDetails c = run.simulation.contacts();
    std::array<double, 8 * kWheels> all;
    Eigen::Map<Eigen::Array<double, kWheels, 8>>(all.data()) << c.V_PX, c.V_PY, c.F_X, c.F_Y, c.N, c.f, c.Delta_Y,
        c.M_S;
    return all;
  });
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
      .def_property(
          "torque", [](Runs& r) { return r.read([](const Run& run) { return run.simulation.torque(); }); },
          &Runs::set_torque, "(4,) N m: the torque M that acts now. A set one acts exactly, until it is set anew.")
      .def_property_readonly("statistics", &Runs::statistics, "Counters of the integration, as in simulate's summary.")
      .def_property_readonly("doubt", &Runs::doubts,
                             "Why the motion so far may be unreliable; empty if it is reliable.")
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
           "Puts the base at pose (x, y, psi), m and rad, with velocity (V_X, V_Y, Omega) in its frame, m/s and rad/s, "
           "on wheel angles (4,) rad, if given; it rolls without slip. Of a Batch, the runs `where` this is true.");
}

}  // namespace youbot_base_sim
