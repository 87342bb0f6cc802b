#pragma once

#include <string>
#include <vector>

namespace youbot_base_sim {

/// Names of the integration methods, the default one first.
const std::vector<std::string>& method_names();

/// Whether an integration method has this name.
bool is_method(const std::string& name);

}  // namespace youbot_base_sim
