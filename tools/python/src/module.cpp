// The Python module youbot_base_sim._simulator, which the package youbot_base_sim shows.

#include "arrays.h"

namespace youbot_base_sim {
void bind_simulation(pybind11::module_& module);
}

PYBIND11_MODULE(_simulator, module) {
  module.doc() = "The simulator of youbot_base_sim.";
  pybind11::register_exception_translator(
      [](std::exception_ptr pointer) {  // NOLINT(performance-unnecessary-value-param)
        try {
          if (pointer) std::rethrow_exception(pointer);
        } catch (const youbot_base_sim::SceneError& error) {
          PyErr_SetString(PyExc_ValueError, error.what());
        } catch (const std::logic_error& error) {
          PyErr_SetString(PyExc_ValueError, error.what());
        }
      });
  youbot_base_sim::register_records();
  youbot_base_sim::bind_simulation(module);
}
