#include "youbot_base_sim/text/number.h"

#include <fmt/format.h>

#include <cstdlib>

namespace youbot_base_sim {

std::string text_of(const Range& range) {
  const std::string max = fmt::format("{:g}{}{}", range.max, *range.unit ? " " : "", range.unit);
  if (range.or_zero) return fmt::format("a finite number >= 0: 0 or from {:g} to {}", range.min, max);
  if (range.min > 0) return fmt::format("a finite number > 0, from {:g} to {}", range.min, max);
  if (range.min == 0) return fmt::format("a finite number >= 0, up to {}", max);
  return fmt::format("a finite number from {:g} to {}", range.min, max);
}

bool read_number(std::string_view text, double& number) {
  // strtod also takes base 16, and white space before the number.
  if (text.find_first_of("xX \t\n\v\f\r") != std::string_view::npos) return false;
  const std::string terminated(text);
  char* end = nullptr;
  number = std::strtod(terminated.c_str(), &end);
  return !terminated.empty() && end == terminated.c_str() + terminated.size();
}

}  // namespace youbot_base_sim
