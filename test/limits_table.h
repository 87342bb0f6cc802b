#pragma once

#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace youbot_base_sim {

/// A row of a table in docs/limits.
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

/// The rows of docs/limits/NAME.csv.
inline std::vector<Limits> limits(const std::string& name) {
  std::ifstream file(YOUBOT_BASE_SIM_SOURCE_DIR "/docs/limits/" + name + ".csv");
  const std::regex row("(.*),(0 or )?([-+.e0-9]+),([-+.e0-9]+),(.*)");
  std::vector<Limits> rows;
  for (std::string line; std::getline(file, line);) {
    std::smatch cells;
    if (std::regex_match(line, cells, row)) rows.push_back({cells[1], cells[3], cells[4], cells[2].matched, cells[5]});
  }
  return rows;
}

}  // namespace youbot_base_sim
