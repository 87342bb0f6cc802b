#include "youbot_base_sim/integration/methods.h"

#include <algorithm>

namespace youbot_base_sim {

const std::vector<std::string>& method_names() {
  static const std::vector<std::string> names = {"radau"};
  return names;
}

bool is_method(const std::string& name) {
  const auto& names = method_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace youbot_base_sim
