#include "wheel_table.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "youbot_base_sim/scene/scene.h"

namespace youbot_base_sim {

namespace {

std::vector<std::string> cells_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    const auto first = cell.find_first_not_of(" \t\""), last = cell.find_last_not_of(" \t\"");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  if (!line.empty() && line.back() == ',') cells.emplace_back();
  return cells;
}

/// The columns of t, fl, fr, bl and br, in this order.
std::vector<std::size_t> columns_of(const std::string& path, const std::string& header) {
  const std::vector<std::string> cells = cells_of(header);
  std::vector<std::size_t> columns;
  for (const std::string name : {"t", "fl", "fr", "bl", "br"}) {
    for (std::size_t k = 0; k < cells.size(); ++k) {
      if (cells[k] == name) columns.push_back(k);
    }
  }
  if (columns.size() != 5 || cells.size() != 5) {
    throw SceneError(fmt::format("{}:1: header = {}: must be the columns t,fl,fr,bl,br", path, header));
  }
  return columns;
}

}  // namespace

WheelTable read_wheel_table(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw SceneError(fmt::format("{}: cannot be read; must be a CSV file with t,fl,fr,bl,br", path));
  std::string line;
  std::getline(file, line);
  const std::vector<std::size_t> columns = columns_of(path, line);

  WheelTable table;
  for (int number = 2; std::getline(file, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() != 5) {
      throw SceneError(fmt::format("{}:{}: {}: must be 5 numbers", path, number, line));
    }
    double row[5];
    for (std::size_t k = 0; k < 5; ++k) {
      const std::string& cell = cells[columns[k]];
      char* end = nullptr;
      row[k] = std::strtod(cell.c_str(), &end);
      if (cell.empty() || *end != '\0' || !std::isfinite(row[k])) {
        throw SceneError(fmt::format("{}:{}: {}: must be a finite number", path, number, cell));
      }
    }
    if (!table.t.empty() && row[0] <= table.t.back()) {
      throw SceneError(fmt::format("{}:{}: t = {}: must be greater than the row's before, {}", path, number, row[0],
                                   table.t.back()));
    }
    table.t.push_back(row[0]);
    table.values.emplace_back(row[1], row[2], row[3], row[4]);
  }
  if (table.t.empty()) throw SceneError(fmt::format("{}: no rows; must have at least one", path));
  return table;
}

}  // namespace youbot_base_sim
