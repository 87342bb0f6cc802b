#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace youbot_base_sim {

/// Characters of a library's message that may repeat such text.
constexpr std::size_t kMaxMessage = 200;

/// Text from outside, made safe to print in one line of a message. Control characters, bytes
/// that are not UTF-8, backslashes and what turns the direction of writing are escaped as in C; what is longer than
/// `max_characters` ends there, with "...".
std::string quote(std::string_view text, std::size_t max_characters = 60);

/// The same for the name of a file; a long one loses its beginning.
std::string quote_path(std::string_view path);

}  // namespace youbot_base_sim
