#pragma once

#include <string>
#include <vector>

#include "youbot_base_sim/sweep/family.h"

namespace youbot_base_sim {

/// What the rows of a family depend on, a line each: the program and its library, the family file, its scene, their
/// tables, each by a hash of its contents and its name. Throws SceneError where a table can no longer be read.
std::vector<std::string> fingerprint(const Family& family);

}  // namespace youbot_base_sim
