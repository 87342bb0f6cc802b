// A loop at 1 kHz that does nothing: what this machine's scheduler alone makes late, and what waking up alone costs.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <thread>

int main(int argc, char** argv) {
  const double duration = argc > 1 ? std::atof(argv[1]) : 20;  // s
  using Clock = std::chrono::steady_clock;
  const std::clock_t before = std::clock();
  const Clock::time_point start = Clock::now();
  double lateness = 0, max_lateness = 0;  // us
  int instants = 0;
  while ((instants + 1) * 1e-3 <= duration) {
    const Clock::time_point due = start + ++instants * std::chrono::milliseconds(1);
    std::this_thread::sleep_until(due);
    const double late = std::chrono::duration<double, std::micro>(Clock::now() - due).count();
    lateness += late;
    max_lateness = std::max(max_lateness, late);
  }
  const double processor = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  fmt::print("{:.2f} {:.1f} {:.1f}\n", 100 * processor / duration, lateness / std::max(1, instants), max_lateness);
  return 0;
}
