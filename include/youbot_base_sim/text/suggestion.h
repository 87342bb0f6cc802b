#pragma once

#include <string>
#include <vector>

namespace youbot_base_sim {

/// "; did you mean X?" if one of `known` is close to `word`, else nothing.
std::string suggestion(const std::string& word, const std::vector<std::string>& known);

}  // namespace youbot_base_sim
