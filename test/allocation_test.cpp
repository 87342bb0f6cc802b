// A simulation under way asks for no memory: its steps take the same time whatever else the process does.

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "youbot_base_sim/simulation.h"

namespace {

std::atomic<long> allocations{0};

void* allocate(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}

void* allocate(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto unit = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return memory;
  throw std::bad_alloc();
}

}  // namespace

// In place of the library's; those that are not here call these.
void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return allocate(size, alignment); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace youbot_base_sim {
namespace {

// Allocations of Case 2 from 0.1 s to 5 s, in pieces of 10 ms, its switches taken in between.
long allocations_of_case_2(const std::string& model, double control_period) {
  Simulation simulation(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml",
                                   {{"model", model}, {"solver.control_period", control_period}}));
  simulation.advance_to(0.1);
  long counted = 0;
  std::size_t switches = simulation.take_switches().size();
  for (int k = 11; k <= 500; ++k) {
    const long before = allocations;
    simulation.advance_to(0.01 * k);
    counted += allocations - before;
    switches += simulation.take_switches().size();
  }
  EXPECT_GT(switches, 100u);
  EXPECT_GT(simulation.statistics().steps, 1000u);
  return counted;
}

TEST(AllocationTest, CountsWhatIsAllocated) {
  const long before = allocations;
  std::vector<double> numbers(1000);
  EXPECT_GT(allocations, before) << numbers.data();
}

TEST(AllocationTest, ContinuousTorqueNeedsNone) {
  EXPECT_EQ(allocations_of_case_2("coulomb", 0), 0);
  EXPECT_EQ(allocations_of_case_2("viscous", 0), 0);
}

TEST(AllocationTest, HeldTorqueNeedsNone) {
  EXPECT_EQ(allocations_of_case_2("coulomb", 1e-3), 0);
  EXPECT_EQ(allocations_of_case_2("viscous", 1e-3), 0);
}

// The switches of five seconds without anyone to take them: they have their place.
TEST(AllocationTest, SwitchesNeedNone) {
  Simulation simulation(load_scene(YOUBOT_BASE_SIM_SOURCE_DIR "/config/scenes/case2.yaml"));
  simulation.advance_to(0.1);
  const long before = allocations;
  simulation.advance_to(5);
  EXPECT_EQ(allocations - before, 0);
}

}  // namespace
}  // namespace youbot_base_sim
