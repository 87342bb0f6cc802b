#pragma once

#include <boost/any.hpp>
#include <boost/program_options.hpp>
#include <charconv>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "youbot_base_sim/text/number.h"
#include "youbot_base_sim/text/quote.h"

namespace youbot_base_sim {

/// What an option of a command line may not be, in one line that names the option, its value and what is allowed.
class OptionError : public std::runtime_error {
 public:
  OptionError(const std::string& option, const std::string& value, const std::string& allowed)
      : std::runtime_error(option + " = " + (value.empty() ? "\"\"" : quote(value)) + ": must " + allowed) {}
};

/// The number that an option's value is. Throws OptionError.
inline double number_of(const std::string& option, const std::string& value, const Range& range) {
  double number = 0;
  if (read_number(value, number) && contains(range, number)) return number;
  throw OptionError(option, value, "be " + text_of(range));
}

/// The same for a whole number from `min` to `max`, in digits alone.
inline std::uint64_t whole_number_of(const std::string& option, const std::string& value, std::uint64_t min,
                                     std::uint64_t max) {
  std::uint64_t number = 0;
  const char* const end = value.data() + value.size();
  const auto [parsed, error] = std::from_chars(value.data(), end, number);
  if (error == std::errc() && parsed == end && number >= min && number <= max) return number;
  throw OptionError(option, value, "be a whole number from " + std::to_string(min) + " to " + std::to_string(max));
}

/// Throws OptionError if a text is given but empty, as an unset variable of a shell is. `positional` is what stands
/// without an option's name.
inline void refuse_empty(const boost::program_options::variables_map& given, const std::string& positional) {
  for (const auto& [name, value] : given) {
    std::vector<std::string> texts;
    if (const auto* one = boost::any_cast<std::string>(&value.value())) texts = {*one};
    if (const auto* several = boost::any_cast<std::vector<std::string>>(&value.value())) texts = *several;
    for (const std::string& text : texts) {
      if (!text.empty()) continue;
      throw OptionError(name == positional ? name : "--" + name, text, "not be empty");
    }
  }
}

}  // namespace youbot_base_sim
