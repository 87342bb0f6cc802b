#pragma once

#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// A row of the tables in docs/limits.md.
struct Limits {
  std::string key;
  std::string min, max;  ///< as written
  bool or_zero;          ///< 0 is allowed, too
  std::string unit;

  /// Numbers that are just allowed.
  std::vector<std::string> ends() const {
    return or_zero ? std::vector<std::string>{"0", min, max} : std::vector<std::string>{min, max};
  }
  /// Numbers that are not, from just beyond to far beyond.
  std::vector<std::string> beyond() const {
    const double least = std::stod(min), most = std::stod(max);
    std::vector<std::string> numbers{text(1.001 * most), "1e308", "-1e308"};
    if (least < 0) numbers.push_back(text(1.001 * least));
    if (least == 0) numbers.push_back("-1e-9");
    if (least > 0) numbers.insert(numbers.end(), {text(0.999 * least), "1e-320"});
    if (least > 0 && !or_zero) numbers.push_back("0");
    return numbers;
  }

  static std::string text(double number) {
    std::ostringstream stream;
    stream << number;
    return stream.str();
  }
};

/// All that a text with alternatives in braces stands for: "a{b,c}" for "ab" and "ac".
inline std::vector<std::string> expanded(const std::string& text) {
  const auto open = text.find('{'), close = text.find('}');
  if (open == std::string::npos) return {text};
  std::vector<std::string> all;
  std::istringstream alternatives(text.substr(open + 1, close - open - 1));
  for (std::string one; std::getline(alternatives, one, ',');) {
    for (const std::string& rest : expanded(text.substr(close + 1))) all.push_back(text.substr(0, open) + one + rest);
  }
  return all;
}

/// The rows under this heading of docs/limits.md, one for each key.
inline std::vector<Limits> limits(const std::string& heading) {
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/docs/limits.md");
  const std::regex row(R"(\| `(.*)`(?:, a whole number)? \| (0 or )?([-+.e0-9]+) \| ([-+.e0-9]+) \| (.*?) ?\|)");
  std::vector<Limits> rows;
  std::string section;
  for (std::string line; std::getline(file, line);) {
    std::smatch cells;
    if (line.rfind("## ", 0) == 0) section = line.substr(3);
    if (section != heading || !std::regex_match(line, cells, row)) continue;
    for (const std::string& key : expanded(cells[1])) {
      rows.push_back({key, cells[3], cells[4], cells[2].matched, cells[5]});
    }
  }
  return rows;
}

}  // namespace youbot_base_sim
