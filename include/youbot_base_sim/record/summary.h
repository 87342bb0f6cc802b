#pragma once

#include <string>

#include "youbot_base_sim/record/run_audit.h"
#include "youbot_base_sim/simulation.h"

namespace youbot_base_sim {

/// The summary of a run as a JSON object; `wall_time` in s.
std::string summary_json(const Simulation& simulation, double wall_time, const RunAudit& audit);

/// The same in a few lines for a person.
std::string summary_text(const Simulation& simulation, double wall_time);

}  // namespace youbot_base_sim
