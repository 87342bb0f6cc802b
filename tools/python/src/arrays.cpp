#include "arrays.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "youbot_base_sim/scene/yaml_file.h"
#include "youbot_base_sim/text/quote.h"

namespace py = pybind11;

namespace youbot_base_sim {

/// One wheel's contact, as a record of numpy.
struct ContactRecord {
  double V_PX, V_PY, F_X, F_Y, N, f, Delta_Y, M_S;
  int roller, other_roller;
};

namespace {

constexpr std::size_t kColumns = 19;  // of a row

/// JSON, which is YAML; numbers read back to the same double.
std::string yaml_of(const py::handle& value) {
  const py::cpp_function plain([](const py::object& other) {
    return py::hasattr(other, "tolist") ? other.attr("tolist")() : py::object(py::str(other));
  });
  using py::literals::operator""_a;
  const auto dumps = py::module_::import("json").attr("dumps");
  return dumps(value, "ensure_ascii"_a = false, "default"_a = plain).cast<std::string>();
}

SceneFile scene_file(const py::object& scene) {
  constexpr char kName[] = "scene";  // of a text in messages; tables are beside it, in the current folder
  if (py::isinstance<py::dict>(scene)) return {kName, checked_yaml_text(kName, yaml_of(scene))};
  const auto text = py::module_::import("os").attr("fspath")(scene).cast<std::string>();
  const bool is_yaml = text.find('\n') != std::string::npos || text.find(": ") != std::string::npos;
  return py::isinstance<py::str>(scene) && is_yaml ? SceneFile{kName, checked_yaml_text(kName, text)}
                                                   : read_scene_file(text);
}

/// A record of doubles: names, and how many numbers each of them has; 0: an unnamed one.
py::dtype record(const std::vector<std::pair<std::string, int>>& fields) {
  py::list names, formats, offsets;
  std::size_t offset = 0;
  for (const auto& [name, size] : fields) {
    if (size > 0) {
      names.append(name);
      formats.append(size == 1 ? "f8" : fmt::format("({},)f8", size));
      offsets.append(offset);
    }
    offset += sizeof(double) * static_cast<std::size_t>(std::max(size, 1));
  }
  return {names, formats, offsets, static_cast<py::ssize_t>(offset)};
}

py::dtype row_record() {
  std::vector<std::pair<std::string, int>> fields;
  for (const char* name : {"t", "x", "y", "psi", "V_X", "V_Y", "Omega"}) fields.emplace_back(name, 1);
  for (const char* quantity : {"phi", "dphi", "dgamma"}) {
    for (const char* wheel : kWheelNames) fields.emplace_back(fmt::format("{}_{}", quantity, wheel), 1);
  }
  return record(fields);
}

}  // namespace

SceneSetting scene_setting(const std::string& key, const py::handle& value) {
  if (py::isinstance<py::str>(value)) return {key, value.cast<std::string>(), true};
  return {key, yaml_of(value)};
}

SceneSource::SceneSource(const py::object& scene, const py::object& values) : file(scene_file(scene)) {
  if (values.is_none()) return;
  for (const auto& [key, value] : py::dict(values)) settings.push_back(scene_setting(key.cast<std::string>(), value));
}

py::array_t<double> numbers(const char* name, const py::handle& value, const std::vector<py::ssize_t>& shape,
                            const Range& range) {
  using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
  const Array array = Array::ensure(value);
  const auto allowed = [&](double number) { return contains(range, number); };
  if (array && std::equal(array.shape(), array.shape() + array.ndim(), shape.begin(), shape.end()) &&
      std::all_of(array.data(), array.data() + array.size(), allowed)) {
    return array;
  }
  std::string sizes = fmt::format("{}", fmt::join(shape, ", "));
  if (shape.size() == 1) sizes += ",";
  throw py::value_error(fmt::format("{} = {}: must be numbers of shape ({}), each {}", name,
                                    quote(py::repr(value).cast<std::string>()), sizes, text_of(range)));
}

Wheels wheels(const char* name, const py::handle& value, const Range& range) {
  return Wheels(numbers(name, value, {kWheels}, range).data());
}

Eigen::Vector3d vector(const char* name, const py::handle& value, const Range& range) {
  return Eigen::Vector3d(numbers(name, value, {3}, range).data());
}

py::array read_only(py::array array) {
  array.attr("flags").attr("writeable") = false;
  return array;
}

py::array rows_of(std::vector<double> numbers) {
  static const auto* const dtype = new py::dtype(row_record());  // outlives the interpreter's end
  const auto size = static_cast<py::ssize_t>(numbers.size() / kColumns);
  auto owned = std::make_unique<std::vector<double>>(std::move(numbers));
  const py::capsule owner(owned.get(), [](void* pointer) { delete static_cast<std::vector<double>*>(pointer); });
  return {*dtype, {size}, {}, owned.release()->data(), owner};
}

py::array states_view(const double* states, const std::vector<py::ssize_t>& shape, const py::handle& owner) {
  static const auto* const dtype = new py::dtype(record({{"x", 1},
                                                         {"y", 1},
                                                         {"psi", 1},
                                                         {"work", 1},
                                                         {"V_X", 1},
                                                         {"V_Y", 1},
                                                         {"Omega", 1},
                                                         {"", 0},
                                                         {"phi", 4},
                                                         {"dphi", 4},
                                                         {"dgamma", 4},
                                                         {"gamma", 4}}));
  return read_only({*dtype, shape, {}, states, owner});
}

py::array contacts_of(const std::vector<const Simulation*>& simulations) {
  py::array_t<ContactRecord> records({static_cast<py::ssize_t>(simulations.size()), py::ssize_t{kWheels}});
  ContactRecord* record = records.mutable_data();
  for (const Simulation* simulation : simulations) {
    const ContactDetails c = simulation->contacts();
    const auto rollers = simulation->rollers();
    const auto others = simulation->other_rollers();
    for (int i = 0; i < kWheels; ++i) {
      const auto wheel = static_cast<std::size_t>(i);
      *record++ = {c.V_PX[i], c.V_PY[i],    c.F_X[i], c.F_Y[i],       c.N[i],
                   c.f[i],    c.Delta_Y[i], c.M_S[i], rollers[wheel], others[wheel].value_or(-1)};
    }
  }
  return records;
}

py::array switches_of(const std::vector<RollerSwitch>& switches) {
  return py::array_t<RollerSwitch>(static_cast<py::ssize_t>(switches.size()), switches.data());
}

void register_records() {
  PYBIND11_NUMPY_DTYPE(ContactRecord, V_PX, V_PY, F_X, F_Y, N, f, Delta_Y, M_S, roller, other_roller);
  PYBIND11_NUMPY_DTYPE(RollerSwitch, t, wheel, roller_from, roller_to, phi, direction, count);
}

}  // namespace youbot_base_sim
