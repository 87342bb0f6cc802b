#include "youbot_base_sim/text/quote.h"

#include <fmt/format.h>

#include <vector>

namespace youbot_base_sim {

namespace {

constexpr std::size_t kMaxPath = 200;  // characters of a file's name that are shown
constexpr char kCut[] = "...";

/// Takes one character off the front of `text` if that is one in UTF-8, as RFC 3629 has it, else one byte. Returns its
/// code point, negative for a byte; `bytes` is the part of the text that it took.
int take_character(std::string_view& text, std::string_view& bytes) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const int first = byte(0);
  const std::size_t length = first < 0x80 ? 1 : first < 0xC0 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  constexpr int kFirstOfLength[] = {0, 0, 0x80, 0x800, 0x10000};  // what fits into fewer bytes must use fewer
  int code = length <= 1 ? first : first & (0x7F >> length);
  bool valid = length > 0 && length <= text.size();
  for (std::size_t k = 1; valid && k < length; ++k) {
    valid = (byte(k) & 0xC0) == 0x80;
    code = code << 6 | (byte(k) & 0x3F);
  }
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  valid = valid && code >= kFirstOfLength[length] && code <= 0x10FFFF && !surrogate;
  bytes = text.substr(0, valid ? length : 1);
  text.remove_prefix(bytes.size());
  return valid ? code : -1;
}

/// Whether the character breaks a line, moves a cursor or turns the direction of writing.
bool is_control(int code) {
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x61C || code == 0x200E || code == 0x200F ||
         (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069) || code == 0xFEFF;
}

/// Takes one character off the front of `text` and returns it as it is shown.
std::string take_shown(std::string_view& text) {
  std::string_view bytes;
  const int code = take_character(text, bytes);
  if (code == '\n') return "\\n";
  if (code == '\r') return "\\r";
  if (code == '\t') return "\\t";
  if (code == '\\') return "\\\\";
  if (code >= 0x80 && is_control(code)) return fmt::format("\\u{:04x}", code);
  if (is_control(code)) return fmt::format("\\x{:02x}", static_cast<unsigned char>(bytes[0]));
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
  constexpr std::size_t kMaxBytes = 4;  // of a character
  const bool cut = path.size() > kMaxBytes * kMaxPath;
  if (cut) path.remove_prefix(path.size() - kMaxBytes * kMaxPath);
  std::vector<std::string> shown;
  while (!path.empty()) shown.push_back(take_shown(path));
  const std::size_t first = shown.size() > kMaxPath ? shown.size() - kMaxPath : 0;
  std::string end = cut || first > 0 ? kCut : "";
  for (std::size_t k = first; k < shown.size(); ++k) end += shown[k];
  return end;
}

}  // namespace youbot_base_sim
