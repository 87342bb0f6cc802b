#include "youbot_base_sim/text/hash.h"

#include <fmt/format.h>

#include <boost/crc.hpp>

namespace youbot_base_sim {

std::string hash(std::string_view text) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693> crc;
  crc.process_bytes(text.data(), text.size());
  return fmt::format("{:016x}", crc.checksum());
}

}  // namespace youbot_base_sim
