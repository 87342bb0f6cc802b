// Drives the base forward with 1 N m on each wheel while it is slower than 0.3 m/s, and prints where it goes.

#include <youbot_base_sim/simulation.h>

#include <cstdio>

int main() {
  using namespace youbot_base_sim;
  Scene scene = default_scene();  // or load_scene("my_scene.yaml")
  scene.solver.control_period = 0.001;

  Simulation simulation(scene);
  for (int k = 1; k <= 2000; ++k) {
    simulation.set_torque(Wheels::Constant(simulation.state().V_X() < 0.3 ? 1.0 : 0.0));  // N m
    simulation.step();
    if (k % 200 != 0) continue;
    std::printf("t = %.1f s: x = %.6f m, V_X = %.6f m/s, %zu roller switches\n", simulation.time(),
                simulation.state().x(), simulation.state().V_X(), simulation.take_switches().size());
  }
}
