#pragma once

#include <string>
#include <string_view>

namespace youbot_base_sim {

/// The 64-bit CRC of ECMA-182, as 16 hexadecimal digits: tells one text from another, but not from a forged one.
std::string hash(std::string_view text);

}  // namespace youbot_base_sim
