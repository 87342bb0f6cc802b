// Drives the base forward with 1 N m on each wheel while it is slower than 0.3 m/s, and prints where it goes.

#include <youbot_base_sim/simulation.h>

#include <cstdio>

int main() {
  using namespace youbot_base_sim;
  Scene scene = default_scene({});  // or load_scene("my_scene.yaml")
  scene.solver.control_period = 0.001;

  // Called where each control period begins; the torques, N m, are held over it.
  Simulation simulation(
      scene, [](double, const State& state) { return Wheels(Wheels::Constant(state.V_X() < 0.3 ? 1.0 : 0.0)); });
  for (int k = 1; k <= 10; ++k) {
    simulation.advance_to(0.2 * k);
    std::printf("t = %.1f s: x = %.6f m, V_X = %.6f m/s, %zu roller switches\n", simulation.time(),
                simulation.state().x(), simulation.state().V_X(), simulation.take_switches().size());
  }
}
