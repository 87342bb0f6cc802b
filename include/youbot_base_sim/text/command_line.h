#pragma once

#include <boost/any.hpp>
#include <boost/program_options.hpp>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// Throws boost::program_options::error if a text is given but empty, as an unset variable of a shell is. `positional`
/// is what stands without an option's name.
inline void refuse_empty(const boost::program_options::variables_map& given, const std::string& positional) {
  for (const auto& [name, value] : given) {
    std::vector<std::string> texts;
    if (const auto* one = boost::any_cast<std::string>(&value.value())) texts = {*one};
    if (const auto* several = boost::any_cast<std::vector<std::string>>(&value.value())) texts = *several;
    for (const std::string& text : texts) {
      if (!text.empty()) continue;
      const std::string option = name == positional ? name : "--" + name;
      throw boost::program_options::error(option + " = \"\": must not be empty");
    }
  }
}

}  // namespace youbot_base_sim
