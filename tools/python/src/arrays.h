#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "youbot_base_sim/scene/scene.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// A scene as Python gives it: a file's path, YAML text (it has a line break or ": "), or a dict; and settings in place
/// of its own values, {"floor.friction": 0.3}. Throws SceneError for what is no YAML.
struct SceneSource {
  SceneSource(const pybind11::object& scene, const pybind11::object& values);

  Scene load(bool resolve) const { return load_scene(file, settings, SceneUse::kRun, resolve); }

  SceneFile file;
  SceneSettings settings;
};

/// A key and the value that Python gives it.
SceneSetting scene_setting(const std::string& key, const pybind11::handle& value);

/// Numbers in C order. pybind11::value_error unless they have this shape and are all in the range.
pybind11::array_t<double> numbers(const char* name, const pybind11::handle& value,
                                  const std::vector<pybind11::ssize_t>& shape, const Range& range);
Wheels wheels(const char* name, const pybind11::handle& value, const Range& range);
Eigen::Vector3d vector(const char* name, const pybind11::handle& value, const Range& range);

// Structured arrays. Views are read-only, without copies, and keep `owner` alive.
pybind11::array rows_of(std::vector<double> numbers);
pybind11::array states_view(const double* states, const std::vector<pybind11::ssize_t>& shape,
                            const pybind11::handle& owner);
pybind11::array contacts_of(const std::vector<const Simulation*>& simulations);  ///< (n, 4)
pybind11::array switches_of(const std::vector<RollerSwitch>& switches);
pybind11::array read_only(pybind11::array array);

void register_records();  ///< once, when the module is imported

}  // namespace youbot_base_sim
