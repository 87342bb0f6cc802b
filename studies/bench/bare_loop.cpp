// The least that simulate could do: a row each 1 / output_rate that nothing looks at. See scripts/study feature_cost.

#include "youbot_base_sim/simulation.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const youbot_base_sim::Scene scene = youbot_base_sim::load_scene(argv[1]);
  youbot_base_sim::Simulation simulation(scene);
  const double end = scene.duration * (1 - 1e-12);
  for (int k = 1; k / scene.output_rate < end; ++k) simulation.advance_to(k / scene.output_rate);
  simulation.advance_to(scene.duration);
}
