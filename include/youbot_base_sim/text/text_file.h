#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace youbot_base_sim {

/// The reason why a file cannot be read, without its name, so that "NAME REASON" is a clause: "is a folder".
struct UnreadableFile : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The whole text of a file or pipe, without a byte order mark of UTF-8; waits for slow writers. Throws UnreadableFile
/// for a folder, a device, a socket, a read error, more than `max_bytes`, and a pipe without a writer.
std::string read_text_file(const std::string& path, std::size_t max_bytes);

}  // namespace youbot_base_sim
