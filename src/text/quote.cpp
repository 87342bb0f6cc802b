#include "youbot_base_sim/text/quote.h"

#include <fmt/format.h>

#include <boost/locale/utf.hpp>
#include <vector>

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxPath = 200;  // characters of a file's name that are shown
constexpr char kCut[] = "...";

/// True if the character breaks a line, moves a cursor or reverses the direction of writing.
bool is_control(boost::locale::utf::code_point code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x61C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) || code == 0xFEFF;
}

/// Takes one character off the front of `text`, a byte where that is none in UTF-8, and returns it as it is shown.
std::string take_shown(std::string_view& text) {
  namespace utf = boost::locale::utf;
  const char* end = text.data();
  const utf::code_point code = utf::utf_traits<char>::decode(end, text.data() + text.size());
  const bool valid = code != utf::illegal && code != utf::incomplete;
  const std::string_view bytes = text.substr(0, valid ? static_cast<std::size_t>(end - text.data()) : 1);
  text.remove_prefix(bytes.size());
  if (!valid) return fmt::format("\\x{:02x}", static_cast<unsigned char>(bytes[0]));
  if (code == '\n') return "\\n";
  if (code == '\r') return "\\r";
  if (code == '\t') return "\\t";
  if (code == '\\') return "\\\\";
  if (code >= 0x80 && is_control(code)) return fmt::format("\\u{:04x}", code);
  if (is_control(code)) return fmt::format("\\x{:02x}", code);
  return std::string(bytes);
}

}  // namespace

std::string quote(std::string_view text, std::size_t max_characters) {
  std::string shown;
  for (std::size_t count = 0; !text.empty(); ++count) {
    if (count == max_characters) return shown + kCut;
    shown += take_shown(text);
  }
  return shown;
}

std::string quote_path(std::string_view path) {
  std::vector<std::string> shown;
  while (!path.empty()) shown.push_back(take_shown(path));
  const auto cut = static_cast<std::ptrdiff_t>(shown.size() > kMaxPath ? shown.size() - kMaxPath : 0);
  return fmt::format("{}{}", cut > 0 ? kCut : "", fmt::join(shown.begin() + cut, shown.end(), ""));
}

}  // namespace youbot_base_sim
