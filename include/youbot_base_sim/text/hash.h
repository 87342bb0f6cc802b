#pragma once

#include <fmt/format.h>

#include <boost/crc.hpp>
#include <string>
#include <string_view>

namespace youbot_base_sim {

/// The 64-bit CRC of ECMA-182, as 16 hexadecimal digits: tells one text from another, but not from a forged one.
inline std::string hash(std::string_view text) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693> crc;
  crc.process_bytes(text.data(), text.size());
  return fmt::format("{:016x}", crc.checksum());
}

}  // namespace youbot_base_sim
