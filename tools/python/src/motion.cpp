#include "motion.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "youbot_base_sim/offline/verdict.h"
#include "youbot_base_sim/text/quote.h"

namespace py = pybind11;

namespace youbot_base_sim {

Motion::Motion(const Scene& scene, std::function<void()> at_look)
    : simulation_(scene), at_look_(std::move(at_look)), rows_(std::in_place, simulation_, at_look_) {}

Simulation& Motion::simulation() {
  if (!ended_.empty()) throw std::runtime_error(fmt::format("the motion has ended: {}; reset() begins anew", ended_));
  return simulation_;
}

template <class Work>
void Motion::guarded(const Work& work) {
  try {
    work();
  } catch (const std::domain_error& error) {
    ended_ = error.what();
    throw std::runtime_error(ended_);
  } catch (const std::runtime_error& error) {
    if (dynamic_cast<const py::error_already_set*>(&error) == nullptr) ended_ = error.what();
    throw;
  }
}

void Motion::advance_to(double t) {
  simulation();
  if (!ControlTime::reached(t, simulation_.time())) guarded([&] { rows_->advance_to(t); });
}

void Motion::step(int periods) {
  for (int k = 0; k < periods; ++k) advance_to(simulation_.period_end());
}

std::vector<double> Motion::run() {
  const Scene& scene = simulation().scene();
  if (std::holds_alternative<std::monostate>(scene.drive))
    throw std::logic_error(fmt::format("{}: drive is left out; run needs one", quote_path(scene.files.front())));
  if (simulation_.time() > 0)
    throw std::logic_error(fmt::format("run begins at t = 0, not at {:g} s: reset() goes back", simulation_.time()));
  std::vector<double> numbers;
  guarded([&] {
    while (rows_->next()) {
      const double* x = simulation_.state().begin();
      numbers.push_back(rows_->t());
      numbers.insert(numbers.end(), x + State::kX, x + State::kWork);
      numbers.insert(numbers.end(), x + State::kV, x + State::kOmega + 1);
      numbers.insert(numbers.end(), x + State::kPhi, x + State::kGamma);
    }
  });
  return numbers;
}

void Motion::reset() {
  simulation_.reset();
  rows_.emplace(simulation_, at_look_);
  ended_.clear();
}

std::string Motion::doubt() const {
  return ended_.empty() ? unreliability_reason(simulation_, *rows_, nullptr) : ended_;
}

void SignalWatch::operator()() {
  constexpr std::chrono::milliseconds kInterval{50};
  if (std::chrono::steady_clock::now() - last_ < kInterval) return;
  const py::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  last_ = std::chrono::steady_clock::now();
}

void check_time(double t, double now) {
  if (std::isfinite(t) && ControlTime::reached(now, t)) return;
  throw py::value_error(fmt::format("t = {}: must be a finite number >= {}, the present time, s", t, now));
}

void check_periods(const Scene& scene, int periods) {
  if (scene.solver.control_period == 0)
    throw py::value_error("solver.control_period = 0: must be more than 0 s for steps; advance(t) needs none");
  if (periods < 1) throw py::value_error(fmt::format("periods = {}: must be a whole number > 0", periods));
}

DriveMode drive_mode(const Scene& scene, const std::string& mode) {
  if (mode != "off" && mode != "torque" && mode != "velocity")
    throw py::value_error(fmt::format("mode = {}: must be off, torque or velocity", mode));
  if (mode != "velocity") return mode == "off" ? DriveMode::kOff : DriveMode::kTorque;
  const std::string limit = stable_period(scene, scene.motors.value_or(MotorSettings()).gains);
  if (limit.empty()) return DriveMode::kVelocity;
  throw py::value_error(fmt::format("solver.control_period = {:g}: must be {}", scene.solver.control_period, limit));
}

}  // namespace youbot_base_sim
