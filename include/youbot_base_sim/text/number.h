#pragma once

#include <string>
#include <string_view>

namespace youbot_base_sim {

/// Numbers that a key, a column or a parameter may have: all that make physical sense and more, but none with which
/// arithmetic overflows.
struct Range {
  double min;
  double max;
  const char* unit;
  bool or_zero = false;  ///< 0 is allowed beside what is from min to max
};

/// NaN is in no range.
inline bool contains(const Range& range, double number) {
  return (number >= range.min && number <= range.max) || (range.or_zero && number == 0);
}

/// "a finite number > 0, from 1e-06 to 1e+06 kg"
std::string text_of(const Range& range);

/// Whether all of the text is one number to base 10, which may be NaN or infinite; only then is `number` defined.
bool read_number(std::string_view text, double& number);

}  // namespace youbot_base_sim
