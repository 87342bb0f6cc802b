#pragma once

#include <string>
#include <string_view>

namespace youbot_base_sim {

/// The allowed range of a number: wider than physical sense, but so that arithmetic does not overflow.
struct Range {
  double min;
  double max;
  const char* unit;
  bool or_zero = false;  ///< 0 is allowed, too
};

/// NaN is in no range.
inline bool contains(const Range& range, double number) {
  return (number >= range.min && number <= range.max) || (range.or_zero && number == 0);
}

/// "a finite number > 0, from 1e-06 to 1e+06 kg"
std::string text_of(const Range& range);

/// True if the text is one decimal number, NaN or infinity; only then is `number` defined.
bool read_number(std::string_view text, double& number);

}  // namespace youbot_base_sim
