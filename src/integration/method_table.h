#pragma once

#include <memory>
#include <string>
#include <vector>

#include "youbot_base_sim/integration/methods.h"
#include "youbot_base_sim/integration/smooth_stepper.h"
#include "youbot_base_sim/integration/statistics.h"
#include "youbot_base_sim/integration/tolerance.h"

namespace youbot_base_sim {

/// Makes a method that is made for any equations; `step` is that of a method without step size control, s.
using MakeGeneralMethod = std::unique_ptr<GeneralMethod> (*)(const Tolerance& tolerance, double step,
                                                             IntegrationStatistics& statistics);

/// A method, and what makes it; null for Radau, which is made for these equations and for each friction law.
struct MethodEntry {
  Method method;
  MakeGeneralMethod make;
};

/// All methods, the default one first.
const std::vector<MethodEntry>& method_table();

/// The method of that name; null if there is none.
const MethodEntry* find_entry(const std::string& name);

}  // namespace youbot_base_sim
