// A loop at 1 kHz that does nothing, for comparison with base_node's: what this machine's scheduler alone makes late,
// and what waking up alone costs.

#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <ctime>
#include <thread>

#include "youbot_base_sim/loop/pacer.h"

int main(int argc, char** argv) {
  const double duration = argc == 2 ? std::atof(argv[1]) : 0;
  if (!(duration > 0)) {
    fmt::print(stderr, "usage: empty_loop SECONDS\n");
    return 2;
  }
  youbot_base_sim::Pacer pacer(1, 1);
  const std::clock_t before = std::clock();
  pacer.start(0);
  for (int k = 1; k * 1e-3 <= duration; ++k) {
    std::this_thread::sleep_for(std::chrono::duration<double>(pacer.wait_for(k * 1e-3)));
    pacer.arrive(k * 1e-3);
  }
  const double processor = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  const youbot_base_sim::Pacer::Timing timing = pacer.take_timing();
  fmt::print("{:.2f} {:.1f} {:.1f}\n", 100 * processor / duration, 1e6 * timing.lateness, 1e6 * timing.max_lateness);
  return 0;
}
