#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace youbot_base_sim {

/// For a library's message, in characters.
constexpr std::size_t kMaxMessage = 200;

/// Text from outside, made safe for one line of a message: control characters, invalid UTF-8, backslashes and
/// bidirectional controls are escaped as in C. A text longer than `max_characters` ends there, with "...".
std::string quote(std::string_view text, std::size_t max_characters = 60);

/// The name of a file, made safe likewise; a long one loses its beginning.
std::string quote_path(std::string_view path);

}  // namespace youbot_base_sim
